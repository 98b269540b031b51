"""The exact optimum of a tiny mission with shadowing, by trying everything.

UAVs move, charge and end by the rules of the simulator. The shadowing has a few values here, each
of them the mean of the normal distribution over a part of the line. That is a mean-preserving
contraction of the normal distribution, so inequality 5 of analysis/bound/proof.md holds for it, and
with it the bound. With many values, the optimum is that of the simulator's shadowing.
"""

from collections.abc import Callable, Iterator
from functools import cached_property, lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from dess.analysis.bound import upper_bound
from dess.analysis.bound.paths import BoundProblem, bound_paths
from dess.analysis.bound.prices import Bounds, Detail, known_of
from dess.model import rules
from dess.model.state import starts_of, state_of
from dess.scenario.scenario import ScenarioSpace
from tests import compiled

# What the future of a UAV depends on.
FIELDS = ["active", "x", "y", "charging", "latch", "battery", "pad_request", "end"]
FIELDS += ["communications"]
Team = tuple[tuple, ...]  # the fields of each UAV
# By the data that there were, and what is left.
Aim = Callable[[float, np.ndarray], np.ndarray]


class Deviates(NamedTuple):
    """Standard normal deviates with a few values, and their chances."""

    values: np.ndarray
    chances: np.ndarray


class Outcome(NamedTuple):
    """What a choice of actions can lead to, by the team after the slot.

    Attributes:
        team: The team.
        origin: (N,) row of the residual data before the slot.
        chance: (N,) chance, given this row.
        residual: (N, K) residual data [data units].
    """

    team: Team
    origin: np.ndarray
    chance: np.ndarray
    residual: np.ndarray


def contraction(count: int) -> Deviates:
    """The means of the standard normal distribution over parts with equal chances."""
    density = norm.pdf(norm.ppf(np.linspace(0, 1, count + 1)))
    return Deviates(-np.diff(density) * count, np.full(count, 1 / count))


class TinySea:
    """A mission, with all that can happen in it.

    Args:
        space: The scenario, with no parameter sampled.
        seed: Seed of the mission; its replication is 0.
        deviates: The shadowing, in standard deviations.
    """

    def __init__(self, space: ScenarioSpace, seed: int, deviates: Deviates):
        self.space, self.deviates = space, deviates
        state = state_of([space], 1)
        rules.launch(state, 0, starts_of([space], seed), 0, 0)
        self.mission, self.uavs, residual = state.missions[0], state.uavs[0], state.residual[0]
        self.start, self.data = self._team(), [residual.copy()]
        arrivals = np.empty(len(residual))
        for slot in range(space.max_slots):
            self.mission["slot"] = slot
            compiled.arrive(self.mission, residual, arrivals)
            self.data.append(residual.copy())

    @cached_property
    def optimum(self) -> float:
        """The highest expected collection ratio of all policies, arrivals known."""
        return self._best(lambda had, left: (had - left) / had)

    @cached_property
    def most_collected(self) -> float:
        """The most data that any policy can be expected to collect, arrivals known."""
        return self._best(lambda had, left: had - left)

    def _best(self, aim: Aim) -> float:
        return float(self._futures(0, {self.start: self.data[0][None]}, aim)[self.start][0])

    def _futures(
        self, slot: int, states: dict[Team, np.ndarray], aim: Aim
    ) -> dict[Team, np.ndarray]:
        """The most (N,) that can be expected at the start of a slot, by team.

        Args:
            slot: Mission slots that are over.
            states: (N, K) residual data that each team can have.
            aim: What a mission is worth in the end.
        """
        best, choices = {}, []
        for team, residual in states.items():
            if _is_active(team):
                best[team] = np.zeros(len(residual))
                choices += [(team, made) for made in self._choices(slot, team, residual)]
            else:
                best[team] = aim(self.data[slot].sum(), residual.sum(axis=1))
        if not choices:
            return best
        merged, places = _merge([outcome for _, made in choices for outcome in made])
        after, place = self._futures(slot + 1, merged, aim), iter(places)
        for team, made in choices:
            expected = np.zeros(len(best[team]))
            for outcome in made:
                worth = outcome.chance * after[outcome.team][next(place)]
                expected += np.bincount(outcome.origin, worth, len(expected))
            best[team] = np.maximum(best[team], expected)
        return best

    def _choices(self, slot: int, team: Team, residual: np.ndarray) -> Iterator[list[Outcome]]:
        """The outcomes of a slot for each way in which the UAVs can act."""
        moved: dict[Team, None] = {}
        for actions in product(range(5), repeat=len(team)):
            self._set(slot, team)
            self.uavs["action"] = actions
            compiled.move(self.mission, self.uavs, self.space.chart)
            moved[self._team()] = None
        for after in moved:
            outcomes = self._flown(team, after, residual, self.data[slot + 1] - self.data[slot])
            yield [o._replace(team=self._settled(slot, o.team)) for o in outcomes]

    def _flown(
        self, team: Team, after: Team, residual: np.ndarray, arrivals: np.ndarray
    ) -> list[Outcome]:
        """What the communication slots of a slot can lead to, by the quotas that are used."""
        origin, chance, left = np.arange(len(residual)), np.ones(len(residual)), residual
        served = np.zeros((len(residual), len(team)), np.int64)
        for n in range(1, self.space.communication_slots + 1):
            part = n / self.space.communication_slots
            for i, ((_, x, y, *_), uav) in enumerate(zip(team, after, strict=True)):
                active, x2, y2, charging, *_ = uav
                if charging or not active:
                    continue
                rates, chances = self._service(x + part * (x2 - x), y + part * (y2 - y))
                chances = chances[(left > 0) @ (1 << np.arange(left.shape[1]))]
                row, drawn = np.nonzero(chances)
                origin, chance = origin[row], chance[row] * chances[row, drawn]
                left = np.maximum(left[row] - rates[drawn], 0.0)
                served = served[row]
                served[:, i] += drawn < len(rates) - 1
        counts, group = np.unique(served, axis=0, return_inverse=True)
        outcomes = []
        for number, count in enumerate(counts):
            of = group.ravel() == number
            used = tuple((*u[:-1], u[-1] + int(c)) for u, c in zip(after, count, strict=True))
            outcomes.append(Outcome(used, origin[of], chance[of], left[of] + arrivals))
        return outcomes

    def _settled(self, slot: int, team: Team) -> Team:
        """The team after the end of a slot."""
        self._set(slot, team)
        compiled.settle(self.mission, self.uavs)
        return self._team()

    def _set(self, slot: int, team: Team) -> None:
        self.uavs[FIELDS] = np.array([*team], self.uavs[FIELDS].dtype)
        self.mission["slot"], self.mission["active"] = slot, sum(uav[0] for uav in team)

    def _team(self) -> Team:
        return tuple(self.uavs[FIELDS].tolist())

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
        edge = space.cell_size * np.hypot(*space.size) / 2
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
                # On a tie the lower index.
                best = int(np.argmax(snr[able, drawn]))
                found[mask, able[best] * count + drawn[best]] += chances[[*drawn]].prod()
        return rates, found


def gap_of(space: ScenarioSpace, seed: int, count: int = 1) -> float:
    """How far the bound is above the optimum, of shadowing with so many values."""
    gap = upper_bound(space, seed, 0).ratio - TinySea(space, seed, contraction(count)).optimum
    assert gap >= -1e-12, space
    return gap


def _merge(outcomes: list[Outcome]) -> tuple[dict[Team, np.ndarray], list[np.ndarray]]:
    """The different residual data of each team, and the places in them of each outcome's rows."""
    parts: dict[Team, list[np.ndarray]] = {}
    for outcome in outcomes:
        parts.setdefault(outcome.team, []).append(outcome.residual)
    merged, places = {}, {}
    for team, rows in parts.items():
        together = np.concatenate(rows)
        first = place = np.arange(len(together))
        # Otherwise nothing comes after it that merging would save.
        if _is_active(team):
            # Rounding unites sums that differ by the order of their terms.
            _, first, place = np.unique(
                np.round(together, 9), axis=0, return_index=True, return_inverse=True
            )
        merged[team] = together[first]
        places[team] = iter(np.split(place.ravel(), np.cumsum([len(part) for part in rows])[:-1]))
    return merged, [next(places[outcome.team]) for outcome in outcomes]


def _is_active(team: Team) -> bool:
    return any(uav[0] for uav in team)


def bound_of_data(space: ScenarioSpace, seed: int) -> float:
    """An upper bound on the data [data units] that a lone UAV is expected to collect."""
    known = known_of(space, seed, 0)
    bounds = Bounds(known, Detail(cuts=()))
    bounds.at(np.zeros((1, len(known.nodes))))  # sets the worth of the steps
    local = np.tile(bounds.parts, (len(known.nodes), 1))
    problem = BoundProblem(
        known.to_zone, known.phases, known.data, bounds.period, bounds.blocks, local
    )
    bound_paths(problem, bounds.values, np.zeros(len(known.data)), bounds.ceilings)
    x, y = known.starts[0]
    home = bounds.blocks.home[x, y]
    had = known.data[known.phases.clock[0, 0], home]
    return float((bounds.ceilings[0, 0, x, y, 0] + local[home] * had).min())


def check(space: ScenarioSpace, seed: int, count: int) -> float:
    """How far the bound is above the optimum; neither it nor the table is below."""
    exact = TinySea(space, seed, contraction(count))
    gap = upper_bound(space, seed, 0).ratio - exact.optimum
    assert gap >= -1e-12, space
    assert exact.most_collected <= bound_of_data(space, seed) + 1e-9, space
    return gap
