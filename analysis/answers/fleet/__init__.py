"""The cheapest fleet that meets requirements, and whether its UAVs come home."""
