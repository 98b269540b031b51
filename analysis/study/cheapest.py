"""Select the cheapest setting that meets requirements, such as 99 % success.

The design points are grouped by their conditions: the values of the fields that no operator decides
on, such as the arrival rate. For every condition the procedure asks which setting is the cheapest.
If there are several conditions, it also asks which setting meets the requirements under all of them
at the lowest mean cost. Every setting is a candidate of a question, with one design point for each
condition of the question.

Missions are simulated in rounds; the number of missions grows by half from round to round. After
each round,
 1. the requirements of every design point are tested (see ``feasibility``). A candidate is feasible
    as soon as all requirements of its points are met, and infeasible as soon as one is missed;
 2. the leader i of a question, which is the feasible candidate with the lowest mean cost, is
    compared with every other candidate l on common replications. It costs at most
        D_il + t(n - 1, 1 - e) sqrt(S2_il / n) + L_i ln(1 / e) / n,    e = alpha / (2 P j (j + 1))
    more than l, after n missions and j such comparisons. D_il is the mean and S2_il the variance of
    the differences, t is Student's quantile, P the number of ordered pairs over all questions, and
    L_i the cost of losing all UAVs of i (``Setting.loss``). The last term covers losses of UAVs so
    rare that the sample has none. If the bound is below 0, l is more expensive than i and is ruled
    out;
 3. a question is settled if no other candidate is left, or if the leader costs at most the
    indifference more than any candidate that is left, whether that candidate is feasible or not.
A design point gets more missions only as long as a question needs it. So a setting that is clearly
too expensive gets few missions, and whether it is feasible may stay open.

All statements hold jointly with the confidence 1 - alpha (Bonferroni). Half of alpha is for the
requirements, split evenly over points and requirements. The other half is for the bounds of costs,
divided among the successive comparisons. The tests of the requirements keep this confidence for any
distribution. The bounds of costs assume that the mean difference, apart from rare losses, is
normally distributed, as is usual.

The two phases and the zone of tolerance follow S. Andradottir, S.-H. Kim, Fully sequential
procedures for comparing constrained systems via simulation, Nav. Res. Logist. 57 (2010) 403-421.
The tests of that article assume normal values and are unreliable where missions seldom fail.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.special import stdtrit

from analysis.study.candidates import Answer, questions_about
from analysis.study.costs import Costs
from analysis.study.feasibility import MeanTest, Verdict
from analysis.study.selection import Chosen, Selection, based_on, check_begun, needed
from analysis.study.stopping import MOST, Samples, StrictTable, of_its_kind
from dess.scenario import Integer, Number, ScenarioSpace

# How much longer a search may take for which it is estimated: times its missions, and missions.
FURTHER, MOST_FURTHER = 64, 10_000_000

Share = Literal["success", "collection_ratio", "collection_ratio_and_communication"]


class Setting(NamedTuple):
    """A design point of a study with prices.

    Attributes:
        values: The fields that the design sets.
        loss: The cost over all missions if every mission lost all UAVs, in the currency.
    """

    values: Mapping[str, Any]
    loss: float

    @classmethod
    def of(cls, values: Mapping[str, Any], space: ScenarioSpace, costs: Costs) -> Self:
        """The setting of a design point."""
        return cls(values, costs.missions * costs.lost_uav * space.uavs[1])


@dataclass(frozen=True)
class CheapestChoice(Chosen):
    """The result of the search for the cheapest setting.

    Attributes:
        answers: One answer for every condition, in the order of the design and, if there are
            several conditions, one for all of them together.
        verdicts: For each design point, ``met``, ``missed`` or ``open``.
        enough: About how many missions would settle all questions, if the budget has ended before
            and it is no more than ``FURTHER`` times the budget; otherwise None.
    """

    answers: tuple[Answer, ...]
    verdicts: tuple[Verdict, ...]
    enough: int | None

    @property
    def selected(self) -> list[int]:
        """All design points of selected settings, in order."""
        return sorted({point for answer in self.answers for point in answer.points})


class Cheapest(StrictTable):
    """The rule that missions are added until the cheapest setting that meets requirements is found.

    How many missions are needed is computed by repeating all rounds on the values, in the order of
    their replications. So the result is the same, whether or not a run was interrupted.

    Raises:
        pydantic.ValidationError: If a field is not valid.
    """

    procedure: Literal["cheapest"]
    requirements: dict[Share, Number] = Field(min_length=1, description="metric -> its least mean")
    tolerance: Number = Field(
        0.005,
        ge=1e-6,
        le=0.5,
        description="half-width of the zone in which either verdict is acceptable",
    )
    indifference: Number = Field(
        ge=1e-9, le=10**15, description="the least saving that matters, in the currency"
    )
    first: Integer = Field(
        20, ge=2, le=MOST, description="missions of every design point in round one"
    )
    confidence: Number = Field(
        0.95, gt=0.5, le=0.999_999, description="probability that all statements hold"
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
                    f"{self.tolerance:g} and {1 - self.tolerance:g}, which keeps the tolerance "
                    "away from 0 and 1"
                )
        return self

    def wanted(self, samples: Samples, settings: Sequence[Setting]) -> list[int]:
        """The number of missions that every design point needs.

        Args:
            samples: The missions of every design point, with ``cost`` among the metrics.
            settings: The design points.

        Returns:
            For each design point at least the n missions given; exactly n if no more are needed.
        """
        return needed(_Search(self, samples, settings).counts, samples)

    def choice(self, samples: Samples, settings: Sequence[Setting]) -> CheapestChoice:
        """The selected settings, and what is guaranteed about them.

        Args:
            samples: As for ``wanted``.
            settings: The design points.

        Raises:
            ValueError: If there is no design point, or one has fewer than ``first`` missions.
        """
        check_begun(samples, self.first)
        search = _Search(self, samples, settings)
        return CheapestChoice(
            counts=based_on(search.counts, samples),
            rounds=search.rounds,
            done=search.done,
            guarantee=self._guarantee(search),
            answers=tuple(question.answer for question in search.questions),
            verdicts=tuple(search.verdicts),
            enough=self._enough(search),
        )

    def shown(self, policies: int = 1) -> float:
        """The confidence that what was found to meet the requirements does, over all policies."""
        return 1 - policies * (1 - self.confidence) / 2

    def _enough(self, search: "_Search") -> int | None:
        """About how many missions would settle all questions, if all were like those so far.

        The search goes on with the same missions again and again.
        """
        if not search.done or all(question.settled for question in search.questions):
            return None
        endless, names = self.model_copy(update={"budget": MOST}), ["cost", *self.requirements]
        points = [*zip(search.samples, search.counts, strict=True)]
        times = 2
        while times <= FURTHER and times * search.counts.sum() <= MOST_FURTHER:
            again = [{m: np.tile(of[m][:n], times) for m in names} for of, n in points]
            further = _Search(endless, again, search.settings)
            if further.done:
                return int(further.counts.sum())
            times *= 2
        return None

    def _guarantee(self, search: "_Search") -> str:
        if not search.done:
            return "none yet: the procedure needs more missions"
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


# The kinds of selection that a study may use.
AnySelection = Annotated[
    Selection | Cheapest,
    Field(discriminator="procedure"),
    of_its_kind("procedure", Selection, Cheapest),
]


class _Search:
    """The procedure, carried out as far as the simulated missions allow.

    Attributes:
        counts: (k,) missions that each point needs so far.
        verdicts: For each point, whether it meets the requirements.
        questions: All questions.
        rounds: Number of rounds carried out.
        done: Whether no more missions are needed: all questions are settled or the budget is spent.
    """

    def __init__(self, rule: Cheapest, samples: Samples, settings: Sequence[Setting]):
        self.rule, self.samples, self.settings = rule, samples, settings
        self.counts = np.full(len(samples), rule.first)
        self.verdicts: list[Verdict] = ["open"] * len(samples)
        self.questions = questions_about([setting.values for setting in settings])
        self.rounds, self.done = 1, False
        self._error = (1 - rule.confidence) / 2
        each = self._error / (len(samples) * len(rule.requirements))
        self._tests = [
            {m: MeanTest(q, rule.tolerance, each) for m, q in rule.requirements.items()}
            for _ in samples
        ]
        self._pairs = max(sum(question.pairs for question in self.questions), 1)
        self._seen = 0  # missions taken into account, at each point that a question still needs
        self._play()

    def _leader(
        self, error: float, candidates: np.ndarray, feasible: np.ndarray
    ) -> tuple[int, np.ndarray]:
        """The feasible candidate with the lowest mean cost, and how much more it may cost."""
        n = self._seen
        costs = np.array(
            [[self.samples[p]["cost"][:n] for p in points] for points in candidates], float
        ).mean(axis=1)
        leader = int(np.argmin(np.where(feasible, costs.mean(axis=1), np.inf)))
        excess = costs[leader] - costs
        loss = np.mean([self.settings[p].loss for p in candidates[leader]])
        widths = float(stdtrit(n - 1, 1 - error)) * excess.std(axis=1, ddof=1) / np.sqrt(n)
        widths -= loss * np.log(error) / n
        widths[leader] = 0.0
        return leader, excess.mean(axis=1) + widths

    def _play(self) -> None:
        needed = [*range(len(self.samples))]
        while all(len(self.samples[p]["cost"]) >= self.counts[p] for p in needed):
            stage = int(self.counts.max())
            self._test(needed, stage)
            error = self._error / (self._pairs * self.rounds * (self.rounds + 1))
            costs = partial(self._leader, error)
            for question in self.questions:
                if not question.settled:
                    question.look(self.verdicts, costs, self.rule.indifference)
            needed = sorted(set().union(*(question.needed for question in self.questions)))
            room = self.rule.budget - int(self.counts.sum())
            step = min(stage // 2, room // len(needed)) if needed else 0
            if step < 1:
                self.done = True
                return
            self.counts[needed] += step
            self.rounds += 1

    def _test(self, points: Sequence[int], stage: int) -> None:
        """Test the requirements of points on their first ``stage`` missions.

        The verdict on all requirements together is missed if one is missed, met if all are met.
        """
        for point in points:
            if self.verdicts[point] != "open":
                continue
            for metric, test in self._tests[point].items():
                test.observe(np.asarray(self.samples[point][metric][self._seen : stage], float))
            found = {test.verdict for test in self._tests[point].values()}
            self.verdicts[point] = min(found, key=["missed", "open", "met"].index)
        self._seen = stage


def _in_words(requirements: Mapping[Share, float], shift: float) -> str:
    """The requirements in words, such as ``a mean success of at least 0.985``."""
    means = [
        f"{metric.replace('_', ' ')} of at least {least + shift:g}"
        for metric, least in requirements.items()
    ]
    return f"a mean {' and a mean '.join(means)}"
