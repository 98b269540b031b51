"""Missions worked by hand.

The channel makes the figures easy: cells of 40 m, altitude 10 m, exponent 2, no shadowing, and an
SNR of 255 straight above a node. At k = dx^2 + dy^2 [cells^2] the squared distance is
100 (1 + 16 k) m^2, so SNR = 255 / (1 + 16 k), and a whole slot carries
  k = 0: log2(256) = 8 units; k = 1: SNR 15, log2(16) = 4 units.
The grid is 4 x 4, half its diagonal squared is 2 * 80^2 = 12800 m^2, so the SNR there, which the
scenario wants in dB, is 255 * 100 / 12800 = 1.9921875.
"""

import math

import pytest

from dess.model.state import BATTERY, QUOTA, TRUNCATED
from tests.dess.model.flights import CHANNEL, Case, check

HAND = CHANNEL | {"charge_start": 11, "charge_complete": 25, "uavs": 1, "zone": [0, 0, 1, 1]}
ADJACENT_NODE = HAND | {"nodes": [[1, 0]], "initial_data": 50.0}
# Two UAVs that start in a zone of two cells, far from a node that is never emptied.
PAIR = HAND | {"uavs": 2, "zone": [0, 0, 2, 1], "nodes": [[3, 3]], "initial_data": 1000.0}
ONE_NODE = PAIR | {"nodes": [[0, 0]], "quota": 1, "flying_time": 20}


def _bits(k: float) -> float:
    """Data units that a whole slot carries over k [cells^2]."""
    return math.log2(1 + 255 / (1 + 16 * k))


def _emptied() -> Case:
    """One node at (1, 0) with 19.5 units, one UAV from (0, 0): east, east, west, then it hovers.

    Slot 0 ends above the node: 8 units. Slot 1 one cell beyond: 4. Slot 2 back above it: R = 8, but
    19.5 - 12 = 7.5 are left. Slots 3 and 4: no node with data, so no communication. Three of four
    for the quota, and the battery of 5 is empty after slot 4.
    Reward: 1.3 * 19.5 - 5 * 0.1 - 300 = -275.15.
    """
    fields = ADJACENT_NODE | {"initial_data": 19.5, "quota": 4, "flying_time": 5}
    expected = {
        "communication time x value": [(1, 1, 8), (2, 2, 4), (3, 1, 7.5)],
        "battery_empty time uav value": [(5, 0, 0)],
        "record slots success collected residual reward": [5, 0, 19.5, 0, -275.15],
        "record collection_ratio collection_ratio_and_communication": [1, 0],
        "uavs quota battery slots_charging end": [(3, 0, 0, BATTERY)],
    }
    return Case(fields, ("EEW",), expected)


def _two_nodes() -> Case:
    """m = 2; nodes at (1, 0) and (3, 0) with 6 units each; one UAV flies east from (0, 0).

    Half a slot carries half of log2(1 + 255 / (1 + 16 k)):
      t = 0, n = 1: x = 0.5, k = 1/4: SNR 51, log2(52) / 2 = 2.85022 of the first node;
             n = 2: x = 1, k = 0: 4 units, but 6 - 2.85022 = 3.14978 are left: it is empty;
      t = 1, n = 1: x = 1.5, second node, k = 9/4: SNR 255/37, log2(292/37) / 2 = 1.49019;
             n = 2: x = 2, k = 1: 2 units;
      t = 2, n = 1: x = 2.5, k = 1/4: 2.85022, but 6 - 3.49019 = 2.50981 are left: it is empty,
             and this is the fifth communication, so the quota of 5 is filled;
             n = 2: nothing is left.
    Reward: 1.3 * 12 - 3 * 0.1 + 100 = 115.3. Battery: 20 - 3.
    """
    fields = ADJACENT_NODE | {
        "communication_slots": 2,
        "nodes": [[1, 0], [3, 0]],
        "initial_data": 6.0,
    }
    first, second = _bits(1 / 4) / 2, _bits(9 / 4) / 2
    served = [(0.5, 0, first), (1, 0, 6 - first), (1.5, 1, second), (2, 1, 2)]
    expected = {
        "communication time node value": [*served, (2.5, 1, 4 - second)],
        "communication x": [0.5, 1, 1.5, 2, 2.5],
        "quota_filled time value": [(3, 5)],
        "record slots success reward": [3, 1, 115.3],
        "record collection_ratio_and_communication": [1],
        "uavs quota battery end": [(5, 17, QUOTA)],
    }
    return Case(fields | {"quota": 5, "flying_time": 20}, ("EEE",), expected)


def _charge_stop() -> Case:
    """One UAV hovers in its zone of one cell next to a full node: 4 units per communication.

    C_S = 11, C_C = 25, b(0) = 12. Slot 0: 12 > C_S, it flies: b = 11, first communication.
    Slot 1: 11 <= C_S, it charges: 21. Slot 2: min(31, 25) = 25, full. Slots 3..6: it flies and
    communicates again, for the quota of 5 in slot 6: b = 25 - 4 = 21, collected 5 * 4 = 20.
    Reward: 1.3 * 20 - 7 * 0.1 + 2 * 0.05 + 100 = 125.4.
    """
    expected = {
        "move value": [11, 21, 25, 24, 23, 22, 21],
        "communication time": [1, 4, 5, 6, 7],
        "charge_request time value": [(1, 11)],
        "charge_start time value": [(1, 11)],
        "charge_end time value": [(3, 25)],
        "record slots success uav_slots collected reward": [7, 1, 7, 20, 125.4],
        "record collection_ratio": [20 / 50],
        "uavs slots_flying slots_charging slots_waiting": [(5, 2, 0)],
    }
    return Case(ADJACENT_NODE | {"quota": 5, "flying_time": 12}, ("",), expected)


def _index_order(starts: list[tuple[int, int]], amounts: list[float]) -> Case:
    """UAV 0 above the node takes 8 of 10, UAV 1 the 2 that are left although R = 4; or UAV 0 beside
    it takes 4, UAV 1 above it the 6 that are left although R = 8.

    Each UAV is paid for the data of the whole team: 1.3 * 10 - 0.1 + 100.
    """
    expected = {
        "communication uav node": [(0, 0), (1, 0)],
        "uavs collected reward": [(amount, 112.9) for amount in amounts],
        "record slots success residual": [1, 1, 0],
    }
    return Case(ONE_NODE | {"initial_data": 10.0}, ("", ""), expected, starts)


def _queue() -> Case:
    """Two UAVs hover in a zone of two cells with one pad; C_S = 11, C_C = 30, b(0) = 12.

    slot      0   1   2   3   4   5   6
    UAV 0    11  21  30  29  28  27  26    charges in slots 1 and 2 (31 is cut to 30)
    UAV 1    11  10   9  19  29  30  29    waits in 1 and 2, charges in 3, 4 and 5
    While it waits it flies: it pays 1 and communicates. Communications: UAV 0 in 0, 3, 4, 5, 6;
    UAV 1 in 0, 1, 2, 6.
    """
    levels = zip([11, 21, 30, 29, 28, 27, 26], [11, 10, 9, 19, 29, 30, 29], strict=True)
    expected = {
        "move value": [*levels],
        "charge_request time uav": [(1, 0), (1, 1)],
        "charge_start time uav": [(1, 0), (3, 1)],
        "charge_end time uav": [(3, 0), (6, 1)],
        "communication time": [1, 1, 2, 3, 4, 5, 6, 7, 7],
        "communication uav": [0, 1, 1, 1, 0, 0, 0, 0, 1],
        "uavs slots_waiting slots_charging slots_flying": [(0, 2, 5), (2, 3, 4)],
        "uavs end": [(TRUNCATED,), (TRUNCATED,)],
    }
    fields = {"pads": 1, "flying_time": 12, "charge_complete": 30, "max_slots": 7}
    return Case(PAIR | fields, ("", ""), expected)


def _first_come() -> Case:
    """UAV 0 is away in slots 0 and 1 and asks last; one pad; C_S = 11, C_C = 21, b(0) = 12.

    slot      0   1   2   3   4   5
    UAV 0    11  10   9   8  18  21    asks in slot 2, waits in 2 and 3, charges in 4 and 5
    UAV 1    11  21  20  19  18  17    asks in slot 1, charges at once
    UAV 2    11  10  20  21  20  19    asks in slot 1, waits in 1, charges in 2 and 3
    """
    levels = [11, 10, 9, 8, 18, 21], [11, 21, 20, 19, 18, 17], [11, 10, 20, 21, 20, 19]
    expected = {
        "move value": [*zip(*levels, strict=True)],
        "charge_start time uav": [(1, 1), (2, 2), (4, 0)],
        "uavs slots_waiting": [(2,), (0,), (1,)],
    }
    fields = {"uavs": 3, "zone": [0, 1, 3, 1], "pads": 1, "charge_complete": 21}
    return Case(PAIR | fields | {"flying_time": 12, "max_slots": 6}, ("NS", "", ""), expected)


def _crowding() -> Case:
    """UAV 1 charges slowly on (1, 0); UAV 0 tries to enter from (1, 1) until its battery is empty.

    b(0) = 13, C_S = 10, C_C = 100, 1 % per charging slot, the mission is cut after 20 slots.
    UAV 1: 12, 11, 10, then it charges in slots 3..19: 10 + 17 = 27.
    UAV 0: south to (0, 1), east to (1, 1), then it asks for north in slots 2..12, is overruled
    11 times, and its battery is empty after slot 12, outside the zone.
    Node at (3, 3). From (1, 0) and (0, 1) it is k = 13: log2(1 + 255/209) = 1.15063 units a slot,
    from (1, 1) k = 8: log2(1 + 255/129) = 1.57373. The team collects, until then,
    3 * 1.15063 + 1.15063 + 12 * 1.57373 = 23.48728, and nothing after.
    Rewards: 1.3 * 23.48728 - 13 * 0.1 - 11 * 1 - 300 and 1.3 * 23.48728 - 20 * 0.1 + 17 * 0.05.
    """
    collected = 4 * _bits(13) + 12 * _bits(8)
    expected = {
        "collision time uav x y": [(t, 0, 1, 1) for t in range(2, 13)],
        "battery_empty time uav": [(13, 0)],
        "uavs quota battery slots_charging end": [(13, 0, 0, BATTERY), (3, 27, 17, TRUNCATED)],
        "uavs reward": [(1.3 * collected - 312.3,), (1.3 * collected - 1.15,)],
        "record slots uav_slots success collected": [20, 33, 0, collected],
        "record collection_ratio": [collected / 1000],
    }
    fields = {"charge_start": 10, "charge_complete": 100, "charge_rate": 1, "flying_time": 13}
    routes = "SE" + "N" * 18, ""
    return Case(PAIR | fields | {"max_slots": 20}, routes, expected, [(0, 0), (1, 0)])


def _last_slot() -> Case:
    """b(0) = 2, quota 2: the second communication comes as the battery runs out; it counts."""
    expected = {
        "uavs quota battery end": [(2, 0, QUOTA)],
        "record success slots reward": [1, 2, 1.3 * 12 - 0.2 + 100],
    }
    return Case(ADJACENT_NODE | {"quota": 2, "flying_time": 2}, ("EE",), expected)


def _no_decrease(quota: int, end: int, slots: int, collected: float, reward: float) -> Case:
    """b(0) = 2 lasts for ever: the mission ends by its quota, or is cut after 6 slots.

    Node at (1, 0). East 8 units, east 4, west 8, and 8 in each slot that it hovers there.
    """
    expected = {
        "uavs quota battery slots_charging end": [(slots, 2, 0, end)],
        "move time value": [(t, 2) for t in range(slots)],
        "record slots uav_slots success": [slots, slots, end == QUOTA],
        "record collected reward": [collected, reward],
    }
    fields = {"quota": quota, "flying_time": 2, "flight_cost": 0, "max_slots": 6}
    return Case(ADJACENT_NODE | fields, ("EEW",), expected)


def _who_has_ended() -> Case:
    """UAV 0 takes all 5 units in slot 0 and has its quota of 1; UAV 1 wants into its cell.

    In slot 0 UAV 1 is overruled, finds no data and stays; in slot 1 the cell is free.
    UAV 0 is paid for slot 0 only; UAV 1 for the team's data, two steps and one collision.
    """
    expected = {
        "collision time uav": [(0, 1)],
        "move time uav x": [(0, 0, 0), (0, 1, 1), (1, 1, 0)],
        "uavs end reward": [(QUOTA, 106.4), (TRUNCATED, 5.3)],
        "record slots uav_slots": [2, 3],
    }
    fields = ONE_NODE | {"initial_data": 5.0, "max_slots": 2}
    return Case(fields, ("", "WW"), expected, [(0, 0), (1, 0)])


def _collisions() -> Case:
    """UAV 0 is between UAV 1 and UAV 2 in a zone of three cells in the first row of the grid.

    Slot 0: UAV 1 asks for the cell of UAV 0; UAV 2 asks for a cell off the grid.
    Slot 1: both ask for the cell of UAV 0, so that each has two UAVs in its way.
    Slot 2: UAV 0 leaves the cell; the two others are in the way of each other.
    """
    overruled = [
        (0, 1, 0, 1),
        (0, 2, -1, 0),
        (1, 1, 0, 1),
        (1, 2, 0, 3),
        (2, 1, 2, 1),
        (2, 2, 1, 3),
    ]
    fields = PAIR | {"uavs": 3, "zone": [0, 0, 3, 1], "max_slots": 3}
    expected = {"collision time uav other value": overruled}
    return Case(fields, ("..S", "EEE", "NWW"), expected, [(1, 0), (0, 0), (2, 0)])


def _ties(nodes: list[list[int]]) -> Case:
    """Four nodes around a UAV that hovers: the first is emptied first, then the second."""
    fields = {"grid": 3, "zone": [1, 1, 1, 1], "nodes": nodes, "initial_data": 1.0, "quota": 4}
    return Case(HAND | fields | {"max_slots": 4}, ("",), {"communication node": [0, 1, 2, 3]})


CASES = {
    "a node is emptied by flying over it": _emptied(),
    "two nodes are harvested on the way": _two_nodes(),
    "a charge stop": _charge_stop(),
    "UAVs are served in index order": _index_order([(0, 0), (1, 0)], [8, 2]),
    "also where the second one is nearer": _index_order([(1, 0), (0, 0)], [4, 6]),
    "a queue for the only pad": _queue(),
    "pads are first come, first served": _first_come(),
    "a battery is depleted outside a taken cell": _crowding(),
    "the last slot of the battery still communicates": _last_slot(),
    "flying without battery decrease": _no_decrease(4, QUOTA, 4, 28, 1.3 * 28 - 4 * 0.1 + 100),
    "and without an end": _no_decrease(440, TRUNCATED, 6, 44, 1.3 * 44 - 6 * 0.1),
    "a UAV that has ended leaves the map": _who_has_ended(),
    "a collision names the UAV in the way": _collisions(),
    "ties go to the node of lowest index": _ties([[0, 1], [2, 1], [1, 0], [1, 2]]),
    "whatever its place": _ties([[1, 2], [1, 0], [2, 1], [0, 1]]),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_mission_worked_by_hand(case):
    check(case)
