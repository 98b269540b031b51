"""Environments for reinforcement learning, with the same rules of the model as both engines.

    env = dess.parallel_env("paper")   # PettingZoo: one mission
    observations, infos = env.reset(seed=1)
    observations, rewards, terminated, truncated, infos = env.step(actions)

    envs = dess.vector_env("paper", num_envs=64)   # Gymnasium: many missions
    env = dess.single_env("paper")   # Gymnasium: one mission of one UAV

Gymnasium knows the last two by a name, once this package is imported, as the name itself may ask::

    envs = gymnasium.make_vec("dess.envs:dess/Paper-v0", num_envs=64)
    env = gymnasium.make("dess.envs:dess/Paper-v0")

All environments number their missions: replication r of seed s is the mission that
``dess.simulate`` runs with this seed and replication, and the same actions give the same record,
bit for bit.

What UAVs observe, and the masks of their actions, come from ``dess.envs.observations``; an action
is 0 north, 1 east, 2 south, 3 west, 4 hover. The safety controller overrules a move off the grid.
A charging UAV hovers whatever action it is given, and receives no penalty for that.
"""

import gymnasium

gymnasium.register(
    "dess/Paper-v0",
    entry_point="dess.envs.single:single_env",
    vector_entry_point="dess.envs.vector:vector_env",
    kwargs={"scenario": "paper"},
)
