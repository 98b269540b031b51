"""The packets of one mission: when they arrive, and what becomes of them.

``Packets`` keeps the buffers of the nodes in step with the residual data, which the rules and the
policies see.
"""

import math
from typing import Any

import numpy as np

from dess.code.kernels import kernel
from dess.record import EventLog
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

    def __init__(self, scenario: Any, state: Any, log: EventLog | None):
        """Begin a mission.

        Args:
            scenario: The ``ScenarioSpace``.
            state: The ``State`` of one mission that has been launched.
            log: Its event log.
        """
        self._log, self._nodes, self._logged = log, scenario.nodes, 0
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

    def oldest(self, k: int) -> int:
        """The number of the oldest packet in the buffer of a node, or -1 if it is empty."""
        return int(self.buffers.queues["oldest"][k])

    def next(self) -> tuple[float, int]:
        """The time of the next arrival [slots], infinite if there is none, and its node."""
        k = int(self._sources["time"].argmin())
        return float(self._sources["time"][k]), k

    def arrive(self, k: int) -> None:
        """Let the next packet of node ``k`` arrive."""
        b = self.buffers
        b.make_room()
        lost = _arrive(
            self._missions, self._residual, self._sensors, self._sources,
            b.records, b.queues, b.counts, b.limit, b.newest_first, k,
        )  # fmt: skip
        draw_arrival(self._missions, self._sources, *self._factors, k)
        self._log_events("arrival", [len(b.packets) - 1])
        self._log_events("loss", [lost] if lost >= 0 else [])

    def log_deliveries(self) -> None:
        """Log the packets that have been delivered since the last call."""
        if self._log is not None:
            self._log_events("delivery", self.buffers.delivered[self._logged :].tolist())
            self._logged = len(self.buffers.delivered)

    def fall_silent(self, time: float) -> None:
        """Lose the packets of silent nodes, if the data of a silent node are lost."""
        if self._missions[0]["node_data_lost"]:
            for k in np.nonzero(self._sensors["silent"][0])[0].tolist():
                self._log_events("loss", self.buffers.lose(k, time).tolist())

    def _log_events(self, event: str, numbers: list[int]) -> None:
        """Log the arrival, the delivery or the loss of packets."""
        if self._log is None:
            return
        for number in numbers:
            p = self.buffers.packets[number]
            born, left = float(p["generated"]), float(p["left"])
            time = born if event == "arrival" else left
            value = {"arrival": 1.0, "delivery": left - born, "loss": p["remaining"]}[event]
            x, y = self._nodes[p["node"]]
            i = int(p["uav"])
            battery = self._uavs[0, i]["battery"] if i >= 0 else -1
            self._log.add(
                time, event, i, p["node"], value, x, y, battery, packet=number, generated=born
            )

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
def deliver(
    missions, uavs, residual, sensors, n, packets, queues, order, counts, newest_first
):  # fmt: skip
    """Take what the UAVs collected in communication slot ``n`` from the packets, in index order.

    The last five arguments are ``Buffers.arrays``.
    """
    mission, team, data, nodes = missions[0], uavs[0], residual[0], sensors[0]
    time, before = mission.slot + n / mission.communication_slots, counts[DELIVERED]
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
