"""Running a study: rounds of jobs, workers, and what it would cost."""
