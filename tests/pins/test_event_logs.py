"""Event logs of missions with contested pads stay the same to the bit, in the order of their rows.

Many UAVs want few pads of two zones. Rows of the same time keep their order too.
"""

from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from dess.model.mission import simulate
from dess.scenario.scenario import ScenarioSpace
from tests.drawn import Commuter, Fidget, Script, Wanderer
from tests.pins.pinned import pinned

# UAVs of unlike batteries soon want one pad here and one there.
CROWDED: dict[str, Any] = {
    **{"grid": 6, "zone": [1, 3, 3, 2], "nodes": [[0, 0], [3, 1], [5, 5], [1, 5]]},
    **{"pads": 1, "zones": [{"cells": [4, 0, 2, 2], "pads": 1}]},
    **{"uavs": [5, 6], "flying_time": [26, 40], "charge_start": [24, 32]},
    **{"fleet": [{"flying_time": 24}, {}, {"flying_time": 31}]},
    **{"charge_complete": [38, 50], "charge_rate": 5, "communication_slots": 3},
    **{"quota": 130, "max_slots": 70, "initial_data": [50, 90], "arrival_rate": 0.05},
}
LANDS = {"landing": True, "quota": 60}
TO_THE_HORIZON = {"landing": True, "quota": 0}
UAVS_FAIL = {"uav_rate": 0.02, "uav_repair": 3.0}
UAVS_ARE_LOST = {"uav_rate": 0.02, "uav_data": "lost"}
PADS_FAIL = {"pad_rate": 0.1, "pad_repair": 4.0}
PADS_FLICKER = {"pad_rate": 0.6, "pad_repair": 1.5}
NODES_FAIL = {"node_rate": 0.05, "node_repair": 4.0}
LOWEST = {"order": "lowest-battery"}
WINDY = {"strength": 1.2, "direction": 70, "gusts": 0.5, "seed": 3}
SLOW_AND_FAST = [{"slots_per_cell": 2}, {"flying_time": 25}, {"flying_time": 30, "rate": 2.0}]
PACKETS = {"process": "continuous", "buffer": 2, "schedule": [[5, 3.0], [20, 0.5]]}

CASES: dict[str, dict[str, Any]] = {
    "first come": {},
    "lowest battery": {"charging": LOWEST},
    "lowest battery, three pads": {"charging": LOWEST, "pads": 2},
    "lowest battery, flying is free": {"charging": LOWEST, "flight_cost": 0},
    "limited power": {"charging": LOWEST | {"power": 6, "measured": True}},
    "landing": LANDS,
    "landing, lowest battery": LANDS | {"charging": LOWEST},
    "landing, pads fail": LANDS | {"charging": LOWEST, "failures": PADS_FAIL},
    "to the horizon": TO_THE_HORIZON | {"failures": UAVS_FAIL | PADS_FAIL | NODES_FAIL},
    "pads fail": {"failures": PADS_FAIL},
    "pads fail, lowest battery": {"charging": LOWEST, "failures": PADS_FAIL},
    "three pads fail": {"charging": LOWEST, "pads": 2, "failures": PADS_FAIL},
    "pads flicker": {"failures": PADS_FLICKER},
    "pads flicker, lowest battery": {"charging": LOWEST, "failures": PADS_FLICKER},
    "pads fail for good": {"failures": {"pad_rate": 0.03}},
    "UAVs are lost": {"failures": UAVS_ARE_LOST},
    "all fail": {"charging": LOWEST, "failures": UAVS_FAIL | PADS_FAIL | NODES_FAIL},
    "all fail in the wind": {
        **{"wind": WINDY, "fleet": SLOW_AND_FAST, "charging": LOWEST},
        "failures": UAVS_FAIL | PADS_FAIL | NODES_FAIL | {"node_data": "lost"},
    },
    "packets": {"arrivals": PACKETS, "charging": LOWEST},
    "packets, all fail": {
        "arrivals": PACKETS,
        "failures": UAVS_ARE_LOST | PADS_FAIL | NODES_FAIL | {"node_data": "lost"},
    },
    "packets, landing": LANDS | {"arrivals": PACKETS | {"service": "newest"}},
}


# The last hovers in the zone from the start.
POLICIES = [Wanderer(), Commuter(), Fidget(), Script(*[""] * 6)]

# Those that make for the pads, and leave queues; the others are left to the longer proofs.
QUICK = ("commuter", "fidget")
LONG = [pytest.mark.slow, pytest.mark.brief]


def _digest(columns: dict[str, np.ndarray]) -> str:
    """A hash of a table, whose words are hashed as text."""
    digest = sha256()
    for name, column in columns.items():
        is_text = column.dtype == object
        digest.update(name.encode())
        digest.update("\n".join(column).encode() if is_text else column.tobytes())
    return digest.hexdigest()[:16]


@pytest.mark.parametrize(
    "policy",
    [pytest.param(p, marks=[] if p.name in QUICK else LONG) for p in POLICIES],
    ids=lambda policy: policy.name,
)
def test_the_event_logs_of_contested_pads_are_the_kept_ones(policy):
    lines = []
    for name, changes in CASES.items():
        space = ScenarioSpace.of(**CROWDED | changes)
        for replication in range(4):
            events = simulate(space, policy, 2031, replication, events=True).events
            assert events is not None
            rows = len(events)
            lines.append(f"{name}, {replication}: {rows} rows, {_digest(events.columns())}\n")
    pinned(f"logs/{policy.name}.txt", "".join(lines))
