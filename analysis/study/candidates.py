"""The questions that a search of the cheapest setting answers, and their candidates.

The design points are grouped by their conditions: the fields that no operator decides on. There is
a question for every condition, and, if there are several, one for all of them. A candidate has a
design point for each condition of its question.
"""

import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.names import DECISIONS
from analysis.study.feasibility import Verdict

# (s, g) design points of candidates, (s,) whether they are feasible -> the feasible candidate of
# the least mean cost, and (s,) by how much it may cost more than each candidate: 0 for itself.
Costing = Callable[[np.ndarray, np.ndarray], tuple[int, np.ndarray]]


@dataclass(frozen=True)
class Answer:
    """The cheapest setting under a condition, or under all of them.

    Attributes:
        condition: The fields of the condition with their values; None: of all conditions.
        points: Design points of the selected setting, one, or one for each condition; none, if no
            setting is known to meet the requirements.
        left: The points of the settings that may be as good.
        settled: Whether that is promised: it is not if the missions or the budget ended before.
    """

    condition: dict[str, Any] | None
    points: tuple[int, ...]
    left: tuple[tuple[int, ...], ...]
    settled: bool


class Question:
    """The cheapest of some candidates.

    Attributes:
        answer: As far as it is known.
    """

    def __init__(self, condition: dict[str, Any] | None, candidates: Sequence[Sequence[int]]):
        self._condition = condition
        self.candidates = np.array(candidates, int).reshape(len(candidates), -1)
        self.settled = not candidates
        self._best: int | None = None

    @property
    def pairs(self) -> int:
        """How many ordered pairs of candidates there are."""
        return len(self.candidates) * (len(self.candidates) - 1)

    @property
    def needed(self) -> set[int]:
        """The points that need missions to settle it."""
        return set() if self.settled else set(self.candidates.ravel().tolist())

    @property
    def answer(self) -> Answer:
        """What is known."""
        left = [tuple(points) for points in self.candidates.tolist()]
        best = () if self._best is None else left[self._best]
        return Answer(self._condition, best, tuple(left), self.settled)

    def look(self, verdicts: Sequence[Verdict], costs: Costing, indifference: float) -> None:
        """Rule out what is infeasible or dearer, and see whether the question is settled.

        Args:
            verdicts: Whether each design point meets the requirements, as far as is known.
            costs: Estimates the costs of candidates.
            indifference: The least saving that matters.
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
    """A question for each condition, and one for all of them, if there are several."""
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
    """Design points that are alike in what operators decide on, or in all other fields.

    Args:
        values: The fields that the design sets, by design point.
        decisions: Whether the points of a group share the decisions, or the conditions.

    Returns:
        The shared fields as JSON text -> numbers of the points, in the order of the design.
    """
    groups = defaultdict(list)
    for number, fields in enumerate(values):
        shared = {field: fields[field] for field in fields if (field in DECISIONS) == decisions}
        groups[json.dumps(shared, sort_keys=True)].append(number)
    return dict(groups)
