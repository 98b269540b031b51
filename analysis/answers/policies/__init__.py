"""Pairs of policies in the same missions, and the times of their decisions."""
