"""Environments for learners, over the rules that both engines use.

``parallel_env`` is a PettingZoo ``ParallelEnv`` of one mission, ``batch_env`` the vectorised form
that steps many. Both count replications: mission r of seed s is the one that ``dess.simulate``
runs for them, and the same actions lead to the same record, bit for bit.

An observation is the vector that ``dess.env.observation`` lays out, with a mask of the legal
actions; an action is 0 north, 1 east, 2 south, 3 west, 4 hover. A move off the grid is one that
the safety controller overrules. A UAV that charges hovers, whatever was asked, without a penalty.
"""
