"""Named components lie in their space and have the values worked out by hand."""

import numpy as np
import pytest
from hypothesis import given

import dess
from dess import ScenarioSpace
from dess.envs.observations.components import component_names
from dess.model.state import HOVER, STEP_X, STEP_Y
from dess.physics.chart import NO_FLY
from tests.dess.envs.episodes import play, small
from tests.drawn import extended_spaces, seeds, spaces


@given(spaces(max_slots=40) | extended_spaces(fleet=[], max_slots=40), seeds)
def test_observations_lie_in_their_space_and_masks_name_the_moves_on_the_grid(space, seed):
    env = dess.parallel_env(space, seed, observation="state")
    names, zones = component_names(space), np.pad(space.chart.zones, 1, constant_values=NO_FLY)
    for step in play(env, 0):
        assert env.state_space.shape == env.state().shape
        for agent, observation in step[0].items():
            assert env.observation_space(agent).contains(observation)
            values = dict(zip(names, observation["observation"].tolist(), strict=True))
            x, y = (round(values[n] * (m - 1)) for n, m in zip("xy", space.size, strict=True))
            inside = zones[y + 1 + STEP_Y, x + 1 + STEP_X] != NO_FLY
            held = values["charging"] or not values["active"] or values.get("grounded")
            expected = np.arange(5) == HOVER if held else inside
            assert observation["action_mask"].tolist() == expected.tolist()


def test_an_observation_worked_out_by_hand():
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
    assert sum(residual) * 8 == pytest.approx(env.record().residual, rel=1e-6)
    zeros = ("y", "latch", "charging", "waiting", "zone_dy", "mate_1_dy", "mate_1_charging")
    expected = dict.fromkeys(zeros, 0) | {"active": 1, "x": 2 / 4, "battery": 0.29}
    expected |= {"quota": 4 / 400, "zone_dx": 1 / 4, "slot": 1 / 500}
    expected |= {"charge_start": 0.2, "charge_complete": 0.6, "mate_1_active": 1}
    expected |= {"mate_1_dx": 2 / 4, "mate_1_battery": 0.29, "mate_1_quota": 4 / 400}
    assert values == pytest.approx(expected)


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
def test_what_is_beyond_the_paper_by_hand(fields, found):
    scenario = ScenarioSpace.of(small(**fields))
    env = dess.parallel_env(scenario, observation="state")
    env.reset()
    observations, *_ = env.step({"uav_0": HOVER})
    names, values = component_names(scenario), observations["uav_0"]["observation"].tolist()
    beyond = dict(zip(names, values, strict=True))
    assert names[len(component_names(small())) :] == [*found]
    assert {name: beyond[name] for name in found} == pytest.approx(found)
