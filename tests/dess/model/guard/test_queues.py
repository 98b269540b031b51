"""The plan of charging pads: who is charged where and when, worked out by hand."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import load_scenario, policies
from dess.model.batch import simulate_batch
from dess.model.guard.queues import KEPT
from dess.model.state import BATTERY
from tests import compiled
from tests.dess.envs.episodes import placed

# A strip of three rows with a zone at its western end. C_S 20, C_C 80, and 10 % a charging slot.
STRIP: dict[str, Any] = {"grid": 40, "rows": 3, "zone": [0, 0, 2, 3], "pads": 1, "nodes": [[20, 0]]}
STRIP |= {"charge_start": 20, "charge_complete": 80}
# A second zone at the eastern end.
BOTH_ENDS = STRIP | {"zones": [{"cells": [38, 0, 2, 3], "pads": 1}]}
SLOT = 9


def _uav(cells: int, battery: int, **state: Any) -> dict[str, Any]:
    """A UAV so many cells east of the western zone, all in the row in its middle."""
    state = {"latch": battery <= 20, "pad_request": -1, "executed": 4} | state
    return {"x": cells + 1, "y": 1, "battery": battery} | state


def _plan(uavs: list[dict[str, Any]], i: int = 0, **scenario: Any) -> Any:
    """The plan of a team in slot ``SLOT``, and what it means for UAV ``i``."""
    state, chart = placed(uavs, **STRIP | scenario)
    state.missions["slot"] = SLOT
    mission, team = state.missions[0], state.uavs[0]
    return compiled.plan_of_pads(mission, team, i, chart)


CHARGING = {"pad_request": 5, "charging": True, "charge_slots": 3, "latch": True}


@pytest.mark.parametrize(
    ("uavs", "scenario", "begins"),
    [
        # Who comes first is charged first. It has 16 % then and needs 7 slots for 64 %.
        ([_uav(5, 20), _uav(3, 19)], {}, [10, 3]),
        # Above C_S no UAV can ask, and a UAV that comes later with less battery is before it.
        ([_uav(2, 30), _uav(6, 19)], {}, [13, 6]),
        # The pad is taken for 3 slots, then a UAV has asked for it, which needs 8 slots for 71 %.
        ([_uav(2, 20), _uav(0, 12, pad_request=7), _uav(1, 50, x=0, **CHARGING)], {}, [11, 3, -1]),
        # With two pads, only the third waits: until 6 slots after the first has come.
        ([_uav(3, 20), _uav(1, 21), _uav(1, 22)], {"pads": 2}, [7, 1, 2]),
        # Of those who come at once, the lowest index; or the lowest battery if that is the order.
        ([_uav(2, 20), _uav(2, 19)], {}, [2, 9]),
        ([_uav(2, 20), _uav(2, 19)], {"charging": {"order": "lowest-battery"}}, [9, 2]),
        # Two pads share 10 % a slot: the first UAV needs 13 slots for 62 %, and not 7.
        (
            [_uav(2, 20), _uav(2, 19), _uav(3, 19)],
            {"pads": 2, "charging": {"power": 10}},
            [2, 2, 15],
        ),
        # The second, 3 cells away with 6 %, would be empty if the first took the pad before it.
        ([_uav(0, 20), _uav(3, 6)], {}, [11, 3]),
        # Nothing is gained if it gives way to one that has enough.
        ([_uav(0, 20), _uav(3, 8)], {}, [0, 6]),
    ],
)
def test_when_each_uav_begins_to_charge(uavs, scenario, begins):
    assert _plan(uavs, **scenario)[0].turns["begins"].tolist() == begins


@pytest.mark.parametrize(
    ("uavs", "i", "kept"),
    [
        # The last of a queue keeps what those before it may be late.
        ([_uav(5, 20), _uav(3, 19)], 0, KEPT),
        # The first must begin 7 slots before that: 7 more than the battery of the other is ahead.
        ([_uav(5, 20), _uav(3, 19)], 1, KEPT + 7 - 1),
        # Of three, the first keeps the slots of both charges, if it can ask so early.
        ([_uav(1, 20), _uav(1, 20), _uav(1, 20)], 0, KEPT + 7 + 7),
        ([_uav(1, 20), _uav(1, 20), _uav(1, 20)], 1, KEPT + 7),
        ([_uav(1, 24, latch=True)] * 4, 0, 19),  # never more than C_S - 1
    ],
)
def test_the_slots_that_each_uav_keeps_for_waits(uavs, i, kept):
    assert _plan(uavs, i)[1][0] == kept


OFF: dict[str, Any] = {"charging": {"plan_waits": False}}


@pytest.mark.parametrize(
    ("battery", "scenario", "are_kept"),
    [
        (20, {}, True),
        (20, OFF, False),
        (20, OFF | {"failures": {"pad_rate": 0.1}}, True),  # then they are always planned
        (20, {"pads": 2}, False),
        (20, {"landing": True}, False),  # on the ground, it may wait for as long as it likes
        (20, {"quota": 80}, False),  # it can fill it in 10 slots
        (60, {}, True),
    ],
)
def test_slots_are_kept_for_waits_where_uavs_may_have_to_wait(battery, scenario, are_kept):
    state, chart = placed([_uav(2, battery), _uav(9, battery)], **STRIP | scenario)
    kept = compiled.parking_cell(state.missions[0], state.uavs[0], 0, chart)[3]
    assert (kept > 0) == are_kept


@pytest.mark.parametrize(("battery", "way"), [(6, 1), (8, 0)])
def test_a_uav_does_not_ask_for_a_pad_that_another_needs_more(battery, way):
    assert _plan([_uav(0, 20), _uav(3, battery)])[1][2] == way


def test_a_uav_that_comes_in_the_same_slot_as_one_with_less_battery_gives_way_to_it():
    """Both can ask now, and a pad that both ask for goes to the lower index."""
    assert _plan([_uav(0, 20), _uav(0, 5, y=2)])[1][2] == 1


@pytest.mark.parametrize(("i", "way"), [(0, 1), (1, 0)])
def test_no_uav_gives_way_to_one_that_is_charging(i, way):
    """The pad is taken for 3 slots; then the first could wait for 7 slots more, the second not."""
    team = [_uav(0, 20), _uav(0, 8, y=2), _uav(1, 50, x=0, **CHARGING)]
    assert _plan(team, i)[1][2] == way


@pytest.mark.parametrize(
    ("uavs", "zones"),
    [
        # Of two that fly to one pad, the one that can reach the other zone does.
        ([_uav(20, 22), _uav(22, 22)], [0, 1]),
        # Who can wait is not sent away.
        ([_uav(5, 30), _uav(4, 30)], [0, 0]),
    ],
)
def test_in_which_zone_each_uav_charges(uavs, zones):
    assert _plan(uavs, **BOTH_ENDS)[0].turns["zone"].tolist() == zones


def test_no_uav_makes_room_for_one_that_reaches_no_zone():
    """The pad would be free for it two slots later than it is empty on its way."""
    far_north = [{"cells": [4, 13, 1, 1], "pads": 1}]
    plan, _ = _plan([_uav(3, 11), _uav(8, 5)], rows=16, zones=far_north)
    assert plan.turns["zone"].tolist() == [0, -1]


def test_a_uav_rather_waits_outside_of_a_cell_than_without_a_slot_to_spare():
    """At one pad it would begin in the last slot of its battery; at the other it has 7 more."""
    cell = {"grid": 48, "zones": [{"cells": [47, 1, 1, 1], "pads": 1}]}
    team = [_uav(23, 31), _uav(23, 31, y=0), _uav(36, 31)]
    plan, _ = _plan(team, **cell, charge_start=50, charge_complete=71)
    assert plan.turns["zone"].tolist() == [1, 0, 1]


def test_a_uav_leaves_the_near_zone_to_two_that_come_before_it_with_more_battery():
    """Their charges last until slot 24; it is empty after 22, and 20 cells from the other zone."""
    uavs = [_uav(17, 22), _uav(9, 24), _uav(10, 25)]
    state, chart = placed(uavs, **BOTH_ENDS | {"charge_start": 30})
    assert compiled.parking_cell(state.missions[0], state.uavs[0], 0, chart)[:2] == (38, 1)


@given(st.lists(st.tuples(st.integers(0, 35), st.integers(1, 60)), min_size=2, max_size=6))
def test_no_pad_is_given_to_two_uavs_at_once(team):
    """And no UAV is charged before it has come, nor asks above C_S."""
    uavs = [_uav(cells, battery) for cells, battery in team]
    turns = _plan(uavs, **BOTH_ENDS)[0].turns
    is_planned = turns["zone"] >= 0  # who reaches no zone is not
    assert (turns["begins"] >= turns["asks"])[is_planned].all()
    for zone in (0, 1):
        begins = turns["begins"][turns["zone"] == zone]
        assert len({*begins}) == len(begins)
        for turn in turns[turns["zone"] == zone]:
            left = max(turn["deadline"] + 1 - turn["begins"], 0)
            until = turn["begins"] + -(-(80 - left) // 10)
            assert (begins[begins > turn["begins"]] >= until).all()
    batteries = np.array([battery for _, battery in team])
    assert (batteries - turns["asks"] <= 20)[is_planned].all()


def test_hardly_any_uav_is_lost_to_the_wind_with_a_pad_for_two():
    """In wind, the order in which UAVs come changes on the way, and flying about is dear."""
    nodes = [[x, y] for x in (1, 8, 15, 22, 29) for y in (1, 6, 11)]
    sea = {"grid": 32, "rows": 13, "zone": [1, 2, 2, 3], "nodes": nodes, "quota": 400, "uavs": 4}
    pads = {"pads": 1, "zones": [{"cells": [28, 8, 2, 3], "pads": 1}]}
    wind = {"strength": 0.7, "gusts": 0.35, "direction": 60, "seed": 1}
    space = load_scenario("paper", **sea, **pads, wind=wind)
    ends = simulate_batch(space, policies.load("greedy"), 1, 120).uavs["end"]
    assert (ends == BATTERY).any(1).sum() == 0
