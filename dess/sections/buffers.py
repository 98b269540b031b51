"""Buffers of packets: a buffer per node, what is served, what is lost, and how late it is.

    buffers = Buffers(nodes=1, limit=2)
    buffers.store(0, 0.5, 1.0)   # a packet of one data unit at node 0, generated at 0.5
    buffers.serve(0, 2.0, 1.0)   # at 2.0 a data unit of the node is collected
    buffers.packets["left"]      # array([2.])

A packet is delivered when the last part of it has been collected. Parts of packets stay in the
buffer, also where a newer packet is served before the rest. All times are in mission slots.
"""

import math
from collections import deque
from dataclasses import astuple, dataclass, fields

import numpy as np

from dess.sections.age import age_of_teeth


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

# Sums of data units are rounded; a rest below this is no part of a packet.
_ROUNDING = 1e-9


class Buffers:
    """The buffers of the nodes, and all packets that were ever generated.

    Attributes:
        limit: Packets that a buffer can hold; 0 for no limit.
        newest_first: Whether the newest packet is served first. Then a full buffer loses its oldest
            packet when a new one comes; otherwise it refuses the new one.
        queues: For each node, the numbers of the packets in its buffer, the oldest first.
        all: All packets, in the order of their generation.
        delivered: The numbers of the delivered packets, in the order of their delivery.
        lost: How many packets were lost.
    """

    def __init__(self, nodes: int, limit: int = 0, newest_first: bool = False):
        self.limit, self.newest_first = limit, newest_first
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
            if packet.remaining > amount + _ROUNDING:
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
            out["latency"] = latency.mean()
            out["latency_p99"] = np.quantile(latency, 0.99, method="inverted_cdf")
        if with_age:
            lows, highs, peaks = teeth_of(done, len(self.queues), end)
            out["age"], out["age_p99"] = age_of_teeth(lows, highs, np.ones(len(lows)))
            out["peak_age"] = highs[:peaks].mean() if peaks else math.nan


def teeth_of(done: np.ndarray, nodes: int, end: float) -> tuple[np.ndarray, np.ndarray, int]:
    """The teeth of the ages of all nodes (``dess.sections.age``) from their deliveries.

    Args:
        done: (D,) ``PACKET`` records in the order of their delivery.
        nodes: Number of nodes.
        end: End of the mission [slots].

    Returns:
        The (T,) ages at the beginnings and (T,) at the ends of the teeth [slots], and the number of
        those that end with a delivery; they come first. Deliveries at the same time end one tooth.
    """
    newest, since, teeth = [0.0] * nodes, [0.0] * nodes, []
    for k, generated, left in done[["node", "generated", "left"]].tolist():
        if generated > newest[k]:
            if left > since[k]:
                teeth.append((since[k] - newest[k], left - newest[k]))
            newest[k], since[k] = generated, left
    last = [(since[k] - newest[k], end - newest[k]) for k in range(nodes)]
    lows, highs = np.array([*teeth, *last]).T.copy()
    return lows, highs, len(teeth)
