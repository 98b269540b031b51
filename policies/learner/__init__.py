"""The learned policies: a network that all UAVs share, and its training.

``config`` has the settings of a training. ``network`` computes Q-values from observations.
``training`` is what all trainings share, ``dqn`` Algorithm 1 of the paper (double DQN) with its
replay memory, ``ppo`` the training for any sea (proximal policy optimization), ``session`` runs a
training in a folder, and ``policy`` is the trained policy.

Files may come from anybody and are checked when they are read: ``checkpoint`` is a training that
can go on, ``trained`` the folder of a policy, whose ``config.json`` is in ``config`` as well;
``arrays`` has the files of both.
"""
