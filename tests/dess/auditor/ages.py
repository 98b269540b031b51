"""The age of information of the nodes, from the times at which it falls."""

import math


class Ages:
    """The ages of all nodes, and the teeth of their saws: the ages at their beginnings and ends."""

    def __init__(self, nodes: int):
        self.newest, self.fell = [0.0] * nodes, [0.0] * nodes
        self.teeth: list[tuple[float, float]] = []

    def fall(self, node: int, time: float, generated: float) -> None:
        """Data of a node that were generated at that time have been collected."""
        if generated <= self.newest[node]:
            return
        if time > self.fell[node]:
            self._add_tooth(node, time)
        self.newest[node], self.fell[node] = generated, time

    def _add_tooth(self, node: int, time: float) -> None:
        self.teeth.append((self.fell[node] - self.newest[node], time - self.newest[node]))

    def mean_at(self, time: float) -> float:
        """The mean age of all nodes at a time."""
        return time - sum(self.newest) / len(self.newest)

    def metrics(self, end: float) -> dict[str, float]:
        """What the record has of the ages of a mission that has ended."""
        peaks = [high for _, high in self.teeth]
        for node in range(len(self.newest)):
            self._add_tooth(node, end)
        whole = sum(high - low for low, high in self.teeth)
        area = sum((high**2 - low**2) / 2 for low, high in self.teeth)
        return {
            "age": area / whole,
            "peak_age": sum(peaks) / len(peaks) if peaks else math.nan,
            "age_p99": self._exceeded_for(0.01 * whole),
        }

    def _exceeded_for(self, spent: float) -> float:
        """The age that is exceeded for that time, by bisection."""
        low, high = 0.0, max(high for _, high in self.teeth)
        while high - low > 1e-12 * high:
            age = (low + high) / 2
            if age in (low, high):
                break
            above = sum(max(end - max(begin, age), 0.0) for begin, end in self.teeth)
            low, high = (age, high) if above > spent else (low, age)
        return (low + high) / 2
