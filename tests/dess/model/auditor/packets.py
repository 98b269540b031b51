"""The packets of arrivals in continuous time, and the ages of the nodes."""

import math
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from tests.dess.model.auditor.log import Log

ROUNDING = 1e-9  # messages; a smaller rest is no part of a packet


class Packets:
    """All packets of a mission, and for each node the numbers of those in its buffer."""

    def __init__(self, log: Log, arrivals: Mapping[str, Any], cells: list[tuple[int, int]]):
        self.log, self.arrivals, self.cells, self.lost = log, arrivals, cells, 0
        self.all, self.latencies = list[Any](), list[float]()
        self.waiting: list[list[int]] = [[] for _ in cells]
        self.newest_first = arrivals.get("service") == "newest"
        self.rest = ROUNDING * (arrivals.get("message") or 1.0)

    def store(self, node: int, time: float, amount: float) -> int:
        """Store a packet; return the number of the one that the full buffer loses, or -1."""
        number, own = len(self.all), self.waiting[node]
        self.all.append(SimpleNamespace(node=node, generated=time, remaining=amount))
        own.append(number)
        if not 0 < self.arrivals["buffer"] < len(own):
            return -1
        return own[0] if self.newest_first else number

    def lose(self, number: int, time: float) -> float:
        """Lose a packet; return its data units."""
        packet = self.all[number]
        self.waiting[packet.node].remove(number)
        self.lost += 1
        self._take("loss", time, number, value=packet.remaining)
        return packet.remaining

    def serve(self, node: int, time: float, amount: float, uav: int, battery: int) -> list[Any]:
        """Collect data units; return the packets that are delivered with them."""
        own, delivered, place = self.waiting[node], [], -1 if self.newest_first else 0
        while own and self.all[own[place]].remaining <= amount + self.rest:
            amount = max(amount - self.all[own[place]].remaining, 0.0)
            delivered.append(own.pop(place))
        if own:
            self.all[own[place]].remaining -= amount
        for number in delivered:
            self.latencies.append(time - self.all[number].generated)
            value = self.latencies[-1]
            self._take("delivery", time, number, value=value, uav=uav, battery=battery)
        return [self.all[number] for number in delivered]

    def _take(self, event: str, time: float, number: int, **expected: Any) -> None:
        packet = self.all[number]
        x, y = self.cells[packet.node]
        values = {"node": packet.node, "x": x, "y": y, "generated": packet.generated}
        self.log.take(event, time, packet=number, **(values | expected))

    def check_rate(self, node: int, time: float, rate: float) -> None:
        """Check that a packet can arrive at a node at a time."""
        factors = [1.0, *(factor for start, factor in self.arrivals["schedule"] if start <= time)]
        self.log.require(rate * factors[-1] > 0, "a packet where none can arrive")

    def metrics(self) -> dict[str, float]:
        """What the record has of the packets."""
        done = sorted(self.latencies)
        found = {"generated": len(self.all), "delivered": len(done), "lost_packets": self.lost}
        if not done:
            return found
        return found | {
            "latency": sum(done) / len(done),
            "latency_p99": done[math.ceil(0.99 * len(done)) - 1],
        }


class Ages:
    """The ages of all nodes, and their cycles: the ages at their beginnings and ends."""

    def __init__(self, ages: list[float]):
        """Begin with the ages of the nodes."""
        nodes = len(ages)
        self.newest, self.fell = [-age for age in ages], [0.0] * nodes
        self.cycles: list[tuple[float, float]] = []
        self.areas = [0.0] * nodes

    def fall(self, node: int, time: float, generated: float) -> None:
        """Data of a node that were generated at that time have been collected."""
        if generated > self.newest[node]:
            if time > self.fell[node]:
                self._add_cycle(node, time)
            self.newest[node], self.fell[node] = generated, time

    def _add_cycle(self, node: int, time: float) -> None:
        low, high = self.fell[node] - self.newest[node], time - self.newest[node]
        self.cycles.append((low, high))
        self.areas[node] += (high - low) * (high + low) / 2

    def mean_at(self, time: float) -> float:
        """The mean age of all nodes at a time."""
        return time - sum(self.newest) / len(self.newest)

    def finish(self, end: float) -> None:
        """Add the last cycle of every node."""
        for node in range(len(self.newest)):
            self._add_cycle(node, end)

    def metrics(self) -> dict[str, float]:
        """What the record has of the ages of a mission that has ended (``finish``)."""
        peaks = [high for _, high in self.cycles[: -len(self.newest)]]
        whole = sum(high - low for low, high in self.cycles)
        area = sum((high**2 - low**2) / 2 for low, high in self.cycles)
        found = {"age": area / whole, "age_p99": self._exceeded_for(0.01 * whole)}
        return found | ({"peak_age": sum(peaks) / len(peaks)} if peaks else {})

    def _exceeded_for(self, spent: float) -> float:
        """The age that is exceeded for that time, by bisection."""
        low, high = 0.0, max(high for _, high in self.cycles)
        for _ in range(60):
            age = (low + high) / 2
            above = sum(max(end - max(begin, age), 0.0) for begin, end in self.cycles)
            low, high = (age, high) if above > spent else (low, age)
        return (low + high) / 2
