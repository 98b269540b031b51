"""Select the cheapest setting that meets requirements, such as 99 % success.

The design points are grouped by their conditions: the fields that no operator decides on, such as
the arrival rate. There is a question for every condition, and, if there are several, one for all of
them: the cheapest setting that meets the requirements everywhere, at the mean cost of the
conditions. Every setting is a candidate of a question, with a design point for each condition.

Missions come in rounds that grow by a quarter. After each,
 1. the requirements of every point are tested as of ``feasibility``: a candidate is feasible once
    all requirements of its points are met, infeasible once one is missed;
 2. costs are compared in pairs on common replications. Of candidates i and l the true difference of
    the costs is at most, after the first n missions of both in the j-th look,
        D_il + t(n - 1, 1 - e) sqrt(S2_il / n) + L_i ln(1 / e) / n,    e = alpha / (2 P j (j + 1))
    with the mean D_il and the variance S2_il of the differences of missions, Student's quantile t,
    P ordered pairs over all questions, and L_i the price of all UAVs of i, as one mission may lose
    them: lost UAVs are so rare that a sample may have none. A candidate is dearer, and out, if that
    is below 0 for a feasible rival against it;
 3. a question is settled if no candidate is left, or the feasible one of the least mean cost costs
    at most the indifference more than any that is left by the bound above, decided or not.
A design point gets missions as long as a question needs it, so what is clearly too expensive is not
decided to the end.

All statements hold jointly with the confidence 1 - alpha: half of alpha is for the requirements,
split evenly over points and requirements, half for the bounds of costs, whose shares for the looks
add up to one (Bonferroni). The tests of requirements promise that for any distribution. The
bounds of costs take the mean difference, rare losses aside, for normal, as is usual.

The two phases and the zone of tolerance are those of S. Andradottir, S.-H. Kim, Fully sequential
procedures for comparing constrained systems via simulation, Nav. Res. Logist. 57 (2010) 403-421,
whose tests assume normal values and fail where missions seldom fail.
"""

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.special import stdtrit

from analysis.names import DECISIONS
from analysis.study.costs import Costs
from analysis.study.feasibility import MeanTest, Verdict
from analysis.study.selection import Selection, variances_of_differences
from analysis.study.stopping import MOST, StrictTable, of_its_kind
from dess.scenario import Integer, Number, ScenarioSpace

Share = Literal["success", "collection_ratio", "collection_ratio_and_communication"]


class Setting(NamedTuple):
    """A design point of a study with prices.

    Attributes:
        values: The fields that the design sets.
        loss: The price of all its UAVs if one mission loses them, over all missions.
    """

    values: Mapping[str, Any]
    loss: float

    @classmethod
    def of(cls, values: Mapping[str, Any], space: ScenarioSpace, costs: Costs) -> Self:
        """The setting of a design point."""
        return cls(values, costs.missions * costs.lost_uav * space.uavs[1])


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


@dataclass(frozen=True)
class CheapestChoice:
    """What the search of the cheapest setting came to.

    Attributes:
        answers: One for every condition, in the order of the design, and one for all of them, if
            there are several.
        verdicts: Whether each design point meets the requirements: ``met``, ``missed`` or ``open``.
        counts: Missions per design point that the selection rests on.
        missions: All missions.
        rounds: Rounds of simulation.
        done: Whether the procedure has all missions that it wants.
        guarantee: What can be said of the selection, in plain words.
    """

    answers: tuple[Answer, ...]
    verdicts: tuple[Verdict, ...]
    counts: tuple[int, ...]
    missions: int
    rounds: int
    done: bool
    guarantee: str

    @property
    def selected(self) -> list[int]:
        """All design points of selected settings, in order."""
        return sorted({point for answer in self.answers for point in answer.points})


class Cheapest(StrictTable):
    """The rule that missions are spent to find the cheapest setting that meets requirements.

    What is wanted is a function of the values in the order of their replications, found by playing
    all rounds again, so the counts are the same however a run was interrupted.

    Raises:
        pydantic.ValidationError: If a field is not valid.
    """

    procedure: Literal["cheapest"]
    requirements: dict[Share, Number] = Field(min_length=1, description="metric -> its least mean")
    tolerance: Number = Field(
        0.005, gt=0, description="half-width of the zone in which either verdict is acceptable"
    )
    indifference: Number = Field(gt=0, description="the least saving that matters, in the currency")
    first: Integer = Field(
        20, ge=2, le=MOST, description="missions of every design point in round one"
    )
    confidence: Number = Field(
        0.95, gt=0.5, lt=1, description="probability that all statements hold"
    )
    budget: Integer = Field(
        100_000, ge=2, le=MOST, description="missions over all design points at most"
    )
    check: Integer = Field(
        300, ge=0, le=MOST, description="further, independent missions of every selected point"
    )

    @model_validator(mode="after")
    def _are_shares(self) -> Self:
        for metric, least in self.requirements.items():
            if not self.tolerance < least < 1 - self.tolerance:
                raise ValueError(
                    f"requirements.{metric}: {least:g} is out of range; allowed: between "
                    f"{self.tolerance:g} and {1 - self.tolerance:g}, the tolerance off 0 and 1"
                )
        return self

    def wanted(
        self, samples: Sequence[Mapping[str, np.ndarray]], settings: Sequence[Setting]
    ) -> list[int]:
        """How many missions every design point is to have.

        Args:
            samples: Per design point: metric -> (n,) values of replications 0..n-1; ``cost`` is
                one of the metrics.
            settings: The design points.

        Returns:
            The numbers, none below the missions given; equal to them if no more are needed.
        """
        counts = _Search(self, samples, settings).counts
        return [max(len(s["cost"]), int(n)) for s, n in zip(samples, counts, strict=True)]

    def choice(
        self, samples: Sequence[Mapping[str, np.ndarray]], settings: Sequence[Setting]
    ) -> CheapestChoice:
        """The selected settings, and what can be said of them.

        Args:
            samples: As of ``wanted``.
            settings: The design points.

        Raises:
            ValueError: If there is no point, or one has not the missions of round one.
        """
        if not samples or min(len(sample["cost"]) for sample in samples) < self.first:
            raise ValueError(f"choice: needs points, with {self.first} or more missions each")
        search = _Search(self, samples, settings)
        counts = [min(int(n), len(s["cost"])) for s, n in zip(samples, search.counts, strict=True)]
        return CheapestChoice(
            answers=tuple(question.answer for question in search.questions),
            verdicts=tuple(search.verdicts),
            counts=tuple(counts),
            missions=sum(counts),
            rounds=search.rounds,
            done=search.done,
            guarantee=self._guarantee(search),
        )

    def _guarantee(self, search: "_Search") -> str:
        if not search.done:
            return "none yet: the procedure wants more missions"
        low, high = (
            _in_words(self.requirements, shift) for shift in (-self.tolerance, self.tolerance)
        )
        words = (
            f"with probability at least {self.confidence:g}, all of this holds: a setting that was "
            f"found to meet the requirements has {low}; one that was found to miss them does not "
            f"have {high}; a selected setting costs at most {self.indifference:g} more than any "
            f"that has {high}"
        )
        if all(question.answer.settled for question in search.questions):
            return words
        return f"{words}; the budget of {self.budget} missions ended before all was decided"


# What a study may select by.
AnySelection = Annotated[
    Selection | Cheapest,
    Field(discriminator="procedure"),
    of_its_kind("procedure", Selection, Cheapest),
]


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


class _Question:
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

    def look(self, search: "_Search", error: float) -> None:
        """Rule out what is infeasible or dearer, and see whether the question is settled."""
        verdicts = np.array(search.verdicts)[self.candidates]
        possible = ~(verdicts == "missed").any(axis=1)
        self.candidates, feasible = self.candidates[possible], (verdicts == "met").all(axis=1)
        feasible, self._best = feasible[possible], None
        if not feasible.any():
            self.settled = not len(self.candidates)
            return
        means, widths = search.costs(self.candidates, error)
        most = means[:, None] - means + widths  # that the first costs more than the second
        left = ~(most[feasible] < 0).any(axis=0)
        self.candidates, feasible = self.candidates[left], feasible[left]
        means, most = means[left], most[np.ix_(left, left)]
        self._best = int(np.argmin(np.where(feasible, means, np.inf)))
        self.settled = bool((most[self._best] <= search.rule.indifference).all())


class _Search:
    """The procedure, played as far as the values reach.

    Attributes:
        counts: (k,) missions wanted so far.
        verdicts: Whether every point meets the requirements.
        questions: All questions.
        rounds: Rounds played.
        done: No more missions are wanted: all questions are settled, or the budget has ended.
    """

    def __init__(
        self,
        rule: Cheapest,
        samples: Sequence[Mapping[str, np.ndarray]],
        settings: Sequence[Setting],
    ):
        self.rule, self.samples, self.settings = rule, samples, settings
        self.counts = np.full(len(samples), rule.first)
        self.verdicts: list[Verdict] = ["open"] * len(samples)
        self.questions = _questions([setting.values for setting in settings])
        self.rounds, self.done = 1, False
        self._error = (1 - rule.confidence) / 2
        each = self._error / (len(samples) * len(rule.requirements))
        self._tests = [
            {m: MeanTest(q, rule.tolerance, each) for m, q in rule.requirements.items()}
            for _ in samples
        ]
        self._pairs = max(sum(question.pairs for question in self.questions), 1)
        self._seen = 0  # missions of the points that are needed
        self._play()

    def costs(self, candidates: np.ndarray, error: float) -> tuple[np.ndarray, np.ndarray]:
        """(s,) mean costs of candidates, and (s, s) by how much i - l may exceed its estimate."""
        n = self._seen
        values = [
            np.mean([np.asarray(self.samples[p]["cost"][:n], float) for p in points], axis=0)
            for points in candidates
        ]
        losses = [np.mean([self.settings[p].loss for p in points]) for points in candidates]
        variances = variances_of_differences(np.array(values))
        widths = float(stdtrit(n - 1, 1 - error)) * np.sqrt(variances / n)
        widths += np.array(losses)[:, None] * -np.log(error) / n
        np.fill_diagonal(widths, 0.0)
        return np.array([row.mean() for row in values]), widths

    def _play(self) -> None:
        needed = [*range(len(self.samples))]
        while all(len(self.samples[p]["cost"]) >= self.counts[p] for p in needed):
            stage = int(self.counts.max())
            self._test(needed, stage)
            error = self._error / (self._pairs * self.rounds * (self.rounds + 1))
            for question in self.questions:
                if not question.settled:
                    question.look(self, error)
            needed = sorted(set().union(*(question.needed for question in self.questions)))
            room = self.rule.budget - int(self.counts.sum())
            step = min(max(stage // 4, 1), room // len(needed)) if needed else 0
            if step < 1:
                self.done = True
                return
            self.counts[needed] += step
            self.rounds += 1

    def _test(self, points: Sequence[int], stage: int) -> None:
        """Test the requirements of points by their missions up to a stage."""
        for point in points:
            if self.verdicts[point] != "open":
                continue
            for metric, test in self._tests[point].items():
                test.observe(np.asarray(self.samples[point][metric][self._seen : stage], float))
            self.verdicts[point] = _verdict([*self._tests[point].values()])
        self._seen = stage


def _verdict(tests: Sequence[MeanTest]) -> Verdict:
    """Whether all requirements are met, or one is missed."""
    verdicts = {test.verdict for test in tests}
    if "missed" in verdicts:
        return "missed"
    return "open" if "open" in verdicts else "met"


def _questions(values: Sequence[Mapping[str, Any]]) -> list[_Question]:
    """A question for each condition, and one for all of them, if there are several."""
    conditions = grouped(values, decisions=False)
    questions = [
        _Question(json.loads(text), [[point] for point in points])
        for text, points in conditions.items()
    ]
    if len(conditions) > 1:
        everywhere = grouped(values, decisions=True).values()
        fleets = [points for points in everywhere if len(points) == len(conditions)]
        questions.append(_Question(None, fleets))
    return questions


def _in_words(requirements: Mapping[Share, float], shift: float) -> str:
    """``a mean success of at least 0.985``."""
    means = [f"{metric} of at least {least + shift:g}" for metric, least in requirements.items()]
    return f"a mean {' and a mean '.join(means)}"
