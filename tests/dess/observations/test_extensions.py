"""Observations have what is beyond the paper where the scenario has it, and only there."""

from typing import Any

import pytest

import dess
from dess import ScenarioSpace
from dess.observations.components import component_names
from dess.observations.extensions import extension_names
from dess.state import HOVER
from tests.dess.env.episodes import small


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
