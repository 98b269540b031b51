"""Figures; each function returns one figure."""
