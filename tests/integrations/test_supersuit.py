"""SuperSuit: its vector environments on the way to stable-baselines3.

SuperSuit 3.11 installs with the pins of the project and changes none of them. Its wrappers take
plain arrays, so the mask stands in the info. Its vector environments take teams from which nobody
leaves, so UAVs that have ended stay. stable-baselines3 cannot seed them, which have no ``seed``;
a reset of the environment below does, and gives each copy missions of its own.
"""

from typing import Any

import numpy as np
import pytest

import dess
from dess.envs.parallel import HarvestEnv

supersuit = pytest.importorskip("supersuit")

FLEETS = {"fixed": 3, "drawn": [1, 3]}
COPIES, ROWS = 2, 6


def team(fleet: str) -> HarvestEnv:
    """A mission in which some UAVs end before others."""
    values = {"uavs": FLEETS[fleet], "flying_time": [8, 40], "charge_start": 10, "max_slots": 60}
    return dess.parallel_env(dess.load_scenario("paper", **values), mask="info", ended="stay")


def vectors(fleet: str, base_class: str = "gymnasium") -> Any:
    """Two copies of a mission in one vector environment."""
    env = supersuit.pettingzoo_env_to_vec_env_v1(team(fleet))
    return supersuit.concat_vec_envs_v1(env, COPIES, num_cpus=1, base_class=base_class)


def legal(infos: Any, generator: np.random.Generator) -> np.ndarray:
    """A random legal action of each row."""
    return np.array([generator.choice(np.flatnonzero(info["action_mask"])) for info in infos])


@pytest.mark.parametrize("fleet", FLEETS)
def test_contract(fleet):
    """The UAVs of a copy end together, and stable-baselines3 learns from its rows."""
    env, generator = vectors(fleet), np.random.default_rng(0)
    _, infos = env.reset(seed=1)
    waited = ended = 0
    for _ in range(150):
        waits = np.array([not info["active"] for info in infos])
        observations, rewards, terminated, truncated, infos = env.step(legal(infos, generator))
        over = (terminated | truncated).reshape(COPIES, -1)
        assert (over.all(1) == over.any(1)).all()
        assert not rewards[waits].any()
        assert not observations[waits & ~over.ravel().astype(bool)].any()
        assert all(
            ("terminal_observation" in infos[row]) == over.ravel()[row] for row in range(ROWS)
        )
        waited += waits.sum()
        ended += over.sum()
    assert waited and ended

    sb3 = pytest.importorskip("stable_baselines3")
    env = vectors(fleet, "stable_baselines3")
    env.venv.reset(seed=1)
    model = sb3.PPO("MlpPolicy", env, n_steps=16, batch_size=48, n_epochs=1, device="cpu")
    before = [weights.clone() for weights in model.policy.parameters()]
    model.learn(16 * ROWS)
    assert model.num_timesteps == 16 * ROWS
    after = model.policy.parameters()
    assert any(not a.equal(b) for a, b in zip(before, after, strict=True))
