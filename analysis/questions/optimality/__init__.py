"""Questions about how far policies are from the best possible, and about planners."""
