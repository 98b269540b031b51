"""Observations have what is beyond the paper where the scenario has it, and only there."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

import dess
from dess import ScenarioSpace
from dess.observations.components import component_names
from dess.observations.extensions import extension_names
from dess.scenario import load_scenario
from dess.sections.wind import surcharges
from dess.state import HOVER, STEP_X, STEP_Y
from dess.view import View
from tests.dess.env.episodes import small
from tests.drawn import extended_spaces, seeds


def expected(view: View, space: ScenarioSpace, b: int, i: int) -> dict[str, float]:
    """What UAV ``i`` of mission ``b`` observes beyond the paper, read from the state."""
    mission, team, sensors = view.state.missions[b], view.state.uavs[b], view.state.sensors[b]
    failures = space.failures
    found: dict[str, Any] = {}
    if failures.uav_rate:
        mates = [mate["grounded"] for j, mate in enumerate(team) if j != i]
        found |= {f"mate_{j}_grounded": mate for j, mate in enumerate(mates, 1)}
        found["grounded"] = team[i]["grounded"]
    if failures.pad_rate:
        found["pads_out"] = 1 - working(view, b) / space.charging_pads
    if failures.node_rate:
        found |= {f"silent_{k}": silent for k, silent in enumerate(sensors["silent"])}
    if space.wind.is_on:
        wind = mission["wind_x"], mission["wind_y"], mission["wind_gusts"], mission["wind_seed"]
        table = surcharges(space.grid, *(value.item() for value in wind))
        for action, name in enumerate(("north", "east", "south", "west")):
            x, y = team[i]["x"] + STEP_X[action], team[i]["y"] + STEP_Y[action]
            inside = 0 <= x < space.grid and 0 <= y < space.grid
            extra = table[action, y, x] if inside else 0
            found[f"wind_{name}"] = space.flight_cost * extra / 100
    if space.age.is_on:
        ages = (mission["slot"] - sensors["newest"]) / space.max_slots
        found |= {f"age_{k}": age for k, age in enumerate(ages)}
    return {name: float(value) for name, value in found.items()}


def working(view: View, b: int) -> int:
    """The number of pads that work in mission ``b``."""
    rows = View(view.state, view.world, np.array([b]), np.array([0]))
    return int(rows.pads_working[0])


@given(extended_spaces(), seeds)
def test_observations_are_what_the_state_says_and_lie_in_their_space(
    space: ScenarioSpace, seed: int
) -> None:
    env = dess.vector_env(space, 2, seed=seed, observation="state", autoreset_mode="NextStep")
    names, generator = component_names(space), np.random.default_rng(seed % 2**32)
    observations, info = env.reset()
    assert names[len(names) - len(extension_names(space)) :] == extension_names(space)
    for _ in range(25):
        view, fleet = env.view(), space.uavs[1]
        assert env.observation_space.contains(observations)
        for row in np.flatnonzero(info["active"]):
            values = dict(zip(names, observations[row].tolist(), strict=True))
            beyond = {name: values[name] for name in extension_names(space)}
            assert beyond == pytest.approx(expected(view, space, *divmod(row, fleet)), abs=1e-6)
        draws = generator.random(env.action_masks().shape) * env.action_masks()
        observations, *_, info = env.step(draws.argmax(1))


def test_the_papers_observations_are_as_before() -> None:
    for name in ("paper", "fig4"):
        names = component_names(load_scenario(name))
        assert len(names) == 13 + 25 + 2 * 6 and names[-1] == "mate_2_charging"


@pytest.mark.parametrize(
    ("fields", "found"),
    [
        ({"failures.node_rate": 1.0}, {"silent_0": 1, "silent_1": 1}),
        ({"failures.pad_rate": 1.0, "pads": 2}, {"pads_out": 1}),
        ({"failures.uav_rate": 1.0, "failures.uav_repair": 9.0}, {"grounded": 1}),
        ({"age.measured": True}, {"age_0": 1 / 500, "age_1": 1 / 500}),
        # From the zone's northern row a move south is against the wind, one north leaves the grid.
        (
            {"wind.strength": 5.0, "wind.direction": 180.0, "zone": (2, 0, 1, 1)},
            {"wind_north": 0, "wind_east": 0, "wind_south": 0.05, "wind_west": 0},
        ),
    ],
)
def test_an_observation_after_one_slot_worked_out_by_hand(
    fields: dict[str, Any], found: dict[str, float]
) -> None:
    scenario = ScenarioSpace.of(small(**fields))
    env = dess.parallel_env(scenario, observation="state")
    env.reset()
    observations, *_ = env.step({"uav_0": HOVER})
    values = observations["uav_0"]["observation"]
    beyond = dict(zip(component_names(scenario), values.tolist(), strict=True))
    assert {name: beyond[name] for name in extension_names(scenario)} == pytest.approx(found)
    assert env.state_space.contains(env.state())
