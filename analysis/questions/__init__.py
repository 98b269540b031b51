"""What people ask of results, answered in tidy tables."""
