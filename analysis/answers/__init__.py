"""Answers from results, one subject per module; its functions return tidy tables and sentences."""
