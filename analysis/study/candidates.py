"""The questions that the search for the cheapest setting answers, and their candidates.

A condition is a combination of values of the fields that no operator decides on, such as the
arrival rate. There is one question for every condition: which setting is the cheapest under it. If
there are several conditions, there is one more question, about all of them together. A candidate is
a setting; it has one design point for each condition of its question.
"""

import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.names import DECISIONS
from analysis.study.feasibility import Verdict

# A function that estimates costs. It takes the (s, g) design points of s candidates, and for each
# (s,) whether it is feasible. It returns the feasible candidate with the lowest mean cost, and (s,)
# an upper bound of how much more it costs than each candidate (0 for itself).
Costing = Callable[[np.ndarray, np.ndarray], tuple[int, np.ndarray]]


@dataclass(frozen=True)
class Answer:
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


class Question:
    """The question which of some candidates is the cheapest."""

    def __init__(self, condition: dict[str, Any] | None, candidates: Sequence[Sequence[int]]):
        self._condition = condition
        self.candidates = np.array(candidates, int).reshape(len(candidates), -1)
        self.settled = not candidates
        self._best: int | None = None

    @property
    def pairs(self) -> int:
        """The number of ordered pairs of candidates."""
        return len(self.candidates) * (len(self.candidates) - 1)

    @property
    def needed(self) -> set[int]:
        """The design points that need more missions to settle the question."""
        return set() if self.settled else set(self.candidates.ravel().tolist())

    @property
    def answer(self) -> Answer:
        """The answer as far as it is known."""
        left = [tuple(points) for points in self.candidates.tolist()]
        best = () if self._best is None else left[self._best]
        return Answer(self._condition, best, tuple(left), self.settled)

    def look(self, verdicts: Sequence[Verdict], costs: Costing, indifference: float) -> None:
        """Rule out candidates that are infeasible or more expensive; check if the rest is settled.

        Args:
            verdicts: For each design point, whether it meets the requirements, as far as known.
            costs: The function that estimates the costs of candidates.
            indifference: The smallest saving that matters, in the currency.
        """
        of_points = np.array(verdicts)[self.candidates]
        possible = ~(of_points == "missed").any(axis=1)
        feasible = (of_points == "met").all(axis=1)[possible]
        self.candidates, self._best = self.candidates[possible], None
        if not feasible.any():
            self.settled = not len(self.candidates)
            return
        leader, excess = costs(self.candidates, feasible)
        left = excess >= 0
        self.candidates, self._best = self.candidates[left], int(left[:leader].sum())
        self.settled = bool((excess <= indifference).all())


def questions_about(values: Sequence[Mapping[str, Any]]) -> list[Question]:
    """A question for each condition and, if there are several, one for all of them together."""
    conditions = grouped(values, decisions=False)
    questions = [
        Question(json.loads(text), [[point] for point in points])
        for text, points in conditions.items()
    ]
    if len(conditions) > 1:
        everywhere = grouped(values, decisions=True).values()
        fleets = [points for points in everywhere if len(points) == len(conditions)]
        questions.append(Question(None, fleets))
    return questions


def grouped(values: Iterable[Mapping[str, Any]], decisions: bool) -> dict[str, list[int]]:
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
