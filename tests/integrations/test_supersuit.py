"""SuperSuit: its wrappers, and its vector environments on the way to stable-baselines3.

SuperSuit 3.11 installs with the pins of the project and changes none of them. Its wrappers take
plain arrays, so the mask stands in the info. Its vector environments take teams from which nobody
leaves, so UAVs that have ended stay. stable-baselines3 cannot seed them, which have no ``seed``;
a reset of the environment below does, and gives each copy missions of its own.
"""

from functools import partial
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

import dess
from dess.env.parallel import HarvestEnv
from dess.state import HOVER

supersuit = pytest.importorskip("supersuit")

WRAPPERS: dict[str, Any] = {
    "flatten_v0": supersuit.flatten_v0,
    "dtype_v0": partial(supersuit.dtype_v0, dtype=np.float32),
    "frame_stack_v1": partial(supersuit.frame_stack_v1, stack_size=3),
    "agent_indicator_v0": supersuit.agent_indicator_v0,
    "pad_observations_v0": supersuit.pad_observations_v0,
    "black_death_v3": supersuit.black_death_v3,
}
FLEETS = {"fixed": 3, "drawn": [1, 3]}
every_wrapper = pytest.mark.parametrize("wrapper", WRAPPERS)
every_fleet = pytest.mark.parametrize("fleet", FLEETS)
both_ways = pytest.mark.parametrize("ended", ["leave", "stay"])
COPIES, ROWS = 2, 6


def team(fleet: str | int, ended: str = "stay", **values: Any) -> HarvestEnv:
    """A mission in which some UAVs end before others."""
    uavs = FLEETS[fleet] if isinstance(fleet, str) else fleet
    scenario = dess.load_scenario(
        "paper", uavs=uavs, flying_time=[8, 40], charge_start=10, max_slots=60
    )
    return dess.parallel_env(scenario, mask="info", ended=ended, **values)


def vectors(fleet: str | int, base_class: str = "gymnasium") -> Any:
    """Two copies of a mission in one vector environment."""
    env = supersuit.pettingzoo_env_to_vec_env_v1(team(fleet))
    return supersuit.concat_vec_envs_v1(env, COPIES, num_cpus=1, base_class=base_class)


def legal(infos: Any, generator: np.random.Generator) -> np.ndarray:
    """A random legal action of each row."""
    return np.array([generator.choice(np.flatnonzero(info["action_mask"])) for info in infos])


@both_ways
@every_fleet
@every_wrapper
def test_wrappers(wrapper: str, fleet: str, ended: str) -> None:
    """Whole episodes have the rewards and the ends of the plain environment."""
    plain, env = team(fleet, ended), WRAPPERS[wrapper](team(fleet, ended))
    generator = np.random.default_rng(0)
    for seed in range(3):
        expected, expected_infos = plain.reset(seed)
        observations, infos = env.reset(seed)
        assert data_equivalence(infos, expected_infos, exact=True)
        for agent, own in observations.items():
            # What some wrappers add stands behind or before the observation.
            assert set(expected[agent].tolist()) <= set(own.ravel().tolist())
        while plain.agents:
            actions = {agent: int(generator.integers(5)) for agent in plain.possible_agents}
            _, rewards, *_ = plain.step({agent: actions[agent] for agent in plain.agents})
            observations, gained, *_, infos = env.step({a: actions[a] for a in env.agents})
            assert rewards.items() <= gained.items()
            assert set(observations) >= set(rewards)
            assert all(env.observation_space(a).contains(own) for a, own in observations.items())
        if wrapper == "black_death_v3":  # which ends in the step after the last
            env.step(dict.fromkeys(env.agents, HOVER))
        assert not env.agents


@every_fleet
def test_contract(fleet: str) -> None:
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
