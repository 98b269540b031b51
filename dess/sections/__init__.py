"""The sections of a scenario: what goes beyond the paper, each part off by default.

A module has the fields of its section, and the compiled functions that the rules call when the
section is on. ``Scenario`` has every section as a field; ``--set failures.uav_rate=0.001`` sets one
of its fields.
"""
