"""The packets of one mission: when they arrive, and what becomes of them.

    >>> buffers = Buffers(nodes=1, limit=2)
    >>> _ = buffers.store(0, 0.5, 1.0)   # a packet of one data unit at node 0, generated at 0.5
    >>> buffers.serve(0, 2.0, 1.0)   # at 2.0 a data unit of the node is collected
    >>> buffers.packets["left"]
    array([2.])

A packet is delivered when the last part of it has been collected. Parts of packets stay in the
buffer, also where a newer packet is served before the rest. All times are in mission slots.
``Packets`` keeps the buffers of the nodes in step with the residual data, which the rules and the
policies see.
"""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from statistics import fmean
from typing import Any

import numpy as np

from dess.base.kernels import kernel
from dess.model.events import Listener
from dess.physics.age import age_over_cycles, lower_age
from dess.physics.arrivals import draw_arrival, factors_of, sources_of


@dataclass(slots=True)
class Packet:
    """One packet; its number is its index.

    Attributes:
        node: Its node.
        generated: When it was generated.
        remaining: Data units that have not been collected.
        uav: The UAV that it was delivered to, otherwise -1.
        left: When it was delivered or lost, otherwise nan.
    """

    node: int
    generated: float
    remaining: float
    uav: int = -1
    left: float = math.nan


# The same as a record of an array.
PACKET = np.dtype([(field.name, field.type) for field in fields(Packet)])

# Sums of data units are rounded; a rest below this share of a message is no part of a packet.
_ROUNDING = 1e-9


class Buffers:
    """The buffers of the nodes, and all packets that were ever generated.

    Attributes:
        limit: Packets that a buffer can hold; 0 for no limit.
        rest: What is no part of a packet [data units].
        newest_first: Whether the newest packet is served first. Then a full buffer loses its oldest
            packet when a new one comes; otherwise it refuses the new one.
        queues: For each node, the numbers of the packets in its buffer, the oldest first.
        all: All packets, in the order of their generation.
        delivered: The numbers of the delivered packets, in the order of their delivery.
        lost: How many packets were lost.
    """

    def __init__(
        self, nodes: int, limit: int = 0, newest_first: bool = False, message: float = 1.0
    ):
        self.limit, self.newest_first = limit, newest_first
        self.rest = _ROUNDING * message
        self.queues: list[deque[int]] = [deque() for _ in range(nodes)]
        self.delivered: list[int] = []
        self.all: list[Packet] = []
        self.lost = 0

    @property
    def packets(self) -> np.ndarray:
        """(P,) ``PACKET`` records of all packets, in the order of their generation."""
        return np.array([*map(astuple, self.all)], PACKET)

    def store(self, k: int, time: float, amount: float) -> int:
        """Put a new packet into the buffer of node ``k``.

        Returns:
            The number of the packet that is lost because the buffer is full, or -1.
        """
        queue, number = self.queues[k], len(self.all)
        self.all.append(Packet(k, time, amount))
        queue.append(number)
        if not 0 < self.limit < len(queue):
            return -1
        number = queue.popleft() if self.newest_first else queue.pop()
        self._lose(number, time)
        return number

    def serve(self, k: int, time: float, amount: float, uav: int = -1) -> None:
        """Collect data units from the packets of node ``k``, in the order of service."""
        queue = self.queues[k]
        while queue:
            packet = self.all[queue[-1 if self.newest_first else 0]]
            if packet.remaining > amount + self.rest:
                packet.remaining -= amount
                return
            amount = max(amount - packet.remaining, 0.0)
            packet.remaining, packet.uav, packet.left = 0.0, uav, time
            self.delivered.append(queue.pop() if self.newest_first else queue.popleft())

    def lose(self, k: int, time: float) -> list[int]:
        """Lose all packets of node ``k``; return their numbers, the oldest first."""
        numbers = [*self.queues[k]]
        self.queues[k].clear()
        for number in numbers:
            self._lose(number, time)
        return numbers

    def _lose(self, number: int, time: float) -> None:
        self.all[number].left = time
        self.lost += 1

    def write(self, out: np.void, end: float, with_age: bool) -> None:
        """Write packets, latency and, on demand, age into an ``OPERATIONS`` record."""
        done = self.packets[self.delivered]
        counts = len(self.all), len(done), self.lost
        out["generated"], out["delivered"], out["lost_packets"] = counts
        if len(done):
            latency = done["left"] - done["generated"]
            out["latency"] = fmean(latency)
            out["latency_p99"] = np.quantile(latency, 0.99, method="inverted_cdf")
        if with_age:
            lows, highs, peaks = age_cycles(done, len(self.queues), end)
            out["age"], out["age_p99"] = age_over_cycles(lows, highs, np.ones(len(lows)))
            out["peak_age"] = fmean(highs[:peaks]) if peaks else math.nan


def age_cycles(done: np.ndarray, nodes: int, end: float) -> tuple[np.ndarray, np.ndarray, int]:
    """The cycles of the ages of all nodes (``dess.physics.age``) from their deliveries.

    Args:
        done: (D,) ``PACKET`` records in the order of their delivery.
        nodes: Number of nodes.
        end: End of the mission [slots].

    Returns:
        The (T,) ages at the beginnings and (T,) at the ends of the cycles [slots], and the number
        of those that end with a delivery; they come first. Deliveries at the same time end one
        cycle.
    """
    newest, since, cycles = [0.0] * nodes, [0.0] * nodes, []
    for k, generated, left in done[["node", "generated", "left"]].tolist():
        if generated > newest[k]:
            if left > since[k]:
                cycles.append((since[k] - newest[k], left - newest[k]))
            newest[k], since[k] = generated, left
    last = [(since[k] - newest[k], end - newest[k]) for k in range(nodes)]
    lows, highs = np.array([*cycles, *last]).T.copy()
    return lows, highs, len(cycles)


@kernel
def _deliver(missions, sensors, k, time, generated):
    newest = sensors[k].newest
    lower_age(missions[0], sensors[k], time - newest, time - generated)


class Packets:
    """The packets of one mission; the initial data of a node are a packet generated at time 0.

    Attributes:
        buffers: The buffers of the nodes.
    """

    def __init__(self, scenario: Any, state: Any, listener: Listener):
        """Begin a mission.

        Args:
            scenario: The ``ScenarioSpace``.
            state: The ``State`` of one mission that has been launched.
            listener: Is told what becomes of the packets.
        """
        self._listener = listener
        self._missions = state.missions
        self._mission, self._uavs = state.missions[0], state.uavs[0]
        self._residual, self._sensors = state.residual[0], state.sensors[0]
        arrivals, nodes = scenario.arrivals, len(scenario.nodes)
        self._measures_age = scenario.age.measured
        self._message = scenario.message
        self._sources = sources_of(scenario.message_rates)
        self._factors = factors_of(arrivals)
        self.buffers = Buffers(nodes, arrivals.buffer, arrivals.service == "newest", self._message)
        for k in range(nodes):
            if self._residual[k] > 0.0:
                self.buffers.store(k, 0.0, float(self._residual[k]))
            draw_arrival(self._missions, self._sources, *self._factors, k)

    def initial_packets(self) -> dict[int, int]:
        """The numbers of the packets of the initial data, by their nodes."""
        return {
            packet.node: n for n, packet in enumerate(self.buffers.all) if packet.generated == 0
        }

    def next_arrival(self) -> tuple[float, int]:
        """The time of the next arrival [slots], infinite if there is none, and its node."""
        k = int(self._sources["time"].argmin())
        return float(self._sources["time"][k]), k

    def arrive(self, k: int) -> None:
        """Let the next packet of node ``k`` arrive.

        The data of a silent node are hidden from the UAVs, or lost (``dess.physics.failures``).
        """
        mission, sensor, b = self._mission, self._sensors[k], self.buffers
        time, is_silent = float(self._sources["time"][k]), sensor["silent"]
        amount = self._message
        mission["arrived"] += amount
        sensor["arrived"] += amount
        lost = b.store(k, time, amount)
        gained = amount if lost < 0 else amount - b.all[lost].remaining
        if is_silent and mission["node_data_lost"]:
            lost, gained = len(b.all) - 1, 0.0
            b.lose(k, time)
            mission["lost"] += amount
        elif lost >= 0:
            mission["lost"] += b.all[lost].remaining
        if is_silent:
            sensor["hidden"] += gained
        else:
            self._residual[k] += gained
        draw_arrival(self._missions, self._sources, *self._factors, k)
        self._tell("arrival", [len(b.all) - 1])
        self._tell("loss", [lost] if lost >= 0 else [])

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
                _deliver(self._missions, self._sensors, b.all[number].node, time, generated)
                self._mission["newest"] += generated - sensor["newest"]
                sensor["newest"] = generated
        self._tell("delivery", b.delivered[before:])

    def fall_silent(self, time: float) -> None:
        """Lose the packets of silent nodes, if the data of a silent node are lost."""
        if self._mission["node_data_lost"]:
            for k in np.nonzero(self._sensors["silent"])[0].tolist():
                self._tell("loss", self.buffers.lose(k, time))

    def _tell(self, event: str, numbers: Iterable[int]) -> None:
        """Tell the listener of the arrival, the delivery or the loss of packets."""
        for number in numbers:
            p = self.buffers.all[number]
            time = p.generated if event == "arrival" else p.left
            value = {
                "arrival": self._message,
                "delivery": p.left - p.generated,
                "loss": p.remaining,
            }[event]
            self._listener.note_packet(event, time, number, p.node, p.uav, value, p.generated)

    def write(self, out: np.void) -> None:
        """Write what was measured in the mission into an ``OPERATIONS`` record."""
        out["lost"] = self._mission["lost"]
        self.buffers.write(out, float(self._mission["slot"]), self._measures_age)
