"""Statistics: intervals, paired comparisons, learners, verdicts."""
