"""Ranking and selection: find the best of many design points, at the points where it is undecided.

Two procedures find the largest mean of a metric over k points; on a tie, the point with the lowest
number is selected.

``kn`` is the fully sequential procedure of Kim and Nelson. It finds the best point with a
guaranteed probability if that point is better than every other one by the indifference or more. Let
delta be the indifference, 1 - alpha the confidence, n0 = ``first``, c = 1, X_i(r) the mean of the
first r missions of point i, and S2_il the sample variance of the differences between the first n0
missions of i and l:
    eta = ((2 alpha / (k - 1))^(-2 / (n0 - 1)) - 1) / 2,    h2 = 2 c eta (n0 - 1)
    W_il(r) = max(0, delta / (2 c r) (h2 S2_il / delta^2 - r))
At every stage r = n0, n0 + 1, ... point i is ruled out if X_i(r) < X_l(r) - W_il(r) for a point l
that was not ruled out before the stage. The procedure ends when one point is left, or when r is
more than h2 S2_il / delta^2 for all pairs that are left. It uses the variances of differences and
adds the errors up (Bonferroni). So it is valid under common random numbers, and needs fewer
missions with them. It assumes normal values. Where missions fail rarely, all of the first n0
missions may succeed, so that their variance is too small; then the guarantee does not hold, so
success and product are refused.

``kn-bounded`` is the same procedure for metrics between 0 and 1 with rare failures. The variances
are estimated from all missions so far, again whenever r has grown by half (as in Kim and Nelson's
KN++, whose guarantee is asymptotic). The margin W_il(r) is widened by the term
    2 ln((k - 1) / alpha) / (3 r)
of Bernstein's inequality for events that have not been observed yet, since no difference is further
than 2 from its mean. This takes more missions: a point whose mean is lower by g is ruled out only
after about 2 ln((k - 1) / alpha) / (3 g) missions.

Sources:
    S.-H. Kim, B. L. Nelson, A fully sequential procedure for indifference-zone selection in
    simulation, ACM TOMACS 11 (2001) 251-273.
    S.-H. Kim, B. L. Nelson, On the asymptotic validity of fully sequential selection procedures
    for steady-state simulation, Oper. Res. 54 (2006) 475-488.
    S. Boucheron, G. Lugosi, P. Massart, Concentration inequalities, Oxford 2013, section 2.8.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dess import InputError
from dess.analysis.metrics import NODES_BEHIND, PRODUCT, SUCCESS, metric_of
from dess.analysis.study.stopping import MOST_MISSIONS, MetricName, Samples, StrictTable, values_in
from dess.physics.section import Integer, Number

# Number of stages whose sums are computed together; it does not change any result.
_BLOCK = 128


@dataclass(frozen=True)
class Chosen:
    """What the results of all rules of selection have.

    Attributes:
        counts: Number of missions per design point that the selection is based on.
        analyses: Number of interim analyses per design point: of rounds after which it could have
            got no more missions.
        rounds: Number of rounds of simulation.
        done: Whether the procedure needs no more missions.
        guarantee: What is guaranteed about the selection, in words.
    """

    counts: tuple[int, ...]
    analyses: tuple[int, ...]
    rounds: int
    done: bool
    guarantee: str

    @property
    def missions(self) -> int:
        """Number of all missions."""
        return sum(self.counts)


@dataclass(frozen=True)
class Choice(Chosen):
    """The result of a selection.

    Attributes:
        best: Number of the selected design point.
        survivors: The points that were not ruled out, the selected one included.
        guaranteed: Whether the guarantee is a probability (and not that the budget has ended).
        stage: Number of missions of the selected point when the selection ended.
    """

    best: int
    survivors: tuple[int, ...]
    guaranteed: bool
    stage: int

    @property
    def selected(self) -> int:
        """The selected design point, as a manifest has it."""
        return self.best


def missions_needed(counts: np.ndarray, samples: Samples) -> list[int]:
    """How many missions design points need, if those that they have are kept."""
    return [max(missions_of(s), int(n)) for s, n in zip(samples, counts, strict=True)]


def based_on(counts: np.ndarray, samples: Samples) -> tuple[int, ...]:
    """On how many of their missions a choice is based, which needs these counts."""
    return tuple(min(missions_of(s), int(n)) for s, n in zip(samples, counts, strict=True))


def missions_of(sample: Mapping[str, np.ndarray]) -> int:
    """The number of missions of a design point."""
    return len(next(iter(sample.values())))


def check_begun(samples: Samples, first: int) -> None:
    """Refuse samples without the missions of the first round.

    Raises:
        InputError: If there is no design point, or one has fewer than ``first`` missions.
    """
    if not samples or min(map(missions_of, samples)) < first:
        raise InputError("choice", "a point lacks missions", f"{first} or more of each")


class Selection(StrictTable):
    """The rule that missions are added until the best of the design points is found.

    Missions are simulated in rounds of growing size. How many are needed is computed by repeating
    all rounds on the values, in the order of their replications. So the result is the same, whether
    or not a run was interrupted, and ``kn`` decides as if the missions came one by one.

    Raises:
        pydantic.ValidationError: If a field is not valid.
    """

    procedure: Literal["kn", "kn-bounded"] = Field(
        description="kn-bounded: for metrics between 0 and 1 with rare failures; kn: for others"
    )
    metric: MetricName = Field(
        "collection_ratio_and_communication", description="the best has its best mean"
    )
    first: Integer = Field(
        20, ge=2, le=MOST_MISSIONS, description="missions of every design point in round one"
    )
    indifference: Number = Field(
        ge=1e-9, le=10**9, description="the least lead of the best that matters"
    )
    confidence: Number = Field(0.95, gt=0.5, le=0.999_999, description="probability of finding it")
    budget: Integer = Field(
        100_000, ge=2, le=MOST_MISSIONS, description="missions over all design points at most"
    )
    check: Integer = Field(
        300,
        ge=0,
        le=MOST_MISSIONS,
        description="further, independent missions of the selected design point",
    )

    @model_validator(mode="after")
    def _fits_the_procedure(self) -> Self:
        if self.metric in NODES_BEHIND:
            raise InputError(
                "metric",
                f"{self.metric} is of the node that is worst over all missions, not of a mission",
                "a metric of every mission, or procedure cheapest that requires it",
            )
        if self.procedure == "kn-bounded" and not metric_of(self.metric).is_bounded:
            raise InputError("metric", f"{self.metric} is not bounded", "procedure kn with it")
        if self.procedure == "kn" and self.metric in (SUCCESS, PRODUCT):
            raise InputError(
                "metric",
                f"{self.metric} falls to 0 in rare failures, for which kn guarantees nothing",
                "procedure kn-bounded with it",
            )
        return self

    def wanted(self, samples: Samples, settings: Sequence[Any] = ()) -> list[int]:
        """The number of missions that every design point needs.

        Args:
            samples: The missions of every design point.
            settings: The design points; this rule does not need them.

        Returns:
            For each design point at least the n missions given; exactly n if no more are needed.
        """
        return missions_needed(_Race(self, self._values(samples)).counts, samples)

    def choice(self, samples: Samples, settings: Sequence[Any] = ()) -> Choice:
        """The selected design point, and what is guaranteed about it.

        Args:
            samples: The missions of every design point.
            settings: The design points; this rule does not need them.

        Raises:
            InputError: If there is no design point, or one has fewer than ``first`` missions.
        """
        check_begun(samples, self.first)
        race = _Race(self, self._values(samples))
        return Choice(
            counts=based_on(race.counts, samples),
            analyses=tuple(race.analyses.tolist()),
            rounds=race.rounds,
            done=race.done,
            guarantee=self._guarantee(race),
            best=race.best,
            survivors=tuple(map(int, race.alive)),
            guaranteed=race.over,
            stage=race.stage,
        )

    def _values(self, samples: Samples) -> list[np.ndarray]:
        """The values of the metric, negative if less is better: the best has the largest mean."""
        by_point = [values_in(sample, self.metric) for sample in samples]
        if any(np.isnan(values).any() for values in by_point):
            raise InputError(
                "selection.metric",
                f"{self.metric} is not measured in some missions",
                "a metric that every mission has",
            )
        sign = 1.0
        if metric_of(self.metric).less_is_better:
            sign = -1.0
        return [sign * values for values in by_point]

    def _guarantee(self, race: "_Race") -> str:
        if len(race.values) == 1:
            return "it is the only design point"
        if not race.done:
            return "none yet: the procedure needs more missions"
        left = len(race.alive)
        if not race.over:
            return (
                f"none: the budget of {self.budget} missions ended with {left} design points left;"
                " this one has the best mean of them"
            )
        if left == 1:
            what = "it is the best"
        else:
            what = f"the best is among {left} that tie, it included"
        if left == 1:
            others = "every other"
        else:
            others = "those ruled out"
        if self.procedure == "kn":
            least = "at least"
        else:
            least = "about or above"
        return (
            f"with probability {least} {self.confidence:g} {what}, if the best is better than "
            f"{others} by {self.indifference:g} or more"
        )


def _grow_count(count: int) -> int:
    return count + max(count // 2, 1)


def _variances_of_differences(values: np.ndarray) -> np.ndarray:
    """(s, s) sample variances of the differences between the rows of (s, n) values."""
    centred = values - values.mean(axis=1, keepdims=True)
    # Not a matrix product: its last bits would depend on the number of threads.
    covariances = np.einsum("in,ln->il", centred, centred) / (values.shape[1] - 1)
    variances = np.diagonal(covariances)
    return np.maximum(variances[:, None] + variances - 2 * covariances, 0.0)


class _Race:
    """The procedure of Kim and Nelson, carried out as far as the simulated missions allow.

    Attributes:
        values: For each design point its values. Nothing is done before all points have the
            missions of the first round.
        counts: (k,) missions that each point needs so far.
        analyses: (k,) the number of rounds for which each had missions.
        alive: The points that are not ruled out, in order.
        stage: The last stage carried out.
        rounds: Number of rounds carried out.
        over: Whether the procedure has decided.
        done: Whether no more missions are needed: it has decided, or the budget is spent.
    """

    def __init__(self, rule: Selection, values: list[np.ndarray]):
        self.rule = rule
        self.values = values
        self.is_bounded = rule.procedure == "kn-bounded"
        self.counts = np.full(len(values), rule.first)
        self.analyses = np.ones(len(values), int)
        self.alive = np.arange(len(values))
        self.stage = rule.first - 1
        self.rounds = 1
        self.over = self.done = False
        if self._has_missions():
            # Sums are taken mission by mission: no result depends on the rounds.
            self.sums = np.cumsum(self._missions(0, rule.first), axis=1)[:, -2]
            self._renew_margins(rule.first)
            self._play()

    @property
    def best(self) -> int:
        """The point with the best mean."""
        return int(self.alive[np.argmax(self.sums)])

    def _has_missions(self) -> bool:
        """Whether all missions that are needed so far are present."""
        return all(len(sample) >= n for sample, n in zip(self.values, self.counts, strict=True))

    def _missions(self, begin: int, end: int) -> np.ndarray:
        """The (s, n) values of the points that are not ruled out."""
        return np.array([self.values[i][begin:end] for i in self.alive])

    def _play(self) -> None:
        """Carry out rounds until there is a decision, or the budget or the missions end."""
        while self._has_missions():
            target = int(self.counts.max())
            while self.stage < target and not self.over:
                self._run_block(int(min(self.stage + _BLOCK, target, self.renewal)))
                if self.stage == self.renewal:
                    self._renew_margins(self.stage)
            last_stage = int(self.reach.max()) + 1  # by the variances known
            step = min(
                _grow_count(target) - target,
                max(last_stage - target, 1),
                (self.rule.budget - int(self.counts.sum())) // len(self.alive),
            )
            if self.over or step < 1:
                self.done = True
                return
            self.counts[self.alive] += step
            self.analyses[self.alive] += 1
            self.rounds += 1

    def _renew_margins(self, stage: int) -> None:
        """Estimate the variances from all missions up to a stage, and say when to do so again.

        ``reach`` has the stages from which the margins of all pairs are zero, h2 S2_il / delta^2:
        (s, s), of no meaning on the diagonal.
        """
        self.renewal = np.inf
        if self.is_bounded:
            self.renewal = _grow_count(stage)
        points = len(self.values)
        first = self.rule.first
        delta = self.rule.indifference
        if points == 1:
            self.reach = np.zeros((1, 1))
            return
        odds = (points - 1) / (1 - self.rule.confidence)
        h2 = ((odds / 2) ** (2 / (first - 1)) - 1) * (first - 1)
        self.reach = h2 * _variances_of_differences(self._missions(0, stage)) / delta**2
        if self.is_bounded:
            self.reach += 4 * np.log(odds) / (3 * delta)

    def _margins(self, reach: np.ndarray, stage: int) -> np.ndarray:
        """The margin W at a stage: by how much a mean must be below another one to be ruled out."""
        return np.maximum(0.0, self.rule.indifference / (2 * stage) * (reach - stage))

    def _run_block(self, end: int) -> None:
        begin = self.stage
        block = np.column_stack([self.sums, self._missions(begin, end)])
        sums = np.cumsum(block, axis=1)[:, 1:]
        diagonal = np.eye(len(self.alive), dtype=bool)
        tightest = np.where(diagonal, np.inf, self.reach).min(axis=1)
        left = np.ones(len(self.alive), bool)
        for stage in range(begin + 1, end + 1):
            means = np.where(left, sums[:, stage - begin - 1] / stage, -np.inf)
            # Compare only those points that the best point could rule out by their smallest margin.
            close = means.max() - self._margins(tightest, stage)
            behind = np.flatnonzero(left & (means < close))
            if behind.size:
                bars = means - self._margins(self.reach[behind], stage)
                left[behind] = means[behind] >= bars.max(axis=1)
            self.stage = stage
            self.over = self._ends(means, left)
            if self.over:
                break
        self.alive = self.alive[left]
        self.sums = sums[left, self.stage - begin - 1]
        self.reach = self.reach[np.ix_(left, left)]

    def _ends(self, means: np.ndarray, left: np.ndarray) -> bool:
        """Whether one point is left, or several points that no later stage can tell apart."""
        if np.count_nonzero(left) == 1:
            return True
        if np.ptp(means[left]) > 0:  # then the margin between them is above zero
            return False
        return bool(self.reach[np.ix_(left, left)].max() < self.stage)
