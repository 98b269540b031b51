"""The exact optimum of a tiny mission with shadowing, by trying everything.

The shadowing has a few values here, each of them the mean of the normal distribution over a part
of the line. That is a mean-preserving contraction of the normal distribution, so inequality 5 of
docs/concepts/bound.md holds for it, and with it the bound. With many values, the optimum is that
of the simulator's shadowing.
"""

from collections.abc import Iterator
from functools import cached_property, lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from analysis.bound.prices import known_of
from dess.scenario import ScenarioSpace
from dess.state import STEP_X, STEP_Y

Cells = tuple[tuple[int, int], ...]


class Deviates(NamedTuple):
    """Standard normal deviates with a few values, and their chances."""

    values: np.ndarray
    chances: np.ndarray


def contraction(count: int) -> Deviates:
    """The means of the standard normal distribution over parts with equal chances."""
    density = norm.pdf(norm.ppf(np.linspace(0, 1, count + 1)))
    return Deviates(-np.diff(density) * count, np.full(count, 1 / count))


class TinySea:
    """A mission whose UAVs fly all of its slots: none charges, and no battery is empty before.

    Args:
        space: The scenario.
        seed: Seed of the mission.
        deviates: The shadowing, in standard deviations.
    """

    def __init__(self, space: ScenarioSpace, seed: int, deviates: Deviates):
        assert space.quota == space.max_slots * space.communication_slots
        assert space.flying_time[0] - space.charge_start[1] > space.max_slots
        known = known_of(space, seed, 0)
        self.space, self.deviates, self.data = space, deviates, known.data
        self.starts: Cells = tuple((int(x), int(y)) for x, y in known.starts)

    @cached_property
    def optimum(self) -> float:
        """The highest expected collection ratio of all policies, arrivals known."""
        return float(self._future(0, self.starts, self.data[:1])[0]) / self.data[-1].sum()

    def _future(self, slot: int, cells: Cells, residual: np.ndarray) -> np.ndarray:
        """(N,) the most that can be expected from a slot on, for (N, K) of residual data."""
        best = np.zeros(len(residual))
        if slot == self.space.max_slots:
            return best
        arrivals = self.data[slot + 1] - self.data[slot]
        for after in self._moves(cells):
            origin, chance, left = self._flown(cells, after, residual)
            future = self._future(slot + 1, after, left + arrivals)
            taken = (residual[origin] - left).sum(axis=1)
            best = np.maximum(best, np.bincount(origin, chance * (taken + future)))
        return best

    def _moves(self, cells: Cells) -> Iterator[Cells]:
        """The cells to which the UAVs can fly together."""
        for actions in product(range(5), repeat=len(cells)):
            after = tuple(
                (x + int(STEP_X[action]), y + int(STEP_Y[action]))
                for (x, y), action in zip(cells, actions, strict=True)
            )
            if (
                len({*after}) == len(after)
                and 0 <= np.min(after) <= np.max(after) < self.space.grid
            ):
                yield after

    def _flown(
        self, cells: Cells, after: Cells, residual: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All that a slot can leave: the row of the data before, the chance, the residual data."""
        origin, chance, left = np.arange(len(residual)), np.ones(len(residual)), residual
        for n in range(1, self.space.communication_slots + 1):
            part = n / self.space.communication_slots
            for (x, y), (x2, y2) in zip(cells, after, strict=True):
                rates, chances = self._service(x + part * (x2 - x), y + part * (y2 - y))
                chances = chances[(left > 0) @ (1 << np.arange(left.shape[1]))]
                row, outcome = np.nonzero(chances)
                origin, chance = origin[row], chance[row] * chances[row, outcome]
                left = np.maximum(left[row] - rates[outcome], 0.0)
        return origin, chance, left

    @lru_cache  # noqa: B019
    def _service(self, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
        """What a communication slot at a place can be, for each set of nodes that have data.

        Returns:
            (O, K) the rates of the possible outcomes: that of the node served, 0 of the others. The
            last outcome serves none. (2^K, O) their chances; the sets of nodes are bit masks.
        """
        space, (values, chances) = self.space, self.deviates
        nodes, count = len(space.nodes), len(values)
        offset = space.cell_size * (np.array(space.nodes) - (x, y))
        distance = np.sqrt((offset**2).sum(axis=1) + space.altitude**2)
        edge = space.cell_size * space.grid / np.sqrt(2)
        mean = space.edge_snr - 10 * space.path_loss_exponent * np.log10(distance / edge)
        snr = mean[:, None] + np.sqrt(space.shadowing_variance) * values
        rates = np.zeros((nodes * count + 1, nodes))
        of_node = space.slot_length / space.communication_slots * np.log2(1 + 10 ** (snr / 10))
        for k in range(nodes):
            rates[k * count : (k + 1) * count, k] = of_node[k]
        found = np.zeros((2**nodes, len(rates)))
        found[0, -1] = 1.0
        for mask in range(1, 2**nodes):
            able = [k for k in range(nodes) if mask >> k & 1]
            for drawn in product(range(count), repeat=len(able)):
                best = int(np.argmax(snr[able, drawn]))  # on a tie the lower index
                found[mask, able[best] * count + drawn[best]] += chances[[*drawn]].prod()
        return rates, found
