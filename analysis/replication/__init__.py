"""The paper: its printed figures, its claims, and the verdicts on them."""
