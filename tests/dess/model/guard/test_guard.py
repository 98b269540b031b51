"""The return guard: UAVs that follow it reach the charger in time."""

import heapq
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dess import policies
from dess.envs.observations.states import HOME, compact_states
from dess.model.batch import simulate_batch
from dess.model.guard import guard
from dess.model.state import BATTERY, HOVER, STEP_X, STEP_Y
from dess.model.view import View
from dess.model.ways import move_costs
from dess.scenario.scenario import load_scenario
from tests import compiled
from tests.dess.envs.episodes import placed
from tests.drawn import EAST, NORTH, SOUTH, WEST


def _mask(*uavs: dict[str, Any], **scenario: Any) -> np.ndarray:
    """The guard's masks for UAVs in given states, 400 communications short of the quota."""
    rows = np.zeros(len(uavs), int), np.arange(len(uavs))
    state, chart = placed([*uavs], **scenario)
    world = SimpleNamespace(chart=chart)
    return guard(View(state, world, *rows))


SHEET = {
    **{"endurance": "26 min", "charging": "53 min", "cruise": "13.5 m/s", "max_speed": "24 m/s"},
    **{"data_rate": "2 MB/h", "bandwidth": "125 kHz", "snr": "22 dB at 1 km"},
    **{"wind": "4 m/s from 180 deg", "horizon": "2 h"},
}
WALL = [[24, y] for y in range(12)]  # from the northern edge, between the UAV and the zone
FAR: dict[str, Any] = {"x": 20, "y": 10}
WAITING = {"x": 27, "y": 4, "battery": 20, "latch": True, "pad_request": 3}


@pytest.mark.parametrize(
    ("uavs", "no_fly", "moves"),
    [
        # The corner of the zone (26, 5) is 6 + 5 = 11 steps away, then one slot to charge in.
        ([FAR | {"battery": 12}], [], [NORTH, EAST]),
        ([FAR | {"battery": 60}], [], [NORTH, EAST, SOUTH, WEST, HOVER]),
        # The edge of the grid and parked teammates are closed.
        ([{"x": 0, "y": 0}], [], [EAST, SOUTH, HOVER]),
        (
            [{"x": 25, "y": 3}, {"x": 26, "y": 3, "latch": True, "battery": 20}],
            *([], [NORTH, SOUTH, WEST, HOVER]),
        ),
        # Behind an island the way around it counts: 8 cells south, 6 east and 7 north.
        ([{"x": 20, "y": 4, "battery": 22}], WALL, [EAST, SOUTH]),
        ([{"x": 23, "y": 4, "battery": 60}], WALL, [NORTH, SOUTH, WEST, HOVER]),
        ([{"x": 20, "y": 4, "battery": 22}], [], [NORTH, EAST, SOUTH, WEST, HOVER]),
        # A UAV that waits in the queue keeps its place.
        ([WAITING], [], [HOVER]),
    ],
)
def test_the_moves_that_are_left_to_a_uav(uavs, no_fly, moves):
    assert np.nonzero(_mask(*uavs, no_fly=no_fly)[0])[0].tolist() == moves


def test_a_late_uav_does_not_fly_along_a_zone():
    # North and east lead to its parking cell (13, 3) alike. East of it, it might be told (12, 3)
    # once the teammate has left, and west of that (13, 3) again.
    parked = {"x": 12, "y": 3, "latch": True, "battery": 20}
    mask = _mask(
        {"x": 12, "y": 8, "battery": 3}, parked,
        grid=22, zone=[12, 1, 2, 3], pads=2, nodes=[[3, 14]], data_sheet=SHEET,
    )  # fmt: skip
    assert np.nonzero(mask[0])[0].tolist() == [NORTH]


def test_the_guard_closes_in_little_by_little_and_never_before_it_must():
    opened = [_mask(FAR | {"battery": b})[0].sum() for b in range(12, 30)]
    assert opened == sorted(opened)
    assert opened[3:] == [5] * len(opened[3:])


def test_who_has_been_overruled_leaves_contested_cells_to_the_right_of_way():
    # Both want the cell between them; the one with less battery goes first.
    first, second = {"x": 10, "y": 10, "battery": 50}, {"x": 10, "y": 12, "battery": 60}
    open_to_both = _mask(first, second)
    assert open_to_both[0, SOUTH] and open_to_both[1, NORTH]
    collided = _mask(first | {"overruled": True}, second | {"overruled": True})
    assert collided[0, SOUTH] and not collided[1, NORTH]
    assert collided[1, [EAST, SOUTH, WEST, HOVER]].all()


# --- teammates that block each other ---

# A UAV, and one north of it that must charge and has just been overruled by it.
IN_THE_WAY: dict[str, Any] = {"x": 10, "y": 10, "battery": 70}
BLOCKED = {"x": 10, "y": 9, "battery": 20, "overruled": True, "overruled_by": 0}
EASTERN: dict[str, Any] = {"x": 11, "y": 10, "battery": 80}
OVERRULED = {"overruled": True, "overruled_by": 2}
# Two UAVs that come home with equal batteries; the first has the right of way.
NORTHERN, SOUTHERN = ({"x": 20 + k, "y": 10 + k, "battery": 29, "latch": True} for k in (0, 1))
# A UAV that hovers in a zone with one pad, and one that the way to its goal leads past.
CHARGED: dict[str, Any] = {"x": 27, "y": 3, "battery": 50, "executed": HOVER}
PASSING = {"x": 27, "y": 5, "battery": 60, "overruled": True, "overruled_by": 0}


@pytest.mark.parametrize(
    ("i", "uavs", "moves"),
    [
        # Who has been overruled does not insist on a cell where a teammate stays.
        (0, [IN_THE_WAY | OVERRULED, {"x": 11, "y": 10, "battery": 80}], [0, 2, 3, 4]),
        # Who is in the way leaves its cell, and not to one where a teammate stays.
        (0, [IN_THE_WAY, BLOCKED, EASTERN], [SOUTH, WEST]),
        (0, [IN_THE_WAY | OVERRULED, BLOCKED, EASTERN], [SOUTH, WEST]),
        # Who keeps it from leaving leaves its cell, too.
        (2, [IN_THE_WAY | OVERRULED, BLOCKED, EASTERN], [EAST, SOUTH]),
        # A UAV with time left does not cross the way of one that comes to charge.
        (1, [NORTHERN, SOUTHERN], [EAST, SOUTH, HOVER]),
        (1, [NORTHERN | {"latch": False, "battery": 31}, SOUTHERN | {"battery": 32}], [*range(5)]),
    ],
)
def test_a_uav_makes_room_for_one_that_must_charge(i, uavs, moves):
    assert np.nonzero(_mask(*uavs)[i])[0].tolist() == moves


def test_a_uav_whose_move_was_overruled_does_not_wait_in_its_zone():
    """It will try again, so the cells beside it are not left to its teammate."""
    for overruled in (False, True):
        mask = _mask(CHARGED | {"overruled": overruled}, PASSING, pads=1)
        assert mask[1, NORTH] == (not overruled)


# --- islands and zones ---

ROW = [[x, 5] for x in range(17, 24)]  # 4 cells around either end
NEAR = {"zones": [{"cells": [20, 8, 1, 1]}]}
PADS_FAIL = {"failures": {"pad_rate": 0.1}}
HERE, THERE = {"x": 20, "y": 4}, {"x": 20, "y": 8, "latch": True}
# A zone of 3 x 3 cells in the corner of the grid, with a coast to the north of it.
COAST: dict[str, Any] = {"grid": 8, "zone": [0, 2, 3, 3], "nodes": [[7, 7]]}
COAST |= {"no_fly": [[0, 1], [1, 1], [2, 1]], "charge_complete": 80}
PARKED = {"x": 2, "y": 2, "latch": True}
# A zone at the end of a corridor, in the first row.
CORRIDOR = COAST | {"zone": [0, 0, 4, 1], "no_fly": [[x, 1] for x in range(6)]}
MOUTH = {"x": 3, "y": 0, "latch": True}
# Two zones of which the second has one cell, and its only pad is that of the first UAV.
LAST_PAD: dict[str, Any] = {"grid": 6, "rows": 5, "zone": [3, 2, 2, 2], "pads": 1}
LAST_PAD |= {"zones": [{"cells": [3, 4, 1, 1]}], "nodes": [[0, 0]], "charge_complete": 80}
POOR = [{"x": x, "y": y, "battery": b} for x, y, b in ((3, 1, 11), (1, 4, 7), (1, 1, 8))]


@pytest.mark.parametrize(
    ("uavs", "scenario", "home"),
    [
        ([HERE], {}, (26, 4, 6)),
        ([HERE], NEAR, (20, 8, 4)),
        ([HERE], NEAR | {"no_fly": ROW}, (26, 4, 6)),  # around it, it is 4 + 4 + 4 cells away
        ([HERE, THERE], NEAR, (26, 4, 6)),  # it is full
        ([HERE | {"battery": 70}, {"x": 20, "y": 10}], NEAR, (26, 4, 6)),  # less battery first
        ([HERE], NEAR | PADS_FAIL, (26, 4, 6)),  # its pad is out of order for good
        # It will be repaired, but a pad works two cells farther.
        ([HERE], NEAR | {"failures": {"pad_rate": 0.1, "pad_repair": 9.0}}, (26, 4, 6)),
        # Parked teammates are islands: from (3, 1) the only way of 3 cells to (1, 2) is over one.
        ([{"x": 3, "y": 1}, PARKED], COAST, (2, 3, 3)),
        # No way leads around a teammate, which is charged after 5 slots at most.
        ([{"x": 7, "y": 0}, MOUTH], CORRIDOR, (2, 0, 5 + 5)),
        # Who is parked keeps its cell, although teammates with less battery choose before it.
        ([{"x": 3, "y": 4, "battery": 9, "latch": True}, *POOR], LAST_PAD, (3, 4, 0)),
    ],
)
def test_a_uav_charges_at_the_cell_where_it_can_soonest(uavs, scenario, home):
    state, chart = placed(uavs, **scenario)
    state.missions["pads_out"][0, 16] = 1  # the first pad of the second zone
    assert compiled.parking_cell(state.missions[0], state.uavs[0], 0, chart)[:3] == home


@pytest.mark.parametrize(("battery", "home"), [(60, (26, 4, 6)), (5, (20, 8, 4))])
def test_where_missions_end_on_the_ground_a_uav_counts_on_no_cell_of_a_teammate(battery, home):
    """Unless it reaches no other: the teammate is charged, and may leave its cell or not."""
    uavs = [HERE | {"battery": battery}, THERE | {"battery": 90, "latch": False}]
    state, chart = placed(uavs, **NEAR, landing=True)
    assert compiled.parking_cell(state.missions[0], state.uavs[0], 0, chart)[:3] == home


def test_the_battery_to_a_zone_farther_than_the_nearest_is_that_of_the_way_there():
    for uavs, needed in (([HERE, {}], 8), ([HERE, THERE], 12)):  # two slots per cell
        states = compact_states(*placed(uavs, **NEAR, fleet=[{"slots_per_cell": 2}]), True)
        assert states.uavs[0, 0, HOME] == needed


@pytest.mark.parametrize("sea", ["archipelago:1", "corridor:7"])
def test_hardly_any_guarded_uav_runs_dry_among_islands_and_no_lone_one_does(sea):
    space = load_scenario(sea, uavs=[1, 4], initial_data=1e6, max_slots=300)
    records = simulate_batch(space, policies.load("random"), 3, 400)
    dry = (records.uavs["end"] == BATTERY).sum(1)
    assert dry.sum() <= 0.01 * records.missions["uavs"].sum()
    assert not dry[records.missions["uavs"] == 1].any()


@pytest.mark.parametrize(
    ("slots_left", "quota", "moves"),
    [(17, 0, [*range(5)]), (16, 0, [HOVER]), (16, 440, [*range(5)])],
)
def test_shortly_before_the_end_a_charged_uav_does_not_leave_a_zone(slots_left, quota, moves):
    """It could fly a slot and be back in time, but teammates count on it to stay.

    With a quota, it goes on until that is filled.
    """
    charged = {"x": 27, "y": 4, "battery": 90}
    state, chart = placed([charged], landing=True, quota=quota)
    state.missions["slot"] = state.missions["max_slots"] - slots_left
    view = View(state, SimpleNamespace(chart=chart), np.zeros(1, int), np.zeros(1, int))
    assert np.nonzero(guard(view)[0])[0].tolist() == moves


# --- pads ---

QUEUE: dict[str, Any] = {"charge_start": 30, "charge_complete": 80, "pads": 1}


def test_two_parked_teammates_side_by_side_are_flown_around():
    """Without no-fly cells, too, they close all shortest ways to the cells behind them."""
    side_by_side = [{"x": x, "y": 5, "latch": True} for x in (26, 27)]
    state, chart = placed([{"x": 27, "y": 6}, *side_by_side])
    assert compiled.path(state.missions[0], state.uavs[0], 0, chart, 26, 4) == 5


BREEZE: dict[str, Any] = {"wind": {"strength": 0.7, "direction": 270, "seed": 1}}


def test_in_wind_a_uav_hovers_before_a_teammate_that_it_cannot_fly_around():
    """To and fro costs more, and brings it nowhere."""
    waiting = {"x": 4, "y": 0, "battery": 12, "latch": True}
    assert _mask(waiting, MOUTH | {"battery": 9}, **CORRIDOR, **BREEZE)[0, HOVER]


def test_in_wind_a_uav_flies_around_the_cell_that_a_teammate_will_take():
    """The teammate is not parked while it flies about, but will be when the UAV arrives."""
    sea: dict[str, Any] = {"grid": 20, "rows": 26, "zone": [16, 7, 2, 2], "pads": 2}
    sea |= {"nodes": [[0, 0]], "charge_start": 29, "charge_complete": 74}
    team: list[dict[str, Any]] = [
        {"x": 16, "y": 8, "battery": 26, "charging": True, "pad_request": 3},
        {"x": 16, "y": 6, "battery": 17},
        {"x": 15, "y": 6, "battery": 9},
    ]
    mask = _mask(*({"latch": True} | u for u in team), **sea, **BREEZE)
    assert np.nonzero(mask[2])[0].tolist() == [EAST]


def _cheapest(moves, closed, start, end):
    """The battery of the cheapest way between two cells that avoids a third."""
    spent = {start: 0}
    waiting = [(0, start)]
    while waiting:
        battery, (x, y) = heapq.heappop(waiting)
        for action in range(4):
            to = (int(x + STEP_X[action]), int(y + STEP_Y[action]))
            if not (0 <= to[0] < 16 and 0 <= to[1] < 16) or to == closed:
                continue
            more = battery + int(moves[action, to[1], to[0]])
            if more < spent.get(to, more + 1):
                spent[to] = more
                heapq.heappush(waiting, (more, to))
    return spent[end]


@pytest.mark.parametrize("seed", range(40))
def test_in_wind_a_late_uav_takes_the_cheapest_way_around_a_parked_teammate(seed):
    """The zone is two cells in a row, and the teammate charges in the front one.

    The cheapest way without the teammate leads through its cell. The battery of that one and the
    detour of the shortest way, taken together, let UAVs fly to and fro or along a dear row.
    """
    wind = {"strength": 0.5, "direction": 90, "gusts": 0.4, "seed": seed}
    sea: dict[str, Any] = {"grid": 16, "rows": 16, "zone": [12, 8, 2, 1], "pads": 2, "wind": wind}
    sea |= {"nodes": [[0, 0]], "charge_start": 29, "charge_complete": 100}
    parked = {"x": 12, "y": 8, "battery": 20, "charging": True, "pad_request": 3, "latch": True}
    state, chart = placed([parked, {"x": 2, "y": 9, "latch": True}], **sea)
    mission, u = state.missions[0], state.uavs[0, 1]
    moves = move_costs(mission, 1, (16, 16))
    left = _cheapest(moves, (12, 8), (2, 9), (13, 8)) + int(mission["waiting_slot"])
    view = View(state, SimpleNamespace(chart=chart), np.zeros(1, int), np.ones(1, int))
    while u["zone"] < 0 and left > 0:
        u["battery"], u["remainder"] = -(-left // 1000), -left % 1000
        action = np.nonzero(guard(view)[0])[0][0]
        if action != HOVER:
            u["x"] += STEP_X[action]
            u["y"] += STEP_Y[action]
            left -= int(moves[action, u["y"], u["x"]])
        else:
            left -= 1000
        u["zone"] = chart.zones[u["y"], u["x"]]
    assert left == mission["waiting_slot"]


def test_a_uav_stays_in_its_parking_cell_whoever_is_near():
    """Its teammate has the right of way, but flies around it: both must not move on and on."""
    team = {"x": 27, "y": 6, "battery": 5}, {"x": 27, "y": 5, "battery": 5, "latch": True}
    assert _mask(*team)[1, HOVER]


def test_where_no_pad_will_ever_work_no_uav_must_charge():
    state, _ = placed([{"battery": 5}], **QUEUE, failures={"pad_rate": 0.1})
    mission, u = state.missions[0], state.uavs[0, 0]
    assert compiled.must_charge(mission, u, 1e6)
    mission["pads_out"][0] = 1
    assert not compiled.must_charge(mission, u, 1e6)
    mission["pad_repair"] = 0.5
    assert compiled.must_charge(mission, u, 1e6)


@pytest.mark.parametrize(("uavs", "pads"), [(2, 1), (4, 2)])
def test_with_a_pad_for_two_uavs_the_second_comes_early_enough_to_wait(uavs, pads):
    space = load_scenario("paper", uavs=uavs, pads=pads)
    missions = simulate_batch(space, policies.load("greedy"), 777301, 200).missions
    assert missions["success"].mean() >= 0.99


# --- what killed UAVs that had a way to live ---

WIND = {"wind": {"strength": 0.8, "direction": 37, "gusts": 0.4, "seed": 1}}
SHARED: dict[str, Any] = {"uavs": 2, "pads": 1}
SHARED |= {"wind": {"strength": 0.2, "direction": 268, "gusts": 0.1, "seed": 79}}


@pytest.mark.parametrize(
    ("sea", "changes", "policy", "replication"),
    [
        # The sea is empty: the arrivals that are left fill the quota too late.
        ("clustered:900307", {"uavs": [3, 5], "pads": 3}, "generalist", 2),
        # A third UAV would wait for longer than its battery lasts; another zone is in reach.
        ("corridor:900002", {"uavs": [5, 6], "pads": 4}, "generalist", 9),
        # The own cell is behind others of the zone, in wind.
        ("clustered:900701", WIND, "generalist", 3),
        # The zone that is nearest by cells is not the one that is nearest by battery.
        ("coast:900701", WIND, "greedy", 2),
        # Four UAVs insist on cells beside each other.
        ("archipelago:700023", {"uavs": 6, "pads": 6}, "greedy", 4),
        # Two UAVs share a pad: the one with more battery comes first, and takes it too late.
        ("scattered:910028", SHARED, "greedy", 1),
        # Three UAVs come to a zone of six cells at once, and two of them close its side.
        ("clustered:910027", {"uavs": 3, "pads": 2}, "greedy", 6),
        # One of two UAVs takes the pad of the only zone that the other reaches.
        ("large:700014", {"uavs": 2, "pads": 1}, "generalist", 1),
        # Two UAVs come to a pad in the same slot, and the one with less battery cannot wait.
        ("large:1230002", {"uavs": 2, "pads": 1}, "greedy", 0),
        # Six UAVs collect the last data faster than they did on the whole.
        ("clustered:970026", {"uavs": 6, "pads": 3}, "planner-short", 2),
    ],
)
def test_a_uav_that_has_a_way_to_live_lives(sea, changes, policy, replication):
    space = load_scenario(sea, **changes)
    assert simulate_batch(space, policies.load(policy), 2600, [replication]).missions["success"][0]


def test_a_uav_must_charge_if_no_data_are_left_for_its_quota_unless_it_lives_to_the_end():
    state, _ = placed([{"battery": 60}], arrival_rate=0.0, quota=440)
    mission, u = state.missions[0], state.uavs[0, 0]
    u["communications"] = 400  # 10 slots are enough if there are data
    assert not compiled.must_charge(mission, u, 1e6)
    assert compiled.must_charge(mission, u, 0.0)
    mission["slot"] = mission["max_slots"] - 60
    assert compiled.must_charge(mission, u, 0.0)
    mission["slot"] += 1
    assert not compiled.must_charge(mission, u, 0.0)


@pytest.mark.parametrize(("latch", "data", "must"), [(False, 5, 0), (True, 5, 1), (True, 7, 0)])
def test_a_uav_below_c_s_counts_on_no_data_that_will_be_collected_before(latch, data, must):
    """The UAV needs 10 slots, for which 3 data units are enough on average, and 6 near nodes."""
    state, _ = placed([{"battery": 20, "latch": latch}], arrival_rate=0.0, quota=440)
    mission, u = state.missions[0], state.uavs[0, 0]
    u["communications"] = 400
    mission["slot"], mission["collected"] = 50, 100.0
    assert compiled.must_charge(mission, u, data) == must


def test_a_uav_that_can_reach_two_zones_leaves_the_pad_to_one_that_can_reach_one():
    """The batteries are equal, so the first UAV would choose first."""
    team: list[dict[str, Any]] = [{"x": x, "y": 1, "battery": 15} for x in (12, 15)]
    sea: dict[str, Any] = {"grid": 24, "rows": 3, "zone": [0, 0, 1, 3], "pads": 1}
    sea |= {"zones": [{"cells": [22, 0, 2, 3], "pads": 1}]}
    sea |= {"nodes": [[12, 0]], "charge_start": 20, "charge_complete": 80}
    state, chart = placed(team, **sea)
    zones = [compiled.parking_cell(state.missions[0], state.uavs[0], i, chart)[0] for i in (0, 1)]
    assert zones == [0, 22]


def test_who_stands_in_the_way_before_a_landing_moves_on_though_all_cells_are_contested():
    """All teammates may charge there, so there is no move that hinders none who comes to charge."""
    team: list[dict[str, Any]] = [{"x": 5, "y": 1, "battery": 50, "latch": True}]
    team += [{"x": 4, "y": y, "battery": 40, "latch": True} for y in (0, 2)]
    team += [{"x": 6, "y": 1, "battery": 20, "latch": True, "overruled": True, "overruled_by": 0}]
    sea = {"grid": 24, "rows": 3, "zone": [0, 0, 2, 3], "nodes": [[12, 0]], "landing": True}
    state, chart = placed(team, **sea)
    rows = np.zeros(len(team), int), np.arange(len(team))
    for slot in (6, 7):
        state.missions["slot"] = slot
        may_hover = guard(View(state, SimpleNamespace(chart=chart), *rows))[0, HOVER]
        assert may_hover == (slot == 6)
