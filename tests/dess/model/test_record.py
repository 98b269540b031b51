"""The record of a mission and its event log."""

import pickle
from heapq import heappop, heappush
from math import ceil

import numpy as np
import pytest

from dess import load_scenario
from dess import policies as shipped
from dess.model.mission import simulate
from dess.model.record import MISSION_RECORD
from dess.model.state import BATTERY, constants_of
from dess.model.ways import move_costs
from dess.scenario.scenario import ScenarioSpace
from tests.drawn import Commuter, Script


def test_metrics_and_the_columns_of_a_log_are_attributes():
    record = simulate(ScenarioSpace.of(), Commuter(), 3, 4, events=True)
    assert (record.seed, record.replication) == (3, 4) and isinstance(record.success, int)
    for name in set(MISSION_RECORD.names or ()) - {"uavs"}:
        assert type(getattr(record, name)) in (int, float)
    assert record.events is not None and record.events.event[0] == "mission_start"
    for name, column in record.events.columns().items():
        np.testing.assert_array_equal(getattr(record.events, name), column)
    for holder in (record, record.events):
        with pytest.raises(AttributeError, match="speed"):
            _ = holder.speed
    assert pickle.loads(pickle.dumps(record)).metrics.tobytes() == record.metrics.tobytes()


def test_the_way_home_is_the_cheapest_in_battery():
    """Dijkstra's algorithm in plain Python, over the costs of moves in the wind."""
    wind = {"strength": 0.7, "direction": 70.0, "gusts": 0.5, "seed": 3}
    space = load_scenario("archipelago:2", wind=wind, fleet=[{"slots_per_cell": 2}, {}])
    columns, rows = space.size
    record = simulate(space, shipped.load("random-unguarded"), 3, events=True)
    for i, uav in enumerate(record.uavs):
        moves = move_costs(constants_of(space)[0], (2, 1)[i % 2], (rows, columns))
        at = next((e.x, e.y) for e in reversed(record.events or []) if e.uav == i)
        costs, queue = {at: 0}, [(0, at)]
        while space.chart.zones[queue[0][1][::-1]] < 0:
            cost, (x, y) = heappop(queue)
            for action, (dx, dy) in enumerate([(0, -1), (1, 0), (0, 1), (-1, 0)]):
                to = x + dx, y + dy
                if not (0 <= to[0] < columns and 0 <= to[1] < rows) or to in space.no_fly:
                    continue
                further = cost + moves[action, to[1], to[0]]
                if further < costs.get(to, 10**9):
                    costs[to] = further
                    heappush(queue, (further, to))
        events = record.events or []
        spent = next(e.value for e in events if e.event == "remainder" and e.uav == i)
        further = uav["way_home"] - ceil((queue[0][0] + spent) / 1000)
        assert further in ((0, 1, 2) if i % 2 == 0 else (0,))  # in the middle of a slow move
        assert uav["end"] == BATTERY and record.home == 0


@pytest.mark.parametrize("battery, home", [(10, 1), (6, 1), (5, 0)])
def test_a_mission_is_home_if_its_uav_has_the_battery_for_the_way(battery, home):
    # Three cells south of its zone the quota of 12 is filled, and three percent are left or not.
    sea = {"grid": 8, "zone": [2, 2, 1, 1], "nodes": [[2, 6]], "initial_data": 1e6, "uavs": 1}
    space = ScenarioSpace.of(**sea, quota=12, flying_time=battery, charge_start=10)
    record = simulate(space, Script("SSS"), 1)
    assert record.success and record.home == home and record.uavs["way_home"].tolist() == [3]


# A zone of two cells, where two UAVs may charge from the first slot on.
CHARGING = {"grid": 8, "zone": [2, 2, 2, 1], "nodes": [[2, 6]], "charge_complete": 80}


def test_a_record_has_the_percent_that_charging_has_added():
    """From 27 to 80 % at 10 % a slot, the sixth slot adds 3 %, and both share 7 % a slot."""
    alone = ScenarioSpace.of(**CHARGING, uavs=1, flying_time=27, charge_start=30, max_slots=8)
    record = simulate(alone, Script(""), 1)
    assert record.uavs[["slots_charging", "charged"]].tolist() == [(6, 53)]
    assert (record.uavs["battery"] == 78).all()  # two slots of hovering later
    shared = ScenarioSpace.of(alone, uavs=2, charging={"power": 7})
    both = simulate(shared, Script("", ""), 1)
    assert both.uavs["slots_charging"].tolist() == [8, 8]
    assert both.uavs["charged"].sum() == 7 * 8
    assert (both.uavs["charged"] == both.uavs["battery"] - 27).all()


DOWN = [
    ({}, "SSSS", "truncated", 0),
    ({"flying_time": 4}, "SSSS", "battery", 1),
    ({"failures": {"uav_rate": 1.0}}, "SSSS", "lost", 1),
    # It fails in the first slot, out at sea or in its zone, and is never repaired in time.
    ({"failures": {"uav_rate": 1.0, "uav_repair": 1e6}}, "SSSS", "truncated", 1),
    ({"failures": {"uav_rate": 1.0, "uav_repair": 1e6}}, "....", "truncated", 0),
]


@pytest.mark.parametrize(("values", "route", "end", "is_down"), DOWN)
def test_a_uav_is_down_if_it_is_empty_lost_or_floats_at_sea(values, route, end, is_down):
    fields = {"uavs": 1, "flying_time": 50, "charge_start": 10, "max_slots": 4}
    record = simulate(ScenarioSpace.of(**CHARGING | fields | values), Script(route), 1)
    assert record.uav_rows()[0]["end"] == end and record.uavs["down"].tolist() == [is_down]


def test_a_record_and_its_log_are_printed_in_a_line():
    record = simulate(ScenarioSpace.of(), Commuter(), 3, 4, events=True)
    for shown in (repr(record), str(record), repr(record.events)):
        assert len(shown) < 400 and "\n" not in shown
    assert repr(record).startswith("MissionRecord(seed=3, replication=4, ")
    assert f"events={record.events!r}" in repr(record)
    assert repr(record.events) == f"EventLog of {len(record.events or [])} events"
