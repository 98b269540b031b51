"""The learned policies: a network that all UAVs share, and its training.

``config`` has the settings of a training. ``network`` computes Q-values from observations, ``dqn``
has the replay memory and updates the network, ``training`` is Algorithm 1 of the paper (double
DQN), ``ppo`` the training for any sea (proximal policy optimization), ``session`` runs a training
in a folder, and ``policy`` is the trained policy.

Files may come from anybody and are checked when they are read: ``checkpoint`` is a training that
can go on, ``trained`` the folder of a policy, ``description`` its ``config.json``, and ``tensors``
reads and writes arrays.
"""
