"""What-if questions: the effect of a variation of a scenario."""
