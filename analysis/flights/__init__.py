"""Flights of a mission as plans for an autopilot: when each UAV flies where, and the files."""
