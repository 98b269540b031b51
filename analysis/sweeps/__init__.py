"""Sweeps: every combination of values of some fields, asked in one line and kept."""
