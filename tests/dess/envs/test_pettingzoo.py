"""PettingZoo's own tests, for every choice of ``parallel_env``."""

import warnings
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot
from pettingzoo import test as their
from pettingzoo.utils import parallel_to_aec

import dess
from dess.envs.observations.observer import KINDS
from dess.envs.parallel import HarvestEnv
from tests.dess.envs.episodes import PAPER, play, small

# Missions short enough to be played often, in which some UAVs end before others.
QUICK: dict[str, Any] = {"flying_time": [8, 40], "charge_start": 10, "max_slots": 60}
FLEETS = (3, [1, 3])
OPTIONS: dict[str, tuple] = {
    **{"observation": KINDS, "mask": ("observation", "info"), "ended": ("leave", "stay")},
    **{"guarded": (False, True), "uavs": FLEETS},
}
# Combinations that are tested with each observation; all others are by ``nox -s verify``.
QUICKLY = (("observation", "leave", False, FLEETS[1]), ("info", "stay", True, FLEETS[0]))
CHOICES = [
    pytest.param(
        dict(zip(OPTIONS, values, strict=True)),
        marks=[] if values[1:] in QUICKLY else pytest.mark.slow,
    )
    for values in product(*OPTIONS.values())
]
every_choice = pytest.mark.parametrize("choice", CHOICES, ids=str)


def made(uavs: Any, **choice: Any) -> HarvestEnv:
    return dess.parallel_env(dess.load_scenario("paper", uavs=uavs, **QUICK), **choice)


@pytest.mark.filterwarnings("ignore:Observation:UserWarning")  # a dictionary; zeros after the end
@pytest.mark.filterwarnings("ignore:Agent's m..imum observation:UserWarning")  # no bounds
@every_choice
def test_pettingzoos_tests_pass(choice):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # The fleet of an episode can be smaller than the largest one.
        warnings.filterwarnings("ignore", "No agents present but not all possible_agents")
        warnings.filterwarnings("ignore", "Environment's maximum state")  # data is not bounded
        their.parallel_api_test(made(**choice), num_cycles=100)
        their.parallel_seed_test(lambda: made(**choice), num_cycles=20)
        their.seed_test(lambda: parallel_to_aec(made(**choice)), num_cycles=20)
        their.state_test(parallel_to_aec(made(**choice)), made(**choice))
    their.api_test(parallel_to_aec(made(**choice)), num_cycles=100)


@pytest.mark.parametrize(("uavs", "ended"), [(3, "leave"), (3, "stay"), ([1, 3], "stay")])
def test_pettingzoos_max_cycles_test_passes(uavs, ended):
    """``max_cycles`` is ``max_slots`` of the scenario; no UAV ends before in this mission."""

    def mission(max_cycles: int) -> HarvestEnv:
        scenario = dess.load_scenario("paper", uavs=uavs, max_slots=max_cycles)
        return dess.parallel_env(scenario, ended=ended)

    turns = SimpleNamespace(
        parallel_env=mission, env=lambda max_cycles: parallel_to_aec(mission(max_cycles))
    )
    their.max_cycles_test(turns)


@every_choice
def test_infos_are_numbers_and_arrays_with_the_same_keys_in_every_step(choice):
    kinds = {"active": bool, "reward_terms": np.ndarray, "collected": float}
    kinds |= {"team_collected": float, "end": int, "overruled": bool}
    in_info = {"action_mask": np.ndarray} if choice["mask"] == "info" else {}
    for observations, *_, infos in play(made(**choice), 0, seed=2):
        for agent, info in infos.items():
            assert {key: type(value) for key, value in info.items()} == kinds | in_info
            own = observations[agent]  # a mask stands in one place
            in_observation = isinstance(own, dict) and "action_mask" in own
            assert in_observation == (choice["mask"] == "observation")


# --- pictures ---


def test_a_picture_shows_the_mission():
    assert dess.parallel_env(PAPER).render() is None
    env = dess.parallel_env(small(), render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    assert before is not None and before.dtype == np.uint8 and before.shape == (80, 80, 3)
    env.step({"uav_0": 3})
    changed = np.nonzero((env.render() != before).any(2))
    cells = {(int(x // 16), int(y // 16)) for y, x in zip(*changed, strict=True)}
    # The node that was served, and two neighbours: the UAV left one for the other.
    (west_x, west_y), (east_x, east_y) = sorted(cells - {(0, 0), (4, 4)})
    assert (east_x - west_x, east_y - west_y) == (1, 0)


def test_a_window_opens_and_is_closed_once():
    pyplot.switch_backend("agg")  # no window is opened on the screen of who runs the tests
    their.render_test(lambda render_mode: parallel_to_aec(dess.parallel_env(PAPER, 0, render_mode)))
    pyplot.close("all")  # the test leaves a window open
    env = dess.parallel_env(small(), render_mode="human")
    assert len(pyplot.get_fignums()) == 1
    env.close()
    env.close()
    assert pyplot.get_fignums() == []
