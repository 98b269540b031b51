"""Buffers of packets: a buffer per node, what is served, what is lost, and how late it is.

    buffers = Buffers(nodes=1, limit=2)
    buffers.store(0, 0.5, 1.0)   # a packet of one data unit at node 0, generated at 0.5
    buffers.serve(0, 2.0, 1.0)   # at 2.0 a data unit of the node is collected
    buffers.packets["left"]      # array([2.])

A packet is delivered when the last part of it has been collected. Parts of packets stay in the
buffer, also where a newer packet is served before the rest. All times are in mission slots.
"""

import math

import numpy as np

from dess.code.kernels import inlined, kernel
from dess.sections.age import age_of_teeth

WAITING, DELIVERED, LOST = range(3)
GENERATED = 0  # Buffers.counts: packets generated, DELIVERED and LOST

# One packet; the number of a packet is its index.
PACKET = np.dtype(
    [
        ("node", np.int64),
        ("status", np.int64),
        ("uav", np.int64),  # that it was delivered to, otherwise -1
        ("generated", np.float64),
        ("left", np.float64),  # when it was delivered or lost, otherwise nan
        ("remaining", np.float64),  # data units that have not been collected
        ("older", np.int64),  # the next older packet in the buffer, -1 if there is none
        ("newer", np.int64),
    ]
)

# The buffer of one node.
QUEUE = np.dtype([("oldest", np.int64), ("newest", np.int64), ("count", np.int64)])

# Sums of data units are rounded; a rest below this is no part of a packet.
_ROUNDING = 1e-9


class Buffers:
    """The buffers of the nodes, and all packets that were ever generated.

    Attributes:
        records: The array of ``packets``, with room for more.
        order: The array of ``delivered``, with room for more.
        limit: Packets that a buffer can hold; 0 for no limit.
        newest_first: Whether the newest packet is served first. Then a full buffer loses its oldest
            packet when a new one comes; otherwise it refuses the new one.
        queues: (K,) ``QUEUE`` records.
        counts: (3,) number of packets generated, delivered and lost.
    """

    def __init__(self, nodes: int, limit: int = 0, newest_first: bool = False):
        self.limit, self.newest_first = limit, newest_first
        self.queues = np.zeros(nodes, QUEUE)
        self.queues["oldest"] = self.queues["newest"] = -1
        self.counts = np.zeros(3, np.int64)
        self.records = np.zeros(256, PACKET)
        self.order = np.zeros(256, np.int64)

    @property
    def packets(self) -> np.ndarray:
        """(P,) ``PACKET`` records of all packets, in the order of their generation."""
        return self.records[: self.counts[GENERATED]]

    @property
    def delivered(self) -> np.ndarray:
        """The numbers of the delivered packets, in the order of their delivery."""
        return self.order[: self.counts[DELIVERED]]

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, bool]:
        """What ``serve_packets`` takes first."""
        return self.records, self.queues, self.order, self.counts, self.newest_first

    def store(self, k: int, time: float, amount: float) -> int:
        """Put a new packet into the buffer of node ``k``.

        Returns:
            The number of the packet that is lost because the buffer is full, or -1.
        """
        self.make_room()
        rules = self.limit, self.newest_first
        return store_packet(self.records, self.queues, self.counts, *rules, k, time, amount)

    def make_room(self) -> None:
        """Make the arrays longer if they have no room for another packet."""
        if self.counts[GENERATED] == len(self.records):
            self.records = np.concatenate([self.records, np.zeros_like(self.records)])
            self.order = np.concatenate([self.order, np.zeros_like(self.order)])

    def serve(self, k: int, time: float, amount: float, uav: int = -1) -> None:
        """Collect data units from the packets of node ``k``."""
        serve_packets(*self.arrays, k, time, amount, uav)

    def lose(self, k: int, time: float) -> np.ndarray:
        """Lose all packets of node ``k``; return their numbers."""
        return lose_packets(self.records, self.queues, self.counts, k, time)

    def write(self, out: np.void, end: float, with_age: bool) -> None:
        """Write packets, latency and, on demand, age into an ``OPERATIONS`` record."""
        out["generated"], out["delivered"], out["lost_packets"] = self.counts
        done = self.packets[self.delivered]
        if len(done):
            latency = done["left"] - done["generated"]
            out["latency"] = latency.mean()
            out["latency_p99"] = np.quantile(latency, 0.99, method="inverted_cdf")
        if with_age:
            lows, highs, peaks = teeth_of(done, len(self.queues), end)
            out["age"], out["age_p99"] = age_of_teeth(lows, highs, np.ones(len(lows)))
            out["peak_age"] = highs[:peaks].mean() if peaks else math.nan


@kernel
def store_packet(packets, queues, counts, limit, newest_first, k, time, amount):
    """Put a packet at the end of a buffer; return the packet that is lost, or -1."""
    number, queue = counts[GENERATED], queues[k]
    counts[GENERATED] += 1
    p = packets[number]
    p.node, p.status, p.uav = k, WAITING, -1
    p.generated, p.left, p.remaining = time, math.nan, amount
    p.older, p.newer = queue.newest, -1
    if queue.newest >= 0:
        packets[queue.newest].newer = number
    else:
        queue.oldest = number
    queue.newest = number
    queue.count += 1
    if limit == 0 or queue.count <= limit:
        return -1
    lost = queue.oldest if newest_first else number
    _remove(packets, queue, counts, lost, LOST, time)
    return lost


@inlined
def _remove(packets, queue, counts, number, status, time):
    """Take a packet out of its buffer, delivered or lost."""
    p = packets[number]
    p.status, p.left = status, time
    if p.older >= 0:
        packets[p.older].newer = p.newer
    else:
        queue.oldest = p.newer
    if p.newer >= 0:
        packets[p.newer].older = p.older
    else:
        queue.newest = p.older
    queue.count -= 1
    counts[status] += 1


@kernel
def serve_packets(packets, queues, order, counts, newest_first, k, time, amount, uav):
    """Collect data units from the packets of a buffer, in the order of service."""
    queue = queues[k]
    while queue.count > 0:
        number = queue.newest if newest_first else queue.oldest
        p = packets[number]
        if p.remaining > amount + _ROUNDING:
            p.remaining -= amount
            return
        amount = max(amount - p.remaining, 0.0)
        p.remaining, p.uav = 0.0, uav
        order[counts[DELIVERED]] = number
        _remove(packets, queue, counts, number, DELIVERED, time)


@kernel
def lose_packets(packets, queues, counts, k, time):
    """Lose all packets of a buffer; return their numbers, the oldest first."""
    queue = queues[k]
    lost = np.empty(queue.count, np.int64)
    for place in range(len(lost)):
        lost[place] = queue.oldest
        _remove(packets, queue, counts, queue.oldest, LOST, time)
    return lost


@kernel
def teeth_of(done, nodes, end):
    """The teeth of the ages of all nodes (``dess.sections.age``) from their deliveries.

    Args:
        done: (D,) ``PACKET`` records in the order of their delivery.
        nodes: Number of nodes.
        end: End of the mission [slots].

    Returns:
        The (T,) ages at the beginnings and (T,) at the ends of the teeth [slots], and the number of
        those that end with a delivery; they come first. Deliveries at the same time end one tooth.
    """
    newest, since = np.zeros(nodes), np.zeros(nodes)
    lows, highs = np.empty(len(done) + nodes), np.empty(len(done) + nodes)
    count = 0
    for row in range(len(done)):
        p = done[row]
        k = p.node
        if p.generated <= newest[k]:
            continue
        if p.left > since[k]:
            lows[count], highs[count] = since[k] - newest[k], p.left - newest[k]
            count += 1
        newest[k], since[k] = p.generated, p.left
    peaks = count
    for k in range(nodes):
        lows[count], highs[count] = since[k] - newest[k], end - newest[k]
        count += 1
    return lows[:count], highs[:count], peaks
