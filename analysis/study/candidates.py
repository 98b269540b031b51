"""Candidates of a search, and the questions which of them is the cheapest that is good enough."""

import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dess.analysis.names import DECISIONS
from dess.analysis.stats.verdict import Verdict

# A function that bounds costs. It takes the (s, g) design points of s candidates, and the number of
# one of them. It returns (s,) an upper bound of how much more this one costs than each candidate (0
# for itself).
Excess = Callable[[np.ndarray, int], np.ndarray]


class Points:
    """What is known of the k design points.

    Attributes:
        counts: (k,) missions that each needs so far.
        analyses: (k,) the number of rounds for which each had missions.
        verdicts: (k,) whether each meets the requirements: ``met``, ``missed`` or ``open``.
        promising: (k,) whether the means of its missions meet the requirements.
        costs: (k,) its mean cost.
    """

    def __init__(self, k: int, first: int):
        self.counts = np.full(k, first)
        self.analyses = np.ones(k, int)
        self.verdicts = np.full(k, Verdict.OPEN, object)
        self.promising = np.zeros(k, bool)
        self.costs = np.zeros(k)


@dataclass(frozen=True)
class CheapestSetting:
    """The cheapest setting under one condition, or under all conditions together.

    Attributes:
        condition: The fields of the condition with their values; None for all conditions together.
        points: The design points of the selected setting, one for each condition of the question.
            Empty if no setting is known to meet the requirements.
        left: The design points of all settings that may be as good.
        settled: Whether the answer has the guaranteed confidence. It has not if the budget ended
            before the question was settled.
    """

    condition: dict[str, Any] | None
    points: tuple[int, ...]
    left: tuple[tuple[int, ...], ...]
    settled: bool


class CheapestQuestion:
    """The question which of some candidates is the cheapest."""

    def __init__(self, condition: dict[str, Any] | None, candidates: Sequence[Sequence[int]]):
        self._condition = condition
        self.candidates = np.array(candidates, int).reshape(len(candidates), -1)
        self._next = self.candidates  # of those left, the ones that need more missions
        self.settled = not candidates
        self._best: int | None = None

    @property
    def pairs(self) -> int:
        """The number of ordered pairs of candidates."""
        return len(self.candidates) * (len(self.candidates) - 1)

    @property
    def needed(self) -> set[int]:
        """The design points that need more missions to settle the question."""
        if self.settled:
            return set()
        return set(self._next.ravel().tolist())

    @property
    def answer(self) -> CheapestSetting:
        """The answer as far as it is known."""
        left = [tuple(points) for points in self.candidates.tolist()]
        best = ()
        if self._best is not None:
            best = left[self._best]
        return CheapestSetting(self._condition, best, tuple(left), self.settled)

    def look(self, points: Points, excess: Excess, indifference: float) -> None:
        """Rule out candidates that are infeasible or more expensive; check if the rest is settled.

        Args:
            points: What is known of the design points.
            excess: The function that bounds the costs of candidates.
            indifference: The smallest saving that matters, in the currency.
        """
        verdicts = points.verdicts[self.candidates]
        possible = ~(verdicts == Verdict.MISSED).any(axis=1)
        self.candidates = self.candidates[possible]
        self._best = None
        feasible = (verdicts[possible] == Verdict.MET).all(axis=1)
        if not feasible.any():
            self.settled = not len(self.candidates)
            self._next = self._up_to_promising(points, indifference)
            return
        costs = points.costs[self.candidates].mean(axis=1)
        leader = int(np.argmin(np.where(feasible, costs, np.inf)))
        bounds = excess(self.candidates, leader)
        left = bounds >= 0
        self._best = int(left[:leader].sum())
        self.candidates = self.candidates[left]
        self._next = self.candidates
        self.settled = bool((bounds <= indifference).all())

    def _up_to_promising(self, points: Points, indifference: float) -> np.ndarray:
        """The cheapest candidate that met the requirements so far, and all that hardly cost more.

        Missions of more expensive ones would be of no use if one of these meets the requirements.
        """
        costs = points.costs[self.candidates].mean(axis=1)
        promising = points.promising[self.candidates].all(axis=1)
        return self.candidates[costs <= costs[promising].min(initial=np.inf) + indifference]


def questions_about(values: Sequence[Mapping[str, Any]]) -> list[CheapestQuestion]:
    """A question for each condition and, if there are several, one for all of them together."""
    conditions = group_points(values, decisions=False)
    questions = [
        CheapestQuestion(json.loads(text), [[point] for point in points])
        for text, points in conditions.items()
    ]
    if len(conditions) > 1:
        everywhere = group_points(values, decisions=True).values()
        fleets = [points for points in everywhere if len(points) == len(conditions)]
        questions.append(CheapestQuestion(None, fleets))
    return questions


def group_points(values: Iterable[Mapping[str, Any]], decisions: bool) -> dict[str, list[int]]:
    """Group design points that share either their decisions or their conditions.

    Args:
        values: For each design point, the fields that the design sets.
        decisions: True to group by the fields that an operator decides on, False to group by all
            other fields.

    Returns:
        A mapping from the shared fields, as JSON text, to the numbers of the design points in the
        order of the design.
    """
    groups = defaultdict(list)
    for number, fields in enumerate(values):
        shared = {field: fields[field] for field in fields if (field in DECISIONS) == decisions}
        groups[json.dumps(shared, sort_keys=True)].append(number)
    return dict(groups)
