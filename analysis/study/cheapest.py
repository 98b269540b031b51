"""The cheapest fleet that meets its requirements: the search for it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, field_validator, model_validator
from scipy.special import stdtrit

from dess import InputError
from dess.analysis import numbers
from dess.analysis.metrics import (
    AGE,
    LATE,
    LEAST,
    NODES_BEHIND,
    OLDEST,
    PRODUCT,
    RATIO,
    column_in_sheet_unit,
    metric_of,
    size_of,
)
from dess.analysis.stats.betting import MeanTest, RequirementTest, WorstNodeTest, YearsTest
from dess.analysis.stats.verdict import Verdict
from dess.analysis.study.candidates import CheapestSetting, Points, questions_about
from dess.analysis.study.prices import Costs
from dess.analysis.study.selection import Chosen, Selection, based_on, check_begun, missions_needed
from dess.analysis.study.stopping import MOST_MISSIONS, Line, Samples, StrictTable, of_its_kind
from dess.base.errors import shown
from dess.physics.section import Integer, Number
from dess.scenario.fields import is_number
from dess.scenario.quantities import quantity_of
from dess.scenario.scenario import ScenarioSpace

# A round adds this share to the missions of each design point that needs more.
GROWTH = 0.5
# How much longer a search may take for which it is estimated: times its missions, and missions.
FURTHER, MOST_FURTHER = 64, 10_000_000

Required = Literal[
    "success",
    "collection_ratio",
    "collection_ratio_and_communication",
    "age",
    "least",
    "oldest",
    "late",
]
_AGES = (AGE, OLDEST)
_OF_NODES = (LEAST, OLDEST)
# What tends to 1 in a year, and what only years measure.
_NOT_OF_YEARS = (RATIO, PRODUCT, LEAST)
_OF_YEARS = (LATE,)


class Setting(NamedTuple):
    """A design point of a study with prices.

    Attributes:
        values: The fields that the design sets.
        loss: The cost over all missions if every mission lost all UAVs, in the currency.
        horizon: What tolerances of ages are shares of (``horizon_of``).
        currency: What costs are in: a currency, or a currency a year.
        is_of_years: Whether its replications are years with weather.
    """

    values: Mapping[str, Any]
    loss: float
    horizon: float = 1.0
    currency: str = Costs.model_fields["currency"].default
    is_of_years: bool = False

    @classmethod
    def of(cls, values: Mapping[str, Any], space: ScenarioSpace, costs: Costs) -> Self:
        """The setting of a design point."""
        loss = costs.loss_of_fleets(space)
        return cls(values, loss, horizon_of(space), costs.unit, space.weather.is_on)


def horizon_of(space: ScenarioSpace) -> float:
    """What tolerances of ages are shares of: the largest age in a mission, or a day in years.

    Returns:
        It is in hours with a data sheet, otherwise in slots.
    """
    if space.weather.is_on:
        return 24.0
    return (space.max_slots + space.idle_slots) * (size_of("h", space.units) if space.units else 1)


def as_share(metric: str, value: Any, horizon: float) -> Any:
    """Values of a metric as shares of which more is better: an age as what is left of the horizon,
    late data as those that are not.

    Args:
        metric: What is required.
        value: A value, or an array of values.
        horizon: The largest age.
    """
    if metric in _AGES:
        return 1 - value / horizon
    if metric == LATE:
        return 1 - value
    return value


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

    answers: tuple[CheapestSetting, ...]
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
    requirements: dict[Required, Number | Line] = Field(
        min_length=1,
        description="metric -> its least mean; of an age the largest, with a data sheet in a unit",
    )
    tolerance: Number = Field(
        0.005,
        ge=1e-6,
        le=0.5,
        description="half-width of the zone in which either verdict is acceptable; of age a share "
        "of the horizon and the idle time",
    )
    indifference: Number = Field(
        ge=1e-9, le=10**15, description="the least saving that matters, in the currency"
    )
    first: Integer = Field(
        20, ge=2, le=MOST_MISSIONS, description="missions of every design point in round one"
    )
    confidence: Number = Field(
        0.95, gt=0.5, le=0.999_999, description="probability that all statements hold"
    )
    budget: Integer = Field(
        100_000, ge=2, le=MOST_MISSIONS, description="missions over all design points at most"
    )
    check: Integer = Field(
        300,
        ge=0,
        le=MOST_MISSIONS,
        description="further, independent missions of every selected point",
    )

    @field_validator("requirements", mode="before")
    @classmethod
    def _are_amounts(cls, given: Any) -> Any:
        for metric, amount in given.items() if isinstance(given, dict) else ():
            if not is_number(amount) and not (metric in _AGES and isinstance(amount, str)):
                form = 'a number, or of an age a time such as "6 h"'
                raise InputError("", f"{metric} is {shown(amount)}", form)
        return given

    @model_validator(mode="after")
    def _are_shares(self) -> Self:
        for metric, least in self.requirements.items():
            share = 0.0
            if not isinstance(least, str):
                share = least
            if metric not in _AGES and not self.tolerance < share < 1 - self.tolerance:
                raise InputError(
                    f"requirements.{metric}",
                    f"{shown(least)} is out of range",
                    f"between {self.tolerance:g} and {1 - self.tolerance:g}, which keeps the "
                    "tolerance away from 0 and 1",
                )
        return self

    def amount(self, metric: Required) -> float:
        """What is required of a metric; of an age in hours if it has a unit, otherwise in slots.

        Raises:
            InputError: If it has another unit than one of time.
        """
        required = self.requirements[metric]
        if isinstance(required, str):
            return quantity_of(required, f"requirements.{metric}", "s") / 3600
        return float(required)

    def check_requirements(self, spaces: Sequence[ScenarioSpace]) -> None:
        """Check that scenarios measure what is required, and that ages fit to them.

        Raises:
            InputError: If a scenario does not measure something, or an age has no unit where there
                is a data sheet, or cannot be missed.
        """
        for metric in self.requirements:
            for space in spaces:
                where = f"requirements.{metric}"
                if metric in _NOT_OF_YEARS and space.weather.is_on:
                    raise InputError(where, "tends to 1 in a year", "age, oldest, late or success")
                if metric in _OF_YEARS and not space.weather.is_on:
                    raise InputError(where, "is not measured", "a scenario with weather")
                if metric in _OF_NODES and not space.units:
                    raise InputError(
                        f"requirements.{metric}", "is not measured", "a scenario with a data sheet"
                    )
                if metric in _AGES:
                    self._check_age(metric, space)

    def _check_age(self, metric: Required, space: ScenarioSpace) -> None:
        where = f"requirements.{metric}"
        required = self.requirements[metric]
        horizon = horizon_of(space)
        share = self.amount(metric) / horizon
        has_unit = isinstance(required, str)
        if space.weather.is_on:
            if not has_unit or share <= self.tolerance:
                raise InputError(where, f"{shown(required)} does not fit", 'a time such as "6 h"')
            return
        if not self.tolerance < share < 1 - self.tolerance or has_unit != bool(space.units):
            if space.units:
                allowed = f'a time such as "6 h" in the horizon of {horizon:g} h'
            else:
                allowed = f"mission slots in the horizon of {horizon:g}"
            raise InputError(where, f"{shown(required)} does not fit", allowed)
        if metric == AGE and not space.age.measured:
            raise InputError(where, "is not measured", "age.measured = true")

    def wanted(self, samples: Samples, settings: Sequence[Setting]) -> list[int]:
        """The number of missions that every design point needs.

        Args:
            samples: The missions of every design point, with ``cost`` among the metrics.
            settings: The design points.

        Returns:
            For each design point at least the n missions given; exactly n if no more are needed.
        """
        return missions_needed(_Search(self, samples, settings).points.counts, samples)

    def choice(self, samples: Samples, settings: Sequence[Setting]) -> CheapestChoice:
        """The selected settings, and what is guaranteed about them.

        Args:
            samples: The missions of every design point, with ``cost`` among the metrics.
            settings: The design points.

        Raises:
            InputError: If there is no design point, or one has fewer than ``first`` missions.
        """
        check_begun(samples, self.first)
        search = _Search(self, samples, settings)
        return CheapestChoice(
            counts=based_on(search.points.counts, samples),
            analyses=tuple(search.points.analyses.tolist()),
            rounds=search.rounds,
            done=search.done,
            guarantee=self._guarantee(search),
            answers=tuple(question.answer for question in search.questions),
            verdicts=tuple(search.points.verdicts),
            enough=self._enough(search),
        )

    def of_years(self, years: int, points: int) -> Self:
        """The rule where every one of so many points has all of so many years at once.

        Raises:
            InputError: If the years are too few.
        """
        if years < 2:
            raise InputError("years", f"{years} is too few", "2 or more, for a selection")
        return self.model_copy(update={"first": years, "budget": years * points, "check": 0})

    def for_pages(self) -> dict[str, float]:
        """The rule as data for scripts, which spend the missions of a grid by it."""
        return {
            "first": self.first,
            "growth": GROWTH,
            "budget": self.budget,
            "error": 1 - self.confidence,
            "indifference": self.indifference,
        }

    def shown(self, policies: int = 1) -> float:
        """The confidence that what was found to meet the requirements does, over all policies."""
        return 1 - policies * (1 - self.confidence) / 2

    def _enough(self, search: "_Search") -> int | None:
        """About how many missions would settle all questions, if all were like those so far.

        The search goes on with the same missions again and again.
        """
        if not search.done or all(question.settled for question in search.questions):
            return None
        endless = self.model_copy(update={"budget": MOST_MISSIONS})
        names = [
            "cost",
            *(_column_of(metric, search.samples[0]) for metric in self.requirements),
        ]
        points = [*zip(search.samples, search.points.counts, strict=True)]
        times = 2
        while times <= FURTHER and times * search.points.counts.sum() <= MOST_FURTHER:
            again = [{m: np.tile(sample[m][:n], times) for m in names} for sample, n in points]
            further = _Search(endless, again, search.settings)
            if further.done:
                return int(further.points.counts.sum())
            times *= 2
        return None

    def _guarantee(self, search: "_Search") -> str:
        if not search.done:
            return "none yet: the procedure needs more missions"
        is_of_years = search.settings[0].is_of_years
        ends = (-self.tolerance, self.tolerance)
        low, high = (self._in_words(shift, is_of_years) for shift in ends)
        saving = numbers.format_money(self.indifference, search.settings[0].currency)
        words = (
            f"for each policy by itself, three statements hold together with a probability of at "
            f"least {self.confidence:g}. Each setting that is said to meet the requirements has "
            f"{low}. No setting that is said to miss them has {high}. The selected setting costs "
            f"at most {saving} more than any that has {high}. The statement on costs takes "
            "the differences of costs as nearly normal, apart from the losses of UAVs; where a "
            f"rare {'year' if is_of_years else 'mission'} is much more expensive than the others, "
            "it holds less often"
        )
        if all(question.answer.settled for question in search.questions):
            return words
        if is_of_years:
            return f"{words}; the years of the study ended before all was decided"
        return f"{words}; the budget of {self.budget} missions ended before all was decided"

    def _in_words(self, shift: float, is_of_years: bool) -> str:
        """The requirements in words, such as ``a mean success of at least 0.985``."""
        whole = "days" if is_of_years else "horizons"
        sign = "-" if shift > 0 else "+"
        means = []
        for metric, amount in self.requirements.items():
            name = metric.replace("_", " ")
            if metric in _OF_NODES:
                name = metric_of(metric).within
            if metric == LATE and not isinstance(amount, str):
                means.append(f"share of late data of at most {amount - shift:g}")
            elif metric in _AGES or isinstance(amount, str):
                means.append(f"{name} of at most {amount} {sign} {abs(shift):g} {whole}")
            else:
                means.append(f"{name} of at least {amount + shift:g}")
        return f"a mean {' and a mean '.join(means)}"


# The kinds of selection that a study may use.
AnySelection = Annotated[
    Selection | Cheapest,
    Field(discriminator="procedure"),
    of_its_kind("procedure", Selection, Cheapest),
]


def _kind_of_test(metric: str, setting: Setting) -> type[RequirementTest]:
    """How a requirement of a setting is tested."""
    if setting.is_of_years:
        return YearsTest
    if metric in _OF_NODES:
        return WorstNodeTest
    return MeanTest


def _column_of(metric: str, sample: Mapping[str, np.ndarray]) -> str:
    """The column of missions that a requirement is tested on: of a node those of all nodes."""
    column = column_in_sheet_unit(metric, sample)
    return NODES_BEHIND.get(column, column)


def _values_of(metric: str, sample: Mapping[str, np.ndarray]) -> np.ndarray:
    """The (n,) values of a requirement; of a node the (n, K) ones of all nodes."""
    values = sample[_column_of(metric, sample)]
    if metric in _OF_NODES:
        return np.stack([*values])
    return np.asarray(values, float)


class _Search:
    """The procedure, carried out as far as the simulated missions allow.

    Attributes:
        points: What is known of the design points.
        questions: All questions.
        rounds: Number of rounds carried out.
        done: Whether no more missions are needed: all questions are settled or the budget is spent.
    """

    def __init__(self, rule: Cheapest, samples: Samples, settings: Sequence[Setting]):
        self.rule = rule
        self.samples = samples
        self.settings = settings
        self.points = Points(len(samples), rule.first)
        self.questions = questions_about([setting.values for setting in settings])
        self.rounds, self.done = 1, False
        self._error = (1 - rule.confidence) / 2
        error_of_test = self._error / (len(samples) * len(rule.requirements))
        self._tests = [
            {
                m: _kind_of_test(m, s)(
                    as_share(m, rule.amount(m), s.horizon), rule.tolerance, error_of_test
                )
                for m in rule.requirements
            }
            for s in settings
        ]
        self._pairs = max(sum(question.pairs for question in self.questions), 1)
        self._play()

    def _excess(self, candidates: np.ndarray, leader: int) -> np.ndarray:
        """How much more a candidate costs at most than each, by the missions that both have.

        There is an error for each number of these missions, of which there is one per analysis.
        """
        loss = np.mean([self.settings[p].loss for p in candidates[leader]])
        bounds = np.zeros(len(candidates))
        for number, candidate in enumerate(candidates):
            if number == leader:
                continue
            both = [*candidate, *candidates[leader]]
            n = int(self.points.counts[both].min())
            analyses = int(self.points.analyses[both].min())
            error = self._error / (self._pairs * analyses * (analyses + 1))
            costs, least = (
                np.mean([self.samples[p]["cost"][:n] for p in point], axis=0)
                for point in (candidate, candidates[leader])
            )
            excess = least - costs
            width = float(stdtrit(n - 1, 1 - error)) * excess.std(ddof=1) / np.sqrt(n)
            bounds[number] = excess.mean() + width - loss * np.log(error) / n
        return bounds

    def _play(self) -> None:
        points = self.points
        needed = [*range(len(self.samples))]
        while all(len(self.samples[p]["cost"]) >= points.counts[p] for p in needed):
            for point in needed:
                self._test(point)
            for question in self.questions:
                if not question.settled:
                    question.look(points, self._excess, self.rule.indifference)
            needed = sorted(set().union(*(question.needed for question in self.questions)))
            room = self.rule.budget - int(points.counts.sum())
            steps = (GROWTH * points.counts[needed]).astype(int)
            if steps.sum() > room:
                steps = np.minimum(steps, room // len(needed))
            if not steps.any():
                self.done = True
                return
            points.counts[needed] += steps
            points.analyses[needed] += 1
            self.rounds += 1

    def _test(self, point: int) -> None:
        """Test the requirements of a point on its missions.

        The verdict on all requirements together is missed if one is missed, met if all are met.
        """
        points = self.points
        sample = self.samples[point]
        count = points.counts[point]
        horizon = self.settings[point].horizon
        points.costs[point] = np.mean(sample["cost"][:count])
        points.promising[point] = True
        for metric, test in self._tests[point].items():
            values = _values_of(metric, sample)[:count]
            shares = as_share(metric, values, horizon)
            test.observe(shares[test.missions :])
            points.promising[point] &= shares.mean(axis=0).min() >= test.required
        tests = self._tests[point].values()
        points.verdicts[point] = Verdict.of_all(test.verdict for test in tests)
