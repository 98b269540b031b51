"""The packets of one mission: when they arrive, and what becomes of them.

``Packets`` keeps the buffers of the nodes in step with the residual data, which the rules and the
policies see.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from dess.record import EventLog
from dess.sections.arrivals import draw_arrival, factors_of, sources_of
from dess.sections.buffers import Buffers


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
        self._log, self._nodes, self._missions = log, scenario.nodes, state.missions
        self._mission, self._uavs = state.missions[0], state.uavs[0]
        self._residual, self._sensors = state.residual[0], state.sensors[0]
        arrivals, nodes = scenario.arrivals, len(scenario.nodes)
        self._measures_age = scenario.age.measured
        self._sources = sources_of(arrivals, scenario.arrival_rate, nodes)
        self._factors = factors_of(arrivals)
        self.buffers = Buffers(nodes, arrivals.buffer, arrivals.service == "newest")
        for k in range(nodes):
            if self._residual[k] > 0.0:
                self.buffers.store(k, 0.0, float(self._residual[k]))
            draw_arrival(self._missions, self._sources, *self._factors, k)

    def next(self) -> tuple[float, int]:
        """The time of the next arrival [slots], infinite if there is none, and its node."""
        k = int(self._sources["time"].argmin())
        return float(self._sources["time"][k]), k

    def arrive(self, k: int) -> None:
        """Let the next packet of node ``k`` arrive.

        The data of a silent node are hidden from the UAVs, or lost (``dess.sections.failures``).
        """
        mission, sensor, b = self._mission, self._sensors[k], self.buffers
        time, is_silent = float(self._sources["time"][k]), sensor["silent"]
        mission["arrived"] += 1.0
        lost = b.store(k, time, 1.0)
        gained = 1.0 if lost < 0 else 1.0 - b.all[lost].remaining
        if is_silent and mission["node_data_lost"]:
            lost, gained = len(b.all) - 1, 0.0
            b.lose(k, time)
            mission["lost"] += 1.0
        elif lost >= 0:
            mission["lost"] += b.all[lost].remaining
        if is_silent:
            sensor["hidden"] += gained
        else:
            self._residual[k] += gained
        draw_arrival(self._missions, self._sources, *self._factors, k)
        self._log_events("arrival", [len(b.all) - 1])
        self._log_events("loss", [lost] if lost >= 0 else [])

    def deliver(self, time: float) -> None:
        """Take what the UAVs collected at a time from the packets, in the order of the UAVs."""
        b, before = self.buffers, len(self.buffers.delivered)
        outcomes = enumerate(self._uavs[["served", "amount"]].tolist())
        served = [(i, k, amount) for i, (k, amount) in outcomes if k >= 0]
        for i, k, amount in served:
            b.serve(k, time, amount, i)
        for i, k, _ in served:  # rounding: no packets means no data, and vice versa
            if not b.queues[k]:
                self._residual[k] = 0.0
            elif self._residual[k] == 0.0:
                b.serve(k, time, math.inf, i)
        for number in b.delivered[before:]:
            sensor, generated = self._sensors[b.all[number].node], b.all[number].generated
            if generated > sensor["newest"]:
                self._mission["newest"] += generated - sensor["newest"]
                sensor["newest"] = generated
        self._log_events("delivery", b.delivered[before:])

    def fall_silent(self, time: float) -> None:
        """Lose the packets of silent nodes, if the data of a silent node are lost."""
        if self._mission["node_data_lost"]:
            for k in np.nonzero(self._sensors["silent"])[0].tolist():
                self._log_events("loss", self.buffers.lose(k, time))

    def _log_events(self, event: str, numbers: Iterable[int]) -> None:
        """Log the arrival, the delivery or the loss of packets."""
        if self._log is None:
            return
        for number in numbers:
            p = self.buffers.all[number]
            time = p.generated if event == "arrival" else p.left
            value = {"arrival": 1.0, "delivery": p.left - p.generated, "loss": p.remaining}[event]
            x, y = self._nodes[p.node]
            battery = self._uavs[p.uav]["battery"] if p.uav >= 0 else -1
            self._log.add(
                time, event, p.uav, p.node, value, x, y, battery,
                packet=number, generated=p.generated,
            )  # fmt: skip

    def write(self, out: np.void) -> None:
        """Write what was measured in the mission into an ``OPERATIONS`` record."""
        out["lost"] = self._mission["lost"]
        self.buffers.write(out, float(self._mission["slot"]), self._measures_age)
