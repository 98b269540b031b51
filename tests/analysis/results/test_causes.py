"""What ended a mission is said of missions worked by hand, one for each cause."""

from typing import Any, NamedTuple

import pytest

from analysis.results.causes import causes
from dess.scenario import Scenario
from tests.dess.flights import CHANNEL, flown

# A zone of two cells at the western edge, with a pad. UAVs may charge from a battery of 12 on. Each
# slot is a communication slot, and there are data for all.
FIELDS: dict[str, Any] = CHANNEL | {
    **{"grid": 8, "zone": [0, 0, 1, 2], "pads": 1, "nodes": [[7, 7]], "initial_data": 1000.0},
    **{"flying_time": 14, "charge_start": 12, "charge_complete": 100, "charge_rate": 1},
    "quota": 100,
}
BOTH = [(0, 0), (0, 1)]


class Case(NamedTuple):
    """What UAVs do, where they start, which fields differ, and what is said."""

    routes: tuple[str, ...]
    starts: list[tuple[int, int]]
    fields: dict[str, Any]
    said: list[str]


CASES = {
    "the quota is filled": Case(("",), [(0, 0)], {"quota": 3}, []),
    # After 7 slots it is 7 cells away with a battery of 7, which lasts for a slot too few.
    "it goes too far": Case(
        ("EEEEEEE",),
        [(0, 0)],
        {},
        [
            "UAV 1 ran empty after 14 slots at (7, 0), 7 cells from the nearest zone, with 86 of "
            "100 communication slots to go; its battery last covered the way to a zone after 6 "
            "slots, with 8 % for 6 cells"
        ],
    ),
    # Back home with 11, it charges in slots 2 to 10, up to 20. A move to the east costs 2: after 17
    # slots it is 6 cells away with 8, then 7 with 6. The wind has cost 1 % for each of 7 moves;
    # what it cost before the charge does not count.
    "it goes too far against the wind": Case(
        ("EW" + 9 * "." + "EEEEEEE",),
        [(0, 0)],
        {"wind": {"strength": 1.0, "direction": 90}, "charge_complete": 20, "charge_start": 11},
        [
            "UAV 1 ran empty after 24 slots at (7, 0), 7 cells from the nearest zone, with 85 of "
            "100 communication slots to go; its battery last covered the way to a zone after 17 "
            "slots, with 8 % for 6 cells; the wind cost 7 %"
        ],
    ),
    # Both ask in slot 2, and UAV 1 charges for 88 slots.
    "it waits for a pad": Case(
        ("", ""),
        BOTH,
        {"quota": 20},
        [
            "UAV 2 ran empty after 14 slots at (0, 1), in a zone, with 6 of 20 communication slots "
            "to go; it waited 12 slots for a pad of the zone at (0, 0), which has 1, while UAV 1 "
            "charged there"
        ],
    ),
    # UAV 1 wants to go home through the cell where UAV 2 charges, from slot 4 on.
    "a teammate is in its way": Case(
        ("EESW" + 10 * "W", ""),
        BOTH,
        {"fleet": [{}, {"quota": 13}], "charge_start": 10},
        [
            "UAV 1 ran empty after 14 slots at (1, 1), 1 cell from the nearest zone, with 86 of "
            "100 communication slots to go; its battery last covered the way to a zone after 12 "
            "slots, with 2 % for 1 cell; it was overruled 10 times, by UAV 2"
        ],
    ),
    # It charges from slot 2 on.
    "the horizon": Case(
        ("",),
        [(0, 0)],
        {"max_slots": 12},
        [
            "UAV 1 was still active at the horizon of 12 slots, with 98 of 100 communication "
            "slots to go"
        ],
    ),
    "a failure": Case(
        ("EEE",),
        [(0, 0)],
        {"failures": {"uav_rate": 0.1}},
        [
            "UAV 1 was lost to a failure after 5 slots at (3, 0), with 95 of 100 communication "
            "slots to go"
        ],
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_what_ended_a_mission_is_said(case: Case) -> None:
    scenario = Scenario.of(**FIELDS | {"uavs": len(case.routes)} | case.fields)
    record, log = flown(scenario, *case.routes, starts=case.starts)
    assert causes(log, scenario) == case.said
