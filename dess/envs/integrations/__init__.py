"""The environments as classes of other libraries, a module per library.

A module imports its library, so it is only imported by who has installed it.
"""
