"""The return guard: when UAVs must charge, where, and which moves keep a charge in reach."""
