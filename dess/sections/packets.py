"""The packets of one mission: when they arrive, and what becomes of them.

``Packets`` keeps the buffers of the nodes in step with the residual data, which the rules and the
policies see.
"""

import math
from typing import Any

import numpy as np

from dess.code.kernels import kernel
from dess.sections.arrivals import draw_arrival, factors_of, sources_of
from dess.sections.buffers import (
    DELIVERED,
    GENERATED,
    Buffers,
    lose_packets,
    serve_packets,
    store_packet,
)


class Packets:
    """The packets of one mission; the initial data of a node are a packet generated at time 0.

    Attributes:
        buffers: The buffers of the nodes.
    """

    def __init__(self, scenario: Any, state: Any):
        """Begin a mission.

        Args:
            scenario: The ``ScenarioSpace``.
            state: The ``State`` of one mission that has been launched.
        """
        self._missions, self._uavs, self._residual, self._sensors = state[:4]
        arrivals, nodes = scenario.arrivals, len(scenario.nodes)
        self._measures_age = scenario.age.measured
        self._sources = sources_of(arrivals, scenario.arrival_rate, nodes)
        self._factors = factors_of(arrivals)
        self.buffers = Buffers(nodes, arrivals.buffer, arrivals.service == "newest")
        for k in range(nodes):
            if self._residual[0, k] > 0.0:
                self.buffers.store(k, 0.0, self._residual[0, k])
            draw_arrival(self._missions, self._sources, *self._factors, k)

    def next(self) -> tuple[float, int]:
        """The time of the next arrival [slots], infinite if there is none, and its node."""
        k = int(self._sources["time"].argmin())
        return float(self._sources["time"][k]), k

    def arrive(self, k: int) -> int:
        """Let the next packet of node ``k`` arrive; return the number of the packet lost, or -1."""
        b = self.buffers
        b.make_room()
        lost = _arrive(
            self._missions, self._residual, self._sensors, self._sources,
            b.records, b.queues, b.counts, b.limit, b.newest_first, k,
        )  # fmt: skip
        draw_arrival(self._missions, self._sources, *self._factors, k)
        return lost

    def deliver(self, time: float) -> list[int]:
        """Take what the UAVs have collected at this time; return the packets delivered."""
        b, before = self.buffers, self.buffers.counts[DELIVERED]
        _deliver(
            self._missions, self._uavs, self._residual, self._sensors,
            b.records, b.queues, b.order, b.counts, b.newest_first, time,
        )  # fmt: skip
        return list(b.delivered[before:])

    def fall_silent(self, time: float) -> list[int]:
        """Lose the packets of nodes that have just lost their data; return their numbers."""
        mission = self._missions[0]
        if not mission["node_data_lost"]:
            return []
        silent = np.nonzero(self._sensors["silent"][0])[0].tolist()
        return [number for k in silent for number in self.buffers.lose(k, time)]

    def write(self, out: np.void) -> None:
        """Write what was measured in the mission into an ``OPERATIONS`` record."""
        mission = self._missions[0]
        out["lost"] = mission["lost"]
        self.buffers.write(out, float(mission["slot"]), self._measures_age)


@kernel
def _arrive(
    missions, residual, sensors, sources, packets, queues, counts, limit, newest_first, k
):  # fmt: skip
    """Put a packet of one data unit into a buffer; return the number of the packet lost, or -1.

    The data of a silent node are hidden from the UAVs, or lost (``dess.sections.failures``).
    """
    mission, sensor, time = missions[0], sensors[0, k], sources[k].time
    number = counts[GENERATED]
    mission.arrived += 1.0
    lost = store_packet(packets, queues, counts, limit, newest_first, k, time, 1.0)
    if sensor.silent and mission.node_data_lost != 0:
        lose_packets(packets, queues, counts, k, time)
        mission.lost += 1.0
        return number
    gained = 1.0
    if lost >= 0:
        mission.lost += packets[lost].remaining
        gained -= packets[lost].remaining
    if sensor.silent:
        sensor.hidden += gained
    else:
        residual[0, k] += gained
    return lost


@kernel
def _deliver(
    missions, uavs, residual, sensors, packets, queues, order, counts, newest_first, time
):  # fmt: skip
    """Serve the nodes of all UAVs, in index order, and note the newest data of each node."""
    mission, team, data, nodes = missions[0], uavs[0], residual[0], sensors[0]
    before = counts[DELIVERED]
    for i in range(mission.uavs):
        k = team[i].served
        if k >= 0:
            serve_packets(packets, queues, order, counts, newest_first, k, time, team[i].amount, i)
    for i in range(mission.uavs):  # rounding: a node without packets has no data, and vice versa
        k = team[i].served
        if k >= 0 and queues[k].count == 0:
            data[k] = 0.0
        elif k >= 0 and data[k] == 0.0:
            serve_packets(packets, queues, order, counts, newest_first, k, time, math.inf, i)
    for position in range(before, counts[DELIVERED]):
        p = packets[order[position]]
        if p.generated > nodes[p.node].newest:
            mission.newest += p.generated - nodes[p.node].newest
            nodes[p.node].newest = p.generated
