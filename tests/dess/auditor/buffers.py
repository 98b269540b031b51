"""The buffers of the nodes with arrivals in continuous time, packet by packet."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tests.dess.auditor.log import Log

ROUNDING = 1e-9  # data units; a smaller rest is no part of a packet


@dataclass
class Packet:
    """A packet; its number is its index in the list of all packets."""

    node: int
    generated: float
    remaining: float


@dataclass
class Buffers:
    """All packets of a mission, and for each node the numbers of those in its buffer."""

    log: Log
    arrivals: Mapping[str, Any]
    cells: list[tuple[int, int]]
    packets: list[Packet] = field(default_factory=list)
    latencies: list[float] = field(default_factory=list)
    lost: int = 0

    def __post_init__(self) -> None:
        self.waiting: list[list[int]] = [[] for _ in self.cells]

    def store(self, node: int, time: float, amount: float) -> int:
        """Store a packet; return the number of the one that the full buffer loses, or -1."""
        number, own = len(self.packets), self.waiting[node]
        self.packets.append(Packet(node, time, amount))
        own.append(number)
        if not 0 < self.arrivals["buffer"] < len(own):
            return -1
        return own[0] if self.arrivals["service"] == "newest" else number

    def lose(self, number: int, time: float) -> float:
        """Lose a packet; return its data units."""
        packet = self.packets[number]
        self.waiting[packet.node].remove(number)
        self.lost += 1
        self._take("loss", time, number, value=packet.remaining)
        return packet.remaining

    def serve(self, node: int, time: float, amount: float, uav: int, battery: int) -> list[int]:
        """Collect data units; return the numbers of the packets that are delivered with them."""
        own, delivered = self.waiting[node], []
        while own:
            place = -1 if self.arrivals["service"] == "newest" else 0
            packet = self.packets[own[place]]
            if packet.remaining > amount + ROUNDING:
                packet.remaining -= amount
                break
            amount = max(amount - packet.remaining, 0.0)
            delivered.append(own.pop(place))
        for number in delivered:
            latency = time - self.packets[number].generated
            self.latencies.append(latency)
            self._take("delivery", time, number, value=latency, uav=uav, battery=battery)
        return delivered

    def _take(self, event: str, time: float, number: int, **expected: Any) -> None:
        packet = self.packets[number]
        x, y = self.cells[packet.node]
        values = {"node": packet.node, "x": x, "y": y, "generated": packet.generated}
        self.log.take(event, time, packet=number, **(values | expected))

    def check_rate(self, node: int, time: float, rate: float) -> None:
        """Check that a packet can arrive at a node at a time."""
        factor = 1.0
        for start, later in self.arrivals["schedule"]:
            factor = later if start <= time else factor
        own = self.arrivals["rates"][node] if self.arrivals["rates"] else rate
        self.log.require(own * factor > 0, "a packet where none can arrive")

    def metrics(self) -> dict[str, float]:
        """What the record has of the packets."""
        done = sorted(self.latencies)
        return {
            "generated": len(self.packets),
            "delivered": len(done),
            "lost_packets": self.lost,
            "latency": sum(done) / len(done) if done else math.nan,
            "latency_p99": done[math.ceil(0.99 * len(done)) - 1] if done else math.nan,
        }
