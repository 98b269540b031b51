"""Energy: what slots in the air take of the battery, in thousandths of a percent."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from dess import InputError, load_scenario, policies, simulate
from dess.model import batch
from dess.model.guard import guard
from dess.model.state import BATTERY, LANDED, constants_of
from dess.model.view import View
from dess.model.ways import FAR, Ways, move_costs
from dess.physics.chart import NO_FLY, neighbours_of, parking_of, read_only, spread_costs
from dess.physics.energy import Wind
from dess.scenario.scenario import ScenarioSpace
from tests import compiled
from tests.dess.model.flights import batteries, flown
from tests.drawn import random_actions, reached, replications, seeds, spaces

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


winds = st.builds(
    Wind,
    strength=st.floats(0, 6),
    direction=st.floats(0, 360),
    gusts=st.floats(0, 2),
    seed=st.integers(0, 2**32 - 1),
)
WINDS = winds.map(lambda wind: {"wind": wind.model_dump()})
COSTS_OF_SLOTS = costs_of_speeds.map(lambda costs: {"consumption": {"slots": costs}})


@given(spaces(), WINDS | COSTS_OF_SLOTS)
def test_the_way_home_costs_as_much_as_the_best_neighbour_and_the_move_there(space, energy):
    """The table satisfies the equation of the cheapest way, to every parking cell."""
    space = ScenarioSpace.of(space, fleet=[{"slots_per_cell": 2}], **energy)
    constants = constants_of(space)
    ways = Ways(constants, space.chart)
    reach = ways.reach
    assert reach is not None
    moves = [move_costs(constants[0], s, space.chart.zones.shape) for s in (1, 2)]
    water = reached(space.zone[:2], *space.size, {*space.no_fly})
    homes = enumerate(parking_of(space.rectangles))
    for (number, home), s, (x, y) in product(homes, (1, 2), water):
        steps = [(0, x, y - 1), (1, x + 1, y), (2, x, y + 1), (3, x - 1, y)]
        neighbours = [
            moves[s - 1][action, b, a] + reach[0, number, s - 1, b, a]
            for action, a, b in steps
            if (a, b) in water
        ]
        wanted = 0 if (x, y) == home else min(neighbours, default=FAR)
        assert reach[0, number, s - 1, y, x] == wanted
        assert ways.home[0, s - 1, y, x] <= wanted


@given(spaces(), WINDS | COSTS_OF_SLOTS, seeds)
def test_a_way_around_closed_cells_costs_as_much_as_around_no_fly_cells(space, energy, seed):
    space = ScenarioSpace.of(space, **energy)
    mission, zones, draws = constants_of(space)[0], space.chart.zones, np.random.default_rng(seed)
    moves = move_costs(mission, 1, zones.shape).reshape(4, -1)
    end = parking_of(space.rectangles)[0]
    least = _costs_to(zones, moves, end)
    water = reached(end, *space.size, {*space.no_fly})
    for limit in (2_000, 10_000, 10**6):
        closed = [cell for cell in water if cell != end and draws.random() < 0.3]
        numbers = np.array([zones.shape[1] * y + x for x, y in closed], np.int64)
        fewer = zones.copy()
        fewer.reshape(-1)[numbers] = NO_FLY
        wanted = np.minimum(_costs_to(fewer, moves, end), limit)
        for start in {*water} - {*closed}:
            found = compiled.cost_around(mission, zones, least, numbers, start, end, limit)
            assert found == wanted[start[::-1]]


def _costs_to(zones, moves, end):
    """(H, W) what the cheapest ways to a cell cost."""
    costs, nearest = np.full(zones.size, FAR, np.int32), np.zeros(zones.size, np.int32)
    source = np.array([zones.shape[1] * end[1] + end[0]])
    spread_costs(neighbours_of(read_only(zones)), source, moves, False, FAR, costs, nearest)
    return costs.reshape(zones.shape)


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


# --- wind ---

OPEN = {"grid": 9, "zone": [4, 4, 1, 1], "nodes": [[0, 0]], "uavs": 1, "flying_time": 60}


def _moves(wind: Wind, grid: int) -> np.ndarray:
    """(4, H, W) what the moves of UAVs take that fly a cell in a slot."""
    space = ScenarioSpace.of("paper", grid=grid, wind=wind.model_dump())
    return move_costs(constants_of(space)[0], 1, (grid, grid))


def test_a_move_against_the_wind_costs_its_strength_more_and_no_other_does():
    for direction, against in ((0, "N"), (90, "E"), (180, "S"), (270, "W"), (360, "N")):
        wind = {"wind.strength": 3, "wind.direction": direction}
        space = ScenarioSpace.of(**(OPEN | {"max_slots": 5} | wind))
        for route in ("NESW.", "S.WEN"):
            costs = [4 if action == against else 1 for action in route]
            _, log = flown(space, route)
            assert batteries(log) == (60 - np.cumsum(costs)).tolist()
            assert log["value"][log["event"] == "remainder"].tolist() == [0]


def test_a_slow_uav_pays_for_the_wind_in_each_slot_of_its_move():
    wind = {"wind.strength": 3, "fleet": [{"slots_per_cell": 2}]}
    _, log = flown(ScenarioSpace.of(**(OPEN | {"max_slots": 4} | wind)), "N.S.")
    assert batteries(log) == [58, 55, 54, 53]  # 2.5 and 5, then 1 each


def test_a_slanting_wind_costs_its_component_rounded_up():
    # From the north-east with 2 %: sqrt(2) % for a move to the north or to the east.
    north, east, south, west = _moves(Wind(strength=2, direction=45), 64)
    assert (north == 2415).all() and (east == 2415).all()
    assert (south == 1000).all() and (west == 1000).all()


def test_gusts_are_normal_and_a_tail_wind_saves_nothing():
    # The mean of max(0, g) is the deviation / sqrt(2 pi).
    moves = _moves(Wind(gusts=3), 128)
    assert moves.min() == 1000
    assert moves.mean(axis=(1, 2)) == pytest.approx(1000 + 3000 / np.sqrt(2 * np.pi), abs=100)
    # A gust that is against a move to the north is with a move to the south.
    north, east, south, west = moves
    assert ((north == 1000) | (south == 1000)).all() and ((east == 1000) | (west == 1000)).all()


def test_missions_of_many_winds_share_a_batch_and_are_the_same_alone():
    winds = [
        {"strength": 0.3 * number, "direction": 50.0 * number, "gusts": 0.2, "seed": number}
        for number in range(1, 5)
    ]
    spaces = [load_scenario("paper", uavs=2, wind=wind) for wind in winds] * 2
    assert len(batch._by_world(spaces)) == 1
    policy = policies.load("greedy")
    together = batch.simulate_batch(spaces, policy, 3, range(8), batch_size=3)
    for replication, space in enumerate(spaces):
        alone = batch.simulate_batch(space, policy, 3, [replication])
        for one, other in zip(alone, together, strict=True):
            assert one.tobytes() == other[replication : replication + 1].tobytes()


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
