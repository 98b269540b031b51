"""Consumption: what slots in the air take of the battery, in thousandths of a percent."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, policies, simulate
from dess.model.state import LANDED, constants_of
from dess.model.ways_home import FAR, reach_of, ways_home
from dess.physics.chart import parking_of
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.flights import batteries, flown
from tests.drawn import reached, spaces

COSTS = [500, 1300, 700, 2100, 1216]  # north, east, south, west, hover
SEA: dict[str, Any] = {
    **{"grid": 9, "zone": [4, 4, 1, 1], "nodes": [[0, 0]], "uavs": 1, "flying_time": 60},
    **{"consumption": {"slots": [COSTS, [900] * 4 + [1000]]}},
}
costs_of_speeds = st.lists(st.tuples(*[st.integers(1, 3000)] * 5), min_size=2, max_size=2)


def test_a_slot_takes_its_thousandths_and_the_battery_stays_whole():
    route = "NESW.NESW."
    _, log = flown(ScenarioSpace.of(**SEA, max_slots=len(route)), route)
    spent = np.cumsum([COSTS["NESW.".index(action)] for action in route])
    assert batteries(log) == (60 - spent // 1000).tolist()
    assert log["value"][log["event"] == "remainder"].tolist() == [spent[-1] % 1000]


def test_each_slot_of_a_slow_move_takes_the_cost_of_its_speed():
    fleet = [{"slots_per_cell": 2}]
    _, log = flown(ScenarioSpace.of(**SEA, fleet=fleet, max_slots=6), "N.N.N.")
    assert batteries(log) == [60, 59, 58, 57, 56, 55]  # 900 each: 0.9, 1.8, 2.7, 3.6, 4.5, 5.4


def test_a_charge_leaves_the_remainder_and_standing_takes_nothing():
    values = SEA | {"flying_time": 20, "landing": True, "quota": 0, "max_slots": 8}
    _, log = flown(ScenarioSpace.of(**values, charge_rate=10), "NS......")
    # 0.5 and 0.7 % for the moves; then six slots on the pad.
    assert batteries(log) == [20, 19, 29, 39, 49, 59, 69, 79]
    assert log["value"][log["event"] == "remainder"].tolist() == [200]


@given(spaces(), costs_of_speeds)
def test_the_way_home_costs_as_much_as_the_best_neighbour_and_the_move_there(space, costs):
    """The table satisfies the equation of the cheapest way, to every parking cell."""
    values = {"fleet": [{"slots_per_cell": 2}], "consumption": {"slots": costs}}
    space = ScenarioSpace.of(space, **values)
    reach = reach_of(constants_of(space), space.chart)
    assert reach is not None
    nearest = ways_home(constants_of(space), space.chart)
    water = reached(space.zone[:2], *space.size, {*space.no_fly})
    homes = enumerate(parking_of(space.rectangles))
    for (number, home), s, (x, y) in product(homes, (1, 2), water):
        steps = [(0, x, y - 1), (1, x + 1, y), (2, x, y + 1), (3, x - 1, y)]
        ways = [
            s * costs[s - 1][action] + reach[number, s - 1, b, a]
            for action, a, b in steps
            if (a, b) in water
        ]
        wanted = 0 if (x, y) == home else min(ways, default=FAR)
        assert reach[number, s - 1, y, x] == wanted
        assert nearest[s - 1, y, x] <= wanted


def test_home_counts_the_thousandths_of_the_way_and_what_has_been_spent():
    """Two cells north of the zone, the way back takes 1.4 %."""
    values = SEA | {"max_slots": 2}
    for battery, is_home in ((2, 0), (3, 1)):  # 1.0 and 2.0 % are left
        record, _ = flown(ScenarioSpace.of(**(values | {"flying_time": battery})), "NN")
        assert (record.home, record.uavs["way_home"].tolist()) == (is_home, [2])


def test_policies_come_home_in_a_strong_wind():
    """Northwards flights cost twice as much as others, and hovering more than flying."""
    costs = [[2100, 1300, 700, 1300, 1216]]
    values = {"landing": True, "quota": 0, "max_slots": 300, "consumption": {"slots": costs}}
    space = ScenarioSpace.of("paper", **values)
    for name in ("random", "nearest", "greedy", "tour", "age", "planner-short"):
        record = simulate(space, policies.load(name), seed=1)
        assert (record.uavs["end"] == LANDED).all(), name


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"consumption": {"slots": [[1, 2, 3, 4]]}}, "consumption.slots.0"),
        ({"consumption": {"slots": [[0, 2, 3, 4, 5]]}}, "consumption.slots.0.0: 0 is out of range"),
        ({"wind": {"strength": 1.0}}, "wind: is given beside consumption; allowed: one of both"),
        ({"fleet": [{"slots_per_cell": 3}]}, "consumption.slots: there are costs for 2 speeds"),
        ({"consumption.slots": [[11001] * 5]}, "a slot takes 11.0 %; allowed: 11 % at most"),
    ],
)
def test_what_does_not_fit_is_refused(values, message):
    with pytest.raises(InputError) as raised:
        ScenarioSpace.of(ScenarioSpace.of(**SEA), **values)
    assert message in str(raised.value) and "\n" not in str(raised.value)
