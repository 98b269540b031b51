"""The learned policy: a double deep Q-network, shared by all UAVs, and how it is trained."""
