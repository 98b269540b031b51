"""A study of policies of known levels on common realisations, for the tests of comparisons."""

import numpy as np
import pandas as pd

METRIC = "collection_ratio"


def rng(seed=1):
    return np.random.default_rng(seed)


def study(policies=("tour", "greedy", "ddqn", "ddqn-2"), points=2, n=12):
    """Missions whose collection ratio is common noise, the policy's level, and noise of its own."""
    frames = []
    for level, policy in enumerate(policies):
        for point in range(points):
            common, noise = rng(9).normal(0.5, 0.1, n), rng((level, point)).normal(0, 0.01, n)
            ratio = common + noise + 0.01 * level + 0.2 * point
            labels = {"policy": policy, "point": point, "quota": 100 * point, "seed": 7}
            values = {"replication": range(n), "uavs": np.arange(n) % 3 + 1, METRIC: ratio}
            success = (rng((level, 5)).random(n) < 0.8).astype(int)
            frames.append(pd.DataFrame(labels | values | {"success": success, "reward": -ratio}))
    return pd.concat(frames, ignore_index=True)


STUDY = study()


def ratios(policy, point=0):
    chosen = (STUDY["policy"] == policy) & (STUDY["point"] == point)
    return STUDY[chosen].sort_values("replication")[METRIC].to_numpy()
