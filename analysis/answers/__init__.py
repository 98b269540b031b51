"""Answers from results, one subject per module: its tidy tables, sentences and figures."""
