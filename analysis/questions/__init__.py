"""Questions about results, answered by functions that return tidy tables."""
