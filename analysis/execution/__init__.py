"""Running a study: rounds of jobs, workers, and estimates of the time that a run takes."""
