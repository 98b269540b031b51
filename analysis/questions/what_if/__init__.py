"""What if: a question about a variation of a scenario, and its answer."""
