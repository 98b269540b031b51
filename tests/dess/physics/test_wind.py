"""Wind: what moves against it cost, the same field in all missions, and a guard that counts it."""

from itertools import product

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from dess import simulate
from dess.model.guard import guard
from dess.model.state import BATTERY, constants_of
from dess.model.view import View
from dess.model.ways_home import reach_of
from dess.physics.chart import parking_of
from dess.physics.wind import Wind, surcharges
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.flights import batteries, flown
from tests.drawn import random_actions, reached, replications, seeds, spaces

OPEN = {"grid": 9, "zone": [4, 4, 1, 1], "nodes": [[0, 0]], "uavs": 1, "flying_time": 60}
winds = st.builds(
    Wind,
    strength=st.floats(0, 6),
    direction=st.floats(0, 360),
    gusts=st.floats(0, 2),
    seed=st.integers(0, 2**32 - 1),
)


def _table(wind: Wind, grid: int, rows: int | None = None) -> np.ndarray:
    return surcharges((grid, rows or grid), *wind.pushes(), wind.gusts, wind.seed)


def test_a_move_against_the_wind_costs_its_strength_more_and_no_other_does():
    for direction, against in ((0, "N"), (90, "E"), (180, "S"), (270, "W"), (360, "N")):
        wind = {"wind.strength": 3, "wind.direction": direction}
        space = ScenarioSpace.of(**(OPEN | {"max_slots": 5} | wind))
        for route in ("NESW.", "S.WEN"):
            costs = [4 if action == against else 1 for action in route]
            _, log = flown(space, route)
            assert batteries(log) == (60 - np.cumsum(costs)).tolist()


def test_a_slanting_wind_costs_its_component_on_average():
    # From the north-east with 2 %: sqrt(2) % for a move to the north or to the east. Each cell
    # rounds it up or down, so the mean of 64 x 64 cells has a deviation below 0.01.
    north, east, south, west = _table(Wind(strength=2, direction=45), 64)
    for against in (north, east):
        assert set(np.unique(against)) == {1, 2}
        assert against.mean() == pytest.approx(np.sqrt(2), abs=0.04)
    assert not south.any() and not west.any()


def test_gusts_are_normal_and_a_tail_wind_saves_nothing():
    # The mean of max(0, g) is the deviation / sqrt(2 pi).
    table = _table(Wind(gusts=3), 128)
    assert table.min() == 0
    assert table.mean(axis=(1, 2)) == pytest.approx(3 / np.sqrt(2 * np.pi), abs=0.1)
    # A gust that is against a move to the north is with a move to the south.
    north, east, south, west = table
    assert ((north == 0) | (south == 0)).all() and ((east == 0) | (west == 0)).all()


@given(spaces(), winds)
def test_the_way_home_costs_as_much_as_the_best_neighbour_and_the_move_there(space, wind):
    """The table satisfies the equation of the shortest way, to every parking cell."""
    fleet = [{"slots_per_cell": 2}]
    space = ScenarioSpace.of(space, wind=wind.model_dump(), fleet=fleet)
    reach, extra = reach_of(constants_of(space), space.chart), _table(wind, *space.size)
    water = reached(space.zone[:2], *space.size, {*space.no_fly})
    homes = enumerate(parking_of(space.rectangles))
    for (number, home), s, (x, y) in product(homes, (1, 2), water):
        steps = [(0, x, y - 1), (1, x + 1, y), (2, x, y + 1), (3, x - 1, y)]
        ways = [
            s + extra[action, b, a] + reach[number, s - 1, b, a]
            for action, a, b in steps
            if 0 <= a < space.size[0] and 0 <= b < space.size[1] and (a, b) not in space.no_fly
        ]
        assert reach[number, s - 1, y, x] == (0 if (x, y) == home else min(ways))


class Guarded:
    """Any action that the guard allows, at random; on the way it checks the mask."""

    name = "guarded"

    def act(self, view: View) -> np.ndarray:
        mask = guard(view)
        assert mask.shape == (len(view), 5) and mask.any(1).all()
        assert not (mask & ~view.legal).any()
        return random_actions(view, mask)


# Without wind, with it, and with moves of several slots.
WEATHER = st.just({}) | st.builds(
    lambda wind, slots: {"wind": wind.model_dump(), "fleet": [{"slots_per_cell": slots}]},
    *(winds, st.integers(1, 3)),
)
# Slots that cost less and more than one percent, by the direction.
WEATHER |= st.builds(
    lambda costs, slots: {"consumption": {"slots": costs}, "fleet": [{"slots_per_cell": slots}]},
    st.lists(st.tuples(*[st.integers(300, 2500)] * 5), min_size=3, max_size=3),
    st.integers(1, 3),
)


@given(spaces(uavs=1, initial_data=1e6), WEATHER, seeds, replications)
def test_the_battery_of_a_guarded_lone_uav_is_never_depleted(space, weather, seed, replication):
    record = simulate(ScenarioSpace.of(space, **weather), Guarded(), seed, replication)
    assert (record.uavs["end"] != BATTERY).all()
    event(f"charged {record.uavs['slots_charging'][0] > 0}")
