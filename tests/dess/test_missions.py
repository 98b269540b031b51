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

from dess.scenario import Scenario
from tests.dess.flights import CHANNEL, batteries, flown, rows_of

HAND = CHANNEL | {"charge_start": 11, "charge_complete": 25, "uavs": 1, "zone": [0, 0, 1, 1]}

# Two UAVs that start in a zone of two cells, far from a node that is never emptied.
PAIR = HAND | {"uavs": 2, "zone": [0, 0, 2, 1], "nodes": [[3, 3]], "initial_data": 1000.0}


def _bits(k: float) -> float:
    """Data units that a whole slot carries over k [cells^2]."""
    return math.log2(1 + 255 / (1 + 16 * k))


def test_a_node_is_emptied_by_flying_over_it() -> None:
    """One node at (1, 0) with 19.5 units, one UAV from (0, 0): east, east, west, then it hovers.

    Slot 0 ends above the node: 8 units. Slot 1 one cell beyond: 4. Slot 2 back above it: R = 8, but
    19.5 - 12 = 7.5 are left. Slots 3 and 4: no node with data, so no communication. Three of four
    for the quota, and the battery of 5 is empty after slot 4.
    Reward: 1.3 * 19.5 - 5 * 0.1 - 300 = -275.15.
    """
    scenario = Scenario.of(
        **HAND | {"nodes": [[1, 0]], "initial_data": 19.5, "quota": 4, "flying_time": 5}
    )
    record, log = flown(scenario, "EEW")
    served = rows_of(log, "communication", "time", "uav", "node", "x", "y")
    assert served == [(1.0, 0, 0, 1.0, 0.0), (2.0, 0, 0, 2.0, 0.0), (3.0, 0, 0, 1.0, 0.0)]
    amounts = rows_of(log, "communication", "value")
    assert amounts == pytest.approx([8, 4, 7.5], abs=1e-9)
    assert (record.slots, record.success, record.residual) == (5, 0, 0.0)
    assert record.collected == pytest.approx(19.5, abs=1e-9)
    assert record.collection_ratio == pytest.approx(1.0, abs=1e-12)
    assert record.collection_ratio_and_communication == 0.0
    assert record.reward == pytest.approx(-275.15, abs=1e-9)
    assert record.uav_rows() == [{"quota": 3, "battery": 0, "slots_charging": 0, "end": "battery"}]
    assert rows_of(log, "battery_empty", "time", "uav", "value") == [(5.0, 0, 0.0)]


def test_two_nodes_are_harvested_on_the_way() -> None:
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
    scenario = Scenario.of(
        **HAND
        | {
            "communication_slots": 2,
            "nodes": [[1, 0], [3, 0]],
            "initial_data": 6.0,
            "quota": 5,
            "flying_time": 20,
        }
    )
    record, log = flown(scenario, "EEE")
    served = rows_of(log, "communication", "time", "node", "x")
    assert served == [(0.5, 0, 0.5), (1.0, 0, 1.0), (1.5, 1, 1.5), (2.0, 1, 2.0), (2.5, 1, 2.5)]
    amounts = rows_of(log, "communication", "value")
    assert amounts == pytest.approx([2.85022, 3.14978, 1.49019, 2.0, 2.50981], abs=5e-6)
    first, second = math.log2(52) / 2, math.log2(292 / 37) / 2
    exact = [first, 6 - first, second, 2, 4 - second]
    assert amounts == pytest.approx(exact, abs=1e-9)
    assert (record.slots, record.success) == (3, 1)
    assert record.collection_ratio_and_communication == pytest.approx(1.0, abs=1e-12)
    assert record.reward == pytest.approx(115.3, abs=1e-9)
    assert record.uav_rows() == [{"quota": 5, "battery": 17, "slots_charging": 0, "end": "quota"}]
    assert rows_of(log, "quota_filled", "time", "value") == [(3.0, 5.0)]


def test_a_charge_stop() -> None:
    """One UAV hovers in its zone of one cell next to a full node: 4 units per communication.

    C_S = 11, C_C = 25, b(0) = 12. Slot 0: 12 > C_S, it flies: b = 11, first communication.
    Slot 1: 11 <= C_S, it charges: 21. Slot 2: min(31, 25) = 25, full. Slots 3..6: it flies and
    communicates again, for the quota of 5 in slot 6: b = 25 - 4 = 21, collected 5 * 4 = 20.
    Reward: 1.3 * 20 - 7 * 0.1 + 2 * 0.05 + 100 = 125.4.
    """
    scenario = Scenario.of(
        **HAND | {"nodes": [[1, 0]], "initial_data": 50.0, "quota": 5, "flying_time": 12}
    )
    record, log = flown(scenario, "")
    assert rows_of(log, "move", "time", "value") == [
        (0.0, 11.0),
        (1.0, 21.0),
        (2.0, 25.0),
        (3.0, 24.0),
        (4.0, 23.0),
        (5.0, 22.0),
        (6.0, 21.0),
    ]
    assert rows_of(log, "communication", "time") == [1.0, 4.0, 5.0, 6.0, 7.0]
    assert rows_of(log, "charge_request", "time", "value") == [(1.0, 11.0)]
    assert rows_of(log, "charge_start", "time", "value") == [(1.0, 11.0)]
    assert rows_of(log, "charge_end", "time", "value") == [(3.0, 25.0)]
    assert (record.slots, record.success, record.uav_slots) == (7, 1, 7)
    assert record.collected == pytest.approx(20.0, abs=1e-9)
    assert record.collection_ratio == pytest.approx(20 / 50, abs=1e-12)
    assert record.reward == pytest.approx(125.4, abs=1e-9)
    row = record.uavs[0]
    assert (row["slots_flying"], row["slots_charging"], row["slots_waiting"]) == (5, 2, 0)


@pytest.mark.parametrize(
    ("starts", "amounts"),
    # UAV 0 above the node takes 8 of 10, UAV 1 the 2 that are left although R = 4;
    # UAV 0 beside it takes 4, UAV 1 above it the 6 that are left although R = 8.
    [([(0, 0), (1, 0)], [8, 2]), ([(1, 0), (0, 0)], [4, 6])],
)
def test_uavs_are_served_in_index_order(starts: list, amounts: list[float]) -> None:
    scenario = Scenario.of(
        **PAIR | {"nodes": [[0, 0]], "initial_data": 10.0, "flying_time": 20, "quota": 1}
    )
    record, log = flown(scenario, "", "", starts=starts)
    assert rows_of(log, "communication", "uav", "node") == [(0, 0), (1, 0)]
    assert record.uavs["collected"].tolist() == pytest.approx(amounts, abs=1e-9)
    # Each UAV is paid for the data of the whole team: 1.3 * 10 - 0.1 + 100.
    assert record.uavs["reward"].tolist() == pytest.approx([112.9, 112.9], abs=1e-9)
    assert (record.slots, record.success, record.residual) == (1, 1, 0.0)


def test_a_queue_for_the_only_pad() -> None:
    """Two UAVs hover in a zone of two cells with one pad; C_S = 11, C_C = 30, b(0) = 12.

    slot      0   1   2   3   4   5   6
    UAV 0    11  21  30  29  28  27  26    charges in slots 1 and 2 (31 is cut to 30)
    UAV 1    11  10   9  19  29  30  29    waits in 1 and 2, charges in 3, 4 and 5
    While it waits it flies: it pays 1 and communicates. Communications: UAV 0 in 0, 3, 4, 5, 6;
    UAV 1 in 0, 1, 2, 6.
    """
    scenario = Scenario.of(
        **PAIR | {"pads": 1, "flying_time": 12, "charge_complete": 30, "max_slots": 7}
    )
    record, log = flown(scenario, "", "")
    assert batteries(log, 0) == [11, 21, 30, 29, 28, 27, 26]
    assert batteries(log, 1) == [11, 10, 9, 19, 29, 30, 29]
    assert rows_of(log, "charge_request", "time", "uav") == [(1.0, 0), (1.0, 1)]
    assert rows_of(log, "charge_start", "time", "uav") == [(1.0, 0), (3.0, 1)]
    assert rows_of(log, "charge_end", "time", "uav") == [(3.0, 0), (6.0, 1)]
    served = rows_of(log, "communication", "uav", "time")
    assert [t for i, t in served if i == 0] == [1, 4, 5, 6, 7]
    assert [t for i, t in served if i == 1] == [1, 2, 3, 7]
    rows = record.uavs
    assert rows["slots_waiting"].tolist() == [0, 2]
    assert rows["slots_charging"].tolist() == [2, 3]
    assert rows["slots_flying"].tolist() == [5, 4]
    assert [row["end"] for row in record.uav_rows()] == ["truncated", "truncated"]
    assert record.success == 0


def test_pads_are_first_come_first_served() -> None:
    """UAV 0 is away in slots 0 and 1 and asks last; one pad; C_S = 11, C_C = 21, b(0) = 12.

    slot      0   1   2   3   4   5
    UAV 0    11  10   9   8  18  21    asks in slot 2, waits in 2 and 3, charges in 4 and 5
    UAV 1    11  21  20  19  18  17    asks in slot 1, charges at once
    UAV 2    11  10  20  21  20  19    asks in slot 1, waits in 1, charges in 2 and 3
    """
    scenario = Scenario.of(
        **PAIR | {"uavs": 3, "zone": [0, 1, 3, 1], "pads": 1, "charge_complete": 21},
        flying_time=12,
        max_slots=6,
    )
    record, log = flown(scenario, "NS", "", "")
    assert batteries(log, 0) == [11, 10, 9, 8, 18, 21]
    assert batteries(log, 1) == [11, 21, 20, 19, 18, 17]
    assert batteries(log, 2) == [11, 10, 20, 21, 20, 19]
    assert rows_of(log, "charge_start", "time", "uav") == [(1.0, 1), (2.0, 2), (4.0, 0)]
    assert record.uavs["slots_waiting"].tolist() == [2, 0, 1]


@pytest.mark.parametrize("stuck", [0, 1])
def test_the_battery_of_a_uav_is_depleted_outside_a_taken_cell(stuck: int) -> None:
    """Crowding: one UAV charges slowly on (1, 0), the other tries to enter from (1, 1) until its
    battery is depleted.

    b(0) = 13, C_S = 10, C_C = 100, 1 % per charging slot, the mission is cut after 20 slots.
    The one at home: 12, 11, 10, then it charges in slots 3..19: 10 + 17 = 27.
    The other: south to (0, 1), east to (1, 1), then it asks for north in slots 2..12, is overruled
    11 times, and its battery is empty after slot 12, outside the zone.
    Node at (3, 3). From (1, 0) and (0, 1) it is k = 13: log2(1 + 255/209) = 1.15063 units a slot,
    from (1, 1) k = 8: log2(1 + 255/129) = 1.57373. The team collects, until then,
    3 * 1.15063 + 1.15063 + 12 * 1.57373 = 23.48728, and nothing after.
    Reward of the other: 1.3 * 23.48728 - 13 * 0.1 - 11 * 1 - 300 = -281.7665;
    of the one at home: 1.3 * 23.48728 - 20 * 0.1 + 17 * 0.05 = 29.3835.
    """
    scenario = Scenario.of(
        **PAIR | {"charge_start": 10, "charge_complete": 100, "charge_rate": 1},
        flying_time=13,
        max_slots=20,
    )
    at_home = 1 - stuck
    routes, starts = ["", ""], [(1.0, 0.0), (1.0, 0.0)]
    routes[stuck], starts[stuck] = "SE" + "N" * 18, (0.0, 0.0)
    record, log = flown(scenario, *routes, starts=starts)
    rows = record.uav_rows()
    assert rows[stuck] == {"quota": 13, "battery": 0, "slots_charging": 0, "end": "battery"}
    assert rows[at_home] == {"quota": 3, "battery": 27, "slots_charging": 17, "end": "truncated"}
    collisions = rows_of(log, "collision", "time", "uav", "x", "y")
    assert collisions == [(float(t), stuck, 1.0, 1.0) for t in range(2, 13)]
    assert rows_of(log, "battery_empty", "time", "uav") == [(13.0, stuck)]
    assert record.collected == pytest.approx(4 * _bits(13) + 12 * _bits(8), abs=1e-9)
    assert record.uavs["reward"][stuck] == pytest.approx(-281.7665, abs=5e-5)
    assert record.uavs["reward"][at_home] == pytest.approx(29.3835, abs=5e-5)
    assert (record.slots, record.uav_slots, record.success) == (20, 33, 0)
    assert record.collection_ratio == pytest.approx(record.collected / 1000, abs=1e-12)


def test_the_last_slot_of_the_battery_still_communicates() -> None:
    """b(0) = 2, quota 2: the second communication comes as the battery runs out; it counts."""
    scenario = Scenario.of(
        **HAND | {"nodes": [[1, 0]], "initial_data": 50.0, "quota": 2, "flying_time": 2}
    )
    record, _ = flown(scenario, "EE")
    assert record.uav_rows() == [{"quota": 2, "battery": 0, "slots_charging": 0, "end": "quota"}]
    assert (record.success, record.slots) == (1, 2)
    assert record.reward == pytest.approx(1.3 * 12 - 0.2 + 100, abs=1e-9)


@pytest.mark.parametrize(
    ("quota", "end", "slots", "collected", "reward"),
    [
        (4, "quota", 4, 28, 136.0),  # 1.3 * 28 - 4 * 0.1 + 100
        (440, "truncated", 6, 44, 56.6),  # 1.3 * 44 - 6 * 0.1
    ],
)
def test_flying_without_battery_decrease(
    quota: int, end: str, slots: int, collected: float, reward: float
) -> None:
    """b(0) = 2 lasts for ever: the mission ends by its quota, or is cut after 6 slots.

    Node at (1, 0). East 8 units, east 4, west 8, and 8 in each slot that it hovers there.
    """
    scenario = Scenario.of(
        **HAND | {"nodes": [[1, 0]], "initial_data": 50.0, "quota": quota, "flying_time": 2},
        flight_cost=0,
        max_slots=6,
    )
    record, log = flown(scenario, "EEW")
    assert record.uav_rows() == [{"quota": slots, "battery": 2, "slots_charging": 0, "end": end}]
    assert rows_of(log, "move", "time", "value") == [(float(t), 2.0) for t in range(slots)]
    assert (record.slots, record.uav_slots, record.success) == (slots, slots, end == "quota")
    assert record.collected == pytest.approx(collected, abs=1e-9)
    assert record.reward == pytest.approx(reward, abs=1e-9)


def test_a_uav_that_has_ended_leaves_the_map() -> None:
    """UAV 0 takes all 5 units in slot 0 and has its quota of 1; UAV 1 wants into its cell.

    In slot 0 UAV 1 is overruled, finds no data and stays; in slot 1 the cell is free.
    """
    scenario = Scenario.of(
        **PAIR | {"nodes": [[0, 0]], "initial_data": 5.0, "quota": 1},
        flying_time=20,
        max_slots=2,
    )
    record, log = flown(scenario, "", "WW", starts=[(0, 0), (1, 0)])
    assert [row["end"] for row in record.uav_rows()] == ["quota", "truncated"]
    assert rows_of(log, "collision", "time", "uav") == [(0.0, 1)]
    moves = [(0.0, 0, 0.0), (0.0, 1, 1.0), (1.0, 1, 0.0)]
    assert rows_of(log, "move", "time", "uav", "x") == moves
    # UAV 0 is paid for slot 0 only; UAV 1 for the team's data, two steps and one collision.
    assert record.uavs["reward"].tolist() == pytest.approx([106.4, 5.3], abs=1e-9)
    assert (record.slots, record.uav_slots) == (2, 3)


def test_a_collision_names_the_uav_in_the_way() -> None:
    """UAV 0 is between UAV 1 and UAV 2 in a zone of three cells in the first row of the grid.

    Slot 0: UAV 1 asks for the cell of UAV 0; UAV 2 asks for a cell off the grid.
    Slot 1: both ask for the cell of UAV 0, so that each has two UAVs in its way.
    Slot 2: UAV 0 leaves the cell; the two others are in the way of each other.
    """
    scenario = Scenario.of(**PAIR | {"uavs": 3, "zone": [0, 0, 3, 1]}, max_slots=3)
    starts = [(1, 0), (0, 0), (2, 0)]
    _, log = flown(scenario, "..S", "EEE", "NWW", starts=starts)
    assert rows_of(log, "collision", "time", "uav", "other", "value") == [
        (0.0, 1, 0, 1.0),
        (0.0, 2, -1, 0.0),
        (1.0, 1, 0, 1.0),
        (1.0, 2, 0, 3.0),
        (2.0, 1, 2, 1.0),
        (2.0, 2, 1, 3.0),
    ]


def test_ties_go_to_the_node_of_lowest_index() -> None:
    """Four nodes around a UAV that hovers: the first is emptied first, then the second."""
    for nodes in ([[0, 1], [2, 1], [1, 0], [1, 2]], [[1, 2], [1, 0], [2, 1], [0, 1]]):
        values = {"grid": 3, "zone": [1, 1, 1, 1], "nodes": nodes, "initial_data": 1.0}
        _, log = flown(Scenario.of(**HAND | values | {"quota": 4}, max_slots=4), "")
        assert rows_of(log, "communication", "node") == [0, 1, 2, 3]
