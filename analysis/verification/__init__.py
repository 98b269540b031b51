"""Verification of the simulator against exact theory: statistical checks and exact checks."""
