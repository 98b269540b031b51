"""The replication of the paper: its printed numbers, its claims, and the verdicts on them."""
