"""What claims are judged by: the results of one policy, study by study, and figures of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd

from analysis.questions import learning as curves
from analysis.questions import main_effects as effects
from analysis.questions import summary as findings
from analysis.results.resimulate import Flight, fly
from analysis.results.tables import Results
from analysis.stats.intervals import Interval, mean_interval, summary, wilson

Unit = Literal["share", "points", "reward", "steps", "number"]


class Quantity(NamedTuple):
    """A figure, with its interval if it has one.

    Attributes:
        value: The figure, in its unit.
        low: Lower end of its interval, or none.
        high: Upper end.
        n: Number of missions, or trainings, that it is from; 0 if none are counted.
        unit: A ``share``; ``points``, a difference of shares; a ``reward``; training ``steps``; or
            a ``number``.
        name: What it is, where the claim does not say so.
    """

    value: float
    low: float | None = None
    high: float | None = None
    n: int = 0
    unit: Unit = "share"
    name: str = ""

    @property
    def interval(self) -> Interval:
        """Value and ends; degenerate where it has none."""
        low = self.value if self.low is None else self.low
        return Interval(self.value, low, self.value if self.high is None else self.high)


@dataclass(frozen=True)
class Finding:
    """What the results of a policy say of a claim.

    Attributes:
        verdict: One of ``claims.VERDICTS``.
        policy: The policy; empty where it is about trainings of another.
        quantities: The figures that it rests on; the first is the one to set beside the paper's.
        against: How its interval lies to the printed figure, as by ``paper.verdict``; empty if
            none is printed.
        note: More of it in words, or why there are no results.
    """

    verdict: str
    policy: str = ""
    quantities: tuple[Quantity, ...] = ()
    against: str = ""
    note: str = ""


class MissingError(Exception):
    """Results that a claim needs are not there."""


class Studies:
    """All results, and what is computed from them once for all policies."""

    def __init__(self, results: Mapping[str, Results], trainings: pd.DataFrame, flights: int):
        self.results = results
        self.trainings = trainings
        self.flights = flights
        self.effects = cache(lambda study: effects.effects(self.study(study)))
        self.curves = cache(lambda metric: curves.smoothed(trainings, metric))

    def study(self, name: str) -> Results:
        """The results of a study."""
        if name not in self.results:
            raise MissingError(f"the study {name} has not run")
        return self.results[name]


class Pairs(NamedTuple):
    """The values of a parameter, compared with each other.

    Attributes:
        table: As of ``effects.changes``.
        places: Position of every value, by its words.
    """

    table: pd.DataFrame
    places: Mapping[str, int]

    def place(self, value: str) -> int:
        """The position of a value."""
        if value not in self.places:
            raise MissingError(f"the study lacks the value {value}")
        return self.places[value]

    def leads(self, value: str) -> pd.DataFrame:
        """By how much the metric is higher at a value than at every other (``other``)."""
        position = self.place(value)
        behind = upside_down(self.table[self.table["first"] == position])
        before = self.table[self.table["second"] == position]
        return pd.concat(
            [before.assign(other=before["first"]), behind.assign(other=behind["second"])]
        )

    def change(self, first: str, second: str) -> Quantity:
        """How much the metric changes from one value to another."""
        leads = self.leads(second).set_index("other")
        return points(leads.loc[self.place(first)])

    def reversed(self) -> "Pairs":
        """The same of the metric's negative: what is lowest is highest."""
        return Pairs(upside_down(self.table), self.places)


class Case:
    """The results of one policy per study, and of trainings with and without transfer learning.

    Args:
        studies: All results.
        learners: Names of learners, the preferred one first; empty for the best one of the study.
        variants: The trainings with transfer learning, and those without; none if there are none.
        named: A policy to take instead, whatever it is.
    """

    def __init__(
        self,
        studies: Studies,
        learners: tuple[str, ...] = (),
        variants: tuple[str, str] | None = None,
        named: str = "",
    ):
        self.studies = studies
        self.learners = learners
        self.variants = variants
        self.named = named
        self.pairs = cache(self._pairs)
        self.flights = cache(self._flights)

    def policy(self, study: str) -> str:
        """The policy of a study: the best of the learners in question."""
        if self.named:
            return self.named
        taught = findings.learners(self.studies.study(study))
        wanted = [name for name in self.learners if name in taught][:1] if self.learners else taught
        among = [policy for name in wanted for policy in taught[name]]
        if not among:
            which = f"policy {' or '.join(self.learners)}" if self.learners else "learned policy"
            raise MissingError(f"the study {study} has no {which}")
        return findings.best_policy(self.studies.study(study).missions, among)

    def missions(self, study: str, uavs: int | None = None) -> pd.DataFrame:
        """The missions of the policy; those of a number of UAVs, if asked."""
        missions = self.studies.study(study).missions
        own = missions[missions["policy"] == self.policy(study)]
        own = own if uavs is None else own[own["uavs"] == uavs]
        if own.empty:
            raise MissingError(f"the study {study} has no such mission")
        return own

    def _pairs(self, study: str, field: str, metric: str) -> Pairs:
        """The values of a parameter, compared mission by mission."""
        policy, table = self.policy(study), self.studies.effects(study)
        own = table[table["field"] == field].drop_duplicates("position")
        if len(own) < 2:
            raise MissingError(f"the study {study} does not vary {field}")
        compared = effects.changes(self.studies.study(study), table, policy, field, metric)
        return Pairs(compared, dict(zip(own["value"], own["position"], strict=True)))

    def _flights(self, uavs: int) -> list[Flight]:
        """Missions of Fig. 4 with a number of UAVs, flown again; the first replications."""
        missions = self.missions("fig4", uavs).head(self.studies.flights)
        results, policy = self.studies.study("fig4"), self.policy("fig4")
        keys = zip(missions["point"], missions["replication"], strict=True)
        return [fly(results, policy, int(point), int(number)) for point, number in keys]


def mean_of(missions: pd.DataFrame, metric: str) -> Quantity:
    """The mean of a metric."""
    row = summary(missions, by=[]).set_index("metric").loc[metric]
    return Quantity(float(row["mean"]), float(row["low"]), float(row["high"]), int(row["n"]))


def share_of(so: np.ndarray, name: str) -> Quantity:
    """The share of missions in which something is so."""
    return Quantity(*wilson(int(so.sum()), len(so)), n=len(so), name=name)


def mean_share(values: np.ndarray, name: str) -> Quantity:
    """The mean of a share per mission; its interval ends where shares do."""
    mean, low, high = mean_interval(values)
    return Quantity(mean, max(low, 0.0), min(high, 1.0), len(values), name=name)


def mean_points(values: np.ndarray, name: str = "") -> Quantity:
    """The mean of a difference of shares per mission."""
    return Quantity(*mean_interval(values), len(values), "points", name)


def points(row: pd.Series, name: str = "") -> Quantity:
    """A row of ``effects.changes``."""
    mean, low, high = (float(row[end]) for end in ("difference", "low", "high"))
    return Quantity(mean, low, high, int(row["n"]), "points", name)


def least(leads: pd.DataFrame, name: str) -> Quantity:
    """The smallest of ``Pairs.leads``."""
    return points(leads.sort_values("difference", kind="stable").iloc[0], name)


def upside_down(pairs: pd.DataFrame) -> pd.DataFrame:
    """Differences the other way round."""
    return pairs.assign(
        difference=-pairs["difference"],
        low=-pairs["high"],
        high=-pairs["low"],
        wide_low=-pairs["wide_high"],
        wide_high=-pairs["wide_low"],
    )
