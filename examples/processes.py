"""Processes beside those of a mission: a supply boat, and a logger of the queue for the pads.

dess simulate --scenario bay --process examples/processes.py:moor_boat --events mission.csv
"""

from collections.abc import Iterator

import simpy

from dess.model.mission import BEFORE_ALL_UAVS, Mission

ARRIVAL, STAY = 40.5, 30.0  # when the boat comes, and how long it stays [mission slots]


def moor_boat(mission: Mission) -> Iterator[simpy.Event]:
    """A supply boat takes the next pad that is free of the first zone, and gives it back."""
    yield mission.env.timeout(ARRIVAL)
    with mission.zones[0].request(priority=BEFORE_ALL_UAVS) as pad:
        yield pad
        mission.log("boat_moors")
        yield mission.env.timeout(STAY)
        mission.log("boat_leaves")


def log_queue(mission: Mission) -> Iterator[simpy.Event]:
    """Logs in the middle of every slot how many wait for a pad of the first zone."""
    yield mission.env.timeout(0.5)
    while True:
        mission.log("queue", len(mission.zones[0].queue))
        yield mission.env.timeout(1)
