"""Charging pads: queues and shared power worked by hand."""

from typing import Any

import pytest

from dess.scenario import Scenario
from tests.dess.flights import batteries, flown

# Three UAVs hover in a zone of three cells, far from the only node; all may charge at once.
THREE: dict[str, Any] = {
    **{"grid": 4, "zone": [0, 1, 3, 1], "uavs": 3, "nodes": [[3, 3]], "initial_data": 1000.0},
    **{"charge_start": 11, "charge_complete": 20, "charge_rate": 5, "pads": 1, "max_slots": 7},
    "fleet": [{"flying_time": 11}, {"flying_time": 10}, {"flying_time": 9}],
}
EQUAL = [{"flying_time": 10}, {"flying_time": 10}, {"flying_time": 9}]
# Fields of the scenario, the route of UAV 0, batteries of the UAVs, waiting slots, requests.
QUEUES: dict[str, tuple[dict[str, Any], str, list[list[int]], list[int], int]] = {
    "all ask in slot 0, so the index decides": (
        {"charging": {"measured": True}},
        "",
        [[16, 20, 19, 18, 17, 16, 15], [9, 8, 13, 18, 20, 19, 18], [8, 7, 6, 5, 4, 9, 14]],
        [0, 2, 5],
        3,
    ),
    "UAV 0 leaves the queue and asks again: the earlier request of UAV 1 comes first": (
        {"charging": {"order": "lowest-battery"}, "fleet": EQUAL},
        ".NS....",
        [[9, 8, 7, 6, 5, 4, 9], [9, 8, 7, 12, 17, 20, 19], [14, 19, 20, 19, 18, 17, 16]],
        [4, 3, 0],
        4,
    ),
    "three pads share 7 % per slot: each takes what it lacks of what is left, up to 5 %": (
        {"charging": {"power": 7}, "pads": 3, "max_slots": 5},
        "",
        [[16, 20, 19, 18, 17], [12, 15, 20, 19, 18], [9, 9, 11, 16, 20]],
        [0, 0, 0],
        3,
    ),
}


@pytest.mark.parametrize("case", QUEUES)
def test_a_queue_by_hand(case: str) -> None:
    fields, route, levels, waits, requests = QUEUES[case]
    scenario = Scenario.of(**THREE | fields)
    record, log = flown(scenario, route, "", "")
    assert [batteries(log, i) for i in range(3)] == levels
    assert record.uavs["slots_waiting"].tolist() == waits
    assert record.queue == sum(waits) / record.slots
    assert record.waiting == sum(waits) / requests
    assert record.pad_requests == requests
    charged = record.uavs["slots_charging"].sum()
    assert record.utilisation == charged / (scenario.charging_pads * record.slots)
