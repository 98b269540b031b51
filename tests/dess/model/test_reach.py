"""Which nodes a lone UAV can serve, by trips that are computed by hand."""

import math
from typing import Any

import numpy as np
import pytest

from dess import simulate
from dess.model.reach import SlotCosts, battery_of_trips, reach_of_nodes
from dess.scenario.scenario import ScenarioSpace
from tests.drawn import Script

SHEET = {
    **{"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "data_rate": "20 kB/h"},
    **{"bandwidth": "125 kHz", "snr": "12 dB at 2 km", "range": "2 km", "backlog": "1 MB"},
}
# A cell is 315 m, so 2 km are 6 cells, and 7 are too far.
CELLS_IN_RANGE = 6


# Nodes along the north of a sea, whose base is in the north-west.
SEA: dict[str, Any] = {
    **{"grid": 64, "rows": 4, "zone": [0, 0, 1, 2], "uavs": 1},
    "nodes": [[x, 0] for x in range(1, 61)],
}


def _space(sheet: dict[str, str] | None = None, **values: Any) -> ScenarioSpace:
    return ScenarioSpace.of(**(SEA | values), data_sheet=SHEET | (sheet or {}))


def _without_range(more: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in (SHEET | more).items() if name != "range"}


def _farthest(nodes: tuple[int, ...], space: ScenarioSpace) -> int:
    """The cell of the last node before these."""
    return space.nodes[nodes[0]][0] - 1


@pytest.mark.parametrize(
    ("sheet", "cells", "guarded"),
    [
        # 49 out, a slot of hovering there (1.217 %), and 49 back are 99.217 %; the guard keeps the
        # most that a further slot may take.
        ({}, 49, 48),
        ({"reserve": "20 %"}, 39, 38),
        ({"horizon": "21 min"}, 29, 29),  # of 60 slots, the last one stands on the ground
    ],
)
def test_a_node_is_out_of_reach_where_no_trip_leads_into_its_range(sheet, cells, guarded):
    space = _space(sheet)
    reach = reach_of_nodes(space)
    assert _farthest(reach.lost, space) == cells + CELLS_IN_RANGE
    assert reach.largest_ratio == pytest.approx((guarded + CELLS_IN_RANGE) / 60)
    assert len(reach.margins) == cells - guarded


@pytest.mark.parametrize(
    ("values", "cells"),
    [
        ({"fleet": [{"flying_time": 40}]}, 49),  # it is charged to 100 %
        ({"charge_complete": 60}, 49),  # it starts with 100 %
        ({"fleet": [{"flying_time": 70}], "charge_complete": 60}, 34),
        ({"flying_time": 50, "charge_complete": 60}, 29),
        ({"fleet": [{"endurance": "28 min"}], "charge_complete": 60}, 39),  # 80 %
    ],
)
def test_a_full_battery_is_the_larger_one_of_start_and_charge(values, cells):
    space = _space(**values)
    assert _farthest(reach_of_nodes(space).lost, space) == cells + CELLS_IN_RANGE


def test_a_uav_flies_that_far_and_no_farther():
    space = _space()
    home = {}
    for cells in (49, 50):
        route = "E" * cells + "." + "W" * cells
        home[cells] = simulate(space, Script(route), 1, events=True)
    landed, lost = (home[cells].metrics["success"] for cells in (49, 50))
    assert (landed, lost) == (1, 0)
    events = home[49].events
    assert events is not None
    served = {e.node for e in events if e.event == "communication"}
    assert max(served) + 1 <= 49 + CELLS_IN_RANGE


def test_the_margins_of_the_guard_leave_less_of_the_sea_to_a_fleet():
    full = {"flying_time": 100, "charge_complete": 100, "landing": True, "quota": 0}
    alone = ScenarioSpace.of(**SEA, **full, cell_size=315, radio={"range": 2000})
    together = ScenarioSpace.of(alone, uavs=2)
    assert reach_of_nodes(alone).margins == ()
    assert reach_of_nodes(alone).lost == reach_of_nodes(together).lost
    # With a teammate, 5 slots for detours and one more: 46 out, a slot there, 46 back, of 1 % each.
    assert _farthest(reach_of_nodes(together).margins, together) == 46 + CELLS_IN_RANGE


def test_each_direction_has_its_cost_and_coasts_are_flown_around():
    wall = [[2, y] for y in range(3)]
    space = _space(nodes=[[1, 0]], no_fly=wall, zone=[0, 0, 1, 1])
    moves = np.empty((4, 4, 64))
    moves[:] = np.array([900, 2072, 1100, 500])[:, None, None]  # north, east, south, west
    trips = battery_of_trips(space, SlotCosts(moves, 1216))
    assert trips[0, 1] == 2072 + 1216 + 500
    assert trips[0, 3] == 3 * (2072 + 500) + 3 * (900 + 1100) * 2 + 1216
    assert trips[0, 2] == trips[0, 0] == math.inf, "land, and the zone, where a UAV would stand"


def test_a_node_is_in_range_where_its_mean_snr_reaches_the_lowest_step():
    """With 12 dB at 2 km and an exponent of 2.27, -7.5 dB are reached up to 14.45 km.

    In a mission of four slots, a UAV flies one cell, hovers there, and flies back.
    """
    steps = [["-7.5 dB", "5.5 kbit/s"], ["0 dB", "50 kbit/s"]]
    sheet = _without_range({"rates": steps, "horizon": "84 s"})
    nodes = [[x, 0] for x in range(1, 64)]
    space = ScenarioSpace.of(grid=64, zone=[0, 0, 1, 1], uavs=1, nodes=nodes, data_sheet=sheet)
    limit = 2000 * 10 ** (19.5 / 22.7)
    beyond = [x for x, _ in nodes if math.hypot(315 * (x - 1), 10) > limit]
    reach = reach_of_nodes(space)
    assert 0 < len(beyond) < len(nodes) and reach.has_limit
    assert [space.nodes[k][0] for k in reach.lost] == beyond


def test_without_range_and_steps_every_node_is_in_range():
    sheet = _without_range({})
    space = ScenarioSpace.of(grid=64, nodes=[[0, 0], [63, 63]], data_sheet=sheet)
    reach = reach_of_nodes(space)
    assert not reach.has_limit
    assert (reach.lost, reach.margins, reach.largest_ratio) == ((), (), 1)
