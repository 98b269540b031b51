"""The parts of the model's physics with their settings and compiled functions.

Each section of a scenario has a module. ``chart`` has the geometry of a sea, ``streams`` the random
numbers.
"""
