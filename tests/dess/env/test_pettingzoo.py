"""PettingZoo's and Gymnasium's own tests, for every choice of ``parallel_env``."""

import warnings
from itertools import product
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env, data_equivalence
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
from dess.state import ACTION_NAMES
from tests.dess.env.episodes import masks_of, play

# Missions short enough to be played often, in which some UAVs end before others.
QUICK: dict[str, Any] = {"flying_time": [8, 40], "charge_start": 10, "max_slots": 60}
FLEETS = {"fixed": 3, "drawn": [1, 3]}
OPTIONS: dict[str, tuple] = {
    "observation": KINDS,
    "mask": ("observation", "info"),
    "ended": ("leave", "stay"),
    "guarded": (False, True),
}
CHOICES = [dict(zip(OPTIONS, values, strict=True)) for values in product(*OPTIONS.values())]
every_choice = pytest.mark.parametrize(
    "choice", CHOICES, ids=lambda choice: "-".join(map(str, choice.values()))
)
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
def test_the_choices_do_not_change_the_mission(choice: dict[str, Any]) -> None:
    """The same actions give the same rewards and record; every observation is in its space."""
    env = made("drawn", **choice)
    plain = made("drawn", guarded=choice["guarded"])
    for replication in range(3):
        story = play(env, replication, seed=1, options={"replication": replication})
        expected = play(plain, replication, seed=1, options={"replication": replication})
        assert data_equivalence(env.record().metrics, plain.record().metrics, exact=True)
        assert np.array_equal(env.record().uavs, plain.record().uavs)
        assert len(story) == len(expected)
        for (observations, *_, infos), (plain_seen, *_, plain_infos) in zip(
            story, expected, strict=True
        ):
            masks, plain_masks = masks_of(observations, infos), masks_of(plain_seen, plain_infos)
            for agent in observations:
                assert env.observation_space(agent).contains(observations[agent])
                if agent in plain_masks:
                    assert np.array_equal(masks[agent], plain_masks[agent])
                assert masks[agent].dtype == np.int8 and masks[agent].shape == (len(ACTION_NAMES),)
                assert masks[agent].any()
        for (*_, rewards, _, _, _), (*_, plain_rewards, _, _, _) in zip(
            story[1:], expected[1:], strict=True
        ):
            assert plain_rewards.items() <= rewards.items()


@every_choice
def test_a_mask_stands_in_one_place(choice: dict[str, Any]) -> None:
    env = made("drawn", **choice)
    in_info = choice["mask"] == "info"
    for observations, *_, infos in play(env, 0, seed=2):
        for agent, info in infos.items():
            own = observations[agent]
            assert ("action_mask" in info) == in_info
            assert (isinstance(own, dict) and "action_mask" in own) == (not in_info)
    if in_info and choice["observation"] in ("vector", "state"):
        assert isinstance(env.observation_space("uav_0"), spaces.Box)
        assert env.observation_space("uav_0").dtype == np.float32


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


def test_a_step_leaves_what_it_returned_before_as_it_was() -> None:
    """Learners keep observations and infos; the environment must not write into them again."""
    for choice in ({}, {"mask": "info", "ended": "stay"}, {"observation": "maps"}):
        first, second = (made("drawn", **choice) for _ in range(2))
        story = play(first, 0, seed=2)
        observations, infos = second.reset(seed=2)
        assert data_equivalence(story[0], (observations, infos), exact=True)


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
