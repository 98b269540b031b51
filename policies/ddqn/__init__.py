"""The learned policy: a double deep Q-network that all UAVs share, and its training.

``config`` has the settings of a training. ``observations`` and ``network`` compute Q-values,
``replay`` stores transitions, ``learner`` updates the network, ``training`` is Algorithm 1 of the
paper, ``session`` runs a training in a folder, ``checkpoint`` reads and writes files, and
``policy`` is the trained policy.
"""
