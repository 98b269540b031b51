"""Statistics of missions: intervals, paired comparisons, learners, and what an interval says."""
