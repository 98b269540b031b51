"""Observations lie in their space and have the values worked out by hand; masks follow the grid."""

import numpy as np
import pytest
from hypothesis import given

import dess
from dess import ScenarioSpace
from dess.observations.components import component_names
from dess.state import HOVER, STEP_X, STEP_Y
from tests.dess.env.episodes import play, small
from tests.drawn import seeds, spaces


@given(spaces(), seeds)
def test_observations_lie_in_their_space_and_masks_name_the_moves_on_the_grid(
    space: ScenarioSpace, seed: int
) -> None:
    env = dess.parallel_env(space, seed, observation="state")
    names = component_names(space)
    edge = space.grid - 1
    for step in play(env, 0):
        for agent, observation in step[0].items():
            assert env.observation_space(agent).contains(observation)
            values = dict(zip(names, observation["observation"].tolist(), strict=True))
            x, y = round(values["x"] * edge), round(values["y"] * edge)
            inside = (np.clip(x + STEP_X, 0, edge) == x + STEP_X) & (
                np.clip(y + STEP_Y, 0, edge) == y + STEP_Y
            )
            held = values["charging"] or not values["active"]
            expected = np.arange(5) == HOVER if held else inside
            assert observation["action_mask"].tolist() == expected.tolist()


def test_an_observation_worked_out_by_hand() -> None:
    # A zone of two cells, (3, 0) and (4, 0): the UAVs start there, 30 % is above C_S, below C_C.
    scenario = small(zone=(3, 0, 2, 1), uavs=2, flying_time=30, initial_data=[0, 8], quota=400)
    env = dess.parallel_env(scenario, observation="state")
    observations, _ = env.reset()
    names = component_names(scenario)
    left = min(env.agents, key=lambda a: observations[a]["observation"][names.index("x")])
    # West, out of the zone; the other one hovers: one slot, one percent, four communications.
    observations, *_ = env.step({agent: 3 if agent == left else HOVER for agent in env.agents})
    values = dict(zip(names, observations[left]["observation"].tolist(), strict=True))
    residual = [values.pop("residual_0"), values.pop("residual_1")]
    assert np.array(residual).sum() * 8 == pytest.approx(env.record().residual, rel=1e-6)
    assert values == pytest.approx(
        {
            "active": 1,
            "x": 2 / 4,
            "y": 0,
            "battery": 0.29,
            "quota": 4 / 400,
            "latch": 0,
            "charging": 0,
            "waiting": 0,
            "zone_dx": 1 / 4,
            "zone_dy": 0,
            "charge_start": 0.2,
            "charge_complete": 0.6,
            "slot": 1 / 500,
            "mate_1_active": 1,
            "mate_1_dx": 2 / 4,
            "mate_1_dy": 0,
            "mate_1_battery": 0.29,
            "mate_1_quota": 4 / 400,
            "mate_1_charging": 0,
        }
    )
