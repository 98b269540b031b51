"""The learned policy: a double deep Q-network that all UAVs share, and its training.

``config`` has the settings, ``observations`` and ``network`` compute Q-values, ``replay`` stores
transitions, ``learner`` does the update, ``training`` is Algorithm 1, ``session`` runs it in a
folder, ``checkpoint`` reads and writes files, and ``policy`` is the result.
"""
