"""PettingZoo's and Gymnasium's own tests, for every choice of ``parallel_env``."""

import warnings
from itertools import product
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import (
    api_test,
    max_cycles_test,
    parallel_api_test,
    parallel_seed_test,
    seed_test,
    state_test,
)
from pettingzoo.utils import parallel_to_aec

import dess
from dess.env.parallel import HarvestEnv
from dess.observations.observer import KINDS
from tests.dess.env.episodes import play

# Missions short enough to be played often, in which some UAVs end before others.
QUICK: dict[str, Any] = {"flying_time": [8, 40], "charge_start": 10, "max_slots": 60}
FLEETS = {"fixed": 3, "drawn": [1, 3]}
OPTIONS: dict[str, tuple] = {
    "observation": KINDS,
    "mask": ("observation", "info"),
    "ended": ("leave", "stay"),
    "guarded": (False, True),
}
# Combinations that are tested with each observation; all others are by ``nox -s verify``.
QUICKLY = (("observation", "leave", False), ("info", "stay", True))
CHOICES = [
    pytest.param(
        dict(zip(OPTIONS, values, strict=True)),
        id="-".join(map(str, values)),
        marks=[] if values[1:] in QUICKLY else pytest.mark.slow,
    )
    for values in product(*OPTIONS.values())
]
every_choice = pytest.mark.parametrize("choice", CHOICES)
every_fleet = pytest.mark.parametrize("fleet", FLEETS)


def made(fleet: str, **choice: Any) -> HarvestEnv:
    return dess.parallel_env(dess.load_scenario("paper", uavs=FLEETS[fleet], **QUICK), **choice)


@every_fleet
@every_choice
def test_pettingzoos_tests_pass(choice: dict[str, Any], fleet: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # The fleet of an episode can be smaller than the largest one.
        warnings.filterwarnings("ignore", "No agents present but not all possible_agents")
        warnings.filterwarnings("ignore", "Environment's maximum state")  # data is not bounded
        parallel_api_test(made(fleet, **choice), num_cycles=100)
        parallel_seed_test(lambda: made(fleet, **choice), num_cycles=20)
        seed_test(lambda: parallel_to_aec(made(fleet, **choice)), num_cycles=20)
        state_test(parallel_to_aec(made(fleet, **choice)), made(fleet, **choice))


@pytest.mark.filterwarnings("ignore:Observation:UserWarning")  # a dictionary; zeros after the end
@pytest.mark.filterwarnings("ignore:Agent's m..imum observation:UserWarning")  # no bounds
@every_fleet
@every_choice
def test_pettingzoos_api_test_passes_after_parallel_to_aec(
    choice: dict[str, Any], fleet: str
) -> None:
    api_test(parallel_to_aec(made(fleet, **choice)), num_cycles=100)


@pytest.mark.parametrize(
    ("fleet", "ended"), [("fixed", "leave"), ("fixed", "stay"), ("drawn", "stay")]
)
def test_pettingzoos_max_cycles_test_passes(fleet: str, ended: str) -> None:
    """``max_cycles`` is ``max_slots`` of the scenario; nobody ends before in this mission."""

    def mission(max_cycles: int) -> HarvestEnv:
        scenario = dess.load_scenario("paper", uavs=FLEETS[fleet], max_slots=max_cycles)
        return dess.parallel_env(scenario, ended=ended)

    def turns(max_cycles: int) -> Any:
        return parallel_to_aec(mission(max_cycles))

    max_cycles_test(SimpleNamespace(parallel_env=mission, env=turns))


@every_choice
def test_infos_are_numbers_and_arrays_with_the_same_keys_in_every_step(
    choice: dict[str, Any],
) -> None:
    story = play(made("drawn", **choice), 0, seed=2)
    kinds = [
        {
            key: (type(value), getattr(value, "dtype", None), np.shape(value))
            for key, value in info.items()
        }
        for *_, infos in story
        for info in infos.values()
    ]
    assert len(kinds) > 10 and all(kind == kinds[0] for kind in kinds)
    expected = {
        "active": bool,
        "reward_terms": np.ndarray,
        "collected": float,
        "team_collected": float,
        "end": int,
        "overruled": bool,
    } | ({"action_mask": np.ndarray} if choice["mask"] == "info" else {})
    assert {key: kind[0] for key, kind in kinds[0].items()} == expected
    for observations, *_, infos in story:  # a mask stands in one place
        for agent in infos:
            own = observations[agent]
            in_observation = isinstance(own, dict) and "action_mask" in own
            assert in_observation == (choice["mask"] == "observation")


class LoneUav(gymnasium.Env):
    """A mission of one UAV as a Gymnasium ``Env``, which is what ``check_env`` takes."""

    def __init__(self) -> None:
        scenario = dess.load_scenario("paper", uavs=1, **QUICK)
        self.env = dess.parallel_env(scenario, mask="info", ended="stay", render_mode="rgb_array")
        self.metadata, self.render_mode = self.env.metadata, self.env.render_mode
        self.observation_space = self.env.observation_space("uav_0")
        self.action_space = self.env.action_space("uav_0")

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> Any:
        super().reset(seed=seed)
        return tuple(part["uav_0"] for part in self.env.reset(seed, options))

    def step(self, action: Any) -> Any:
        return tuple(part["uav_0"] for part in self.env.step({"uav_0": action}))

    def render(self) -> Any:
        return self.env.render()


def test_gymnasiums_check_env_passes_for_a_lone_uav() -> None:
    """``check_env`` takes environments of one agent, so neither those of a team nor vectors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*(infinity|not within the registry|spec|render)")
        check_env(LoneUav())
