"""The requirements of a search for the cheapest fleet, and whether a fleet meets them.

    for requirement in requirements_of(results):  # of a study that searches for the cheapest fleet
        print(requirement.in_words, requirement.margin(0.995))

A requirement is a bound on the mean of a metric, such as a success of at least 99 % or an age of
information of at most 90 minutes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.metrics import Metric, column_in_sheet_unit, metric_of
from dess.analysis.results.tables import Results
from dess.analysis.study.cheapest import Cheapest
from dess.scenario.quantities import unit_of


class Verdict(StrEnum):
    """Whether a fleet meets requirements; *open* is what the missions do not decide."""

    MISSED = "missed"  # the most serious first
    OPEN = "open"
    MET = "met"

    @classmethod
    def of_all(cls, verdicts: Sequence[str]) -> "Verdict":
        """The verdict on several requirements, or conditions, together: the most serious one."""
        return next(verdict for verdict in cls if verdict in verdicts)


@dataclass(frozen=True)
class Requirement:
    """A bound that the mean of a metric has to keep.

    Attributes:
        metric: The metric, as the missions have it: with a data sheet in its unit. It is told in
            the unit in which it was required.
        bound: The least mean, or the largest of a metric of which less is better.
    """

    metric: Metric
    bound: float

    @property
    def column(self) -> str:
        """The column of the metric in tables of missions."""
        return self.metric.column

    @property
    def in_words(self) -> str:
        """The requirement, as ``success of at least 99 %``."""
        return f"{self.metric.within} of {self.bound_in_words}"

    @property
    def bound_in_words(self) -> str:
        """The bound alone, as ``at least 99 %``."""
        if self.metric.less_is_better:
            side = "at most"
        else:
            side = "at least"
        return f"{side} {self.metric.amount(self.bound)}"

    def shifted(self, tolerance: float, horizon: float) -> "Requirement":
        """The requirement that is easier by the tolerance of a search.

        Args:
            tolerance: The tolerance, of an age as a share of the horizon.
            horizon: The largest age that data can have.
        """
        if self.metric.less_is_better:
            return Requirement(self.metric, self.bound + tolerance * horizon)
        return Requirement(self.metric, self.bound - tolerance)

    def margin(self, value: Any) -> Any:
        """How far a value, or each of an array, is on the right side; negative on the wrong one."""
        if self.metric.less_is_better:
            return self.bound - value
        return value - self.bound

    def verdict(self, low: float, high: float) -> Verdict:
        """Whether a whole interval keeps the bound, breaks it, or neither."""
        margins = self.margin(low), self.margin(high)
        if min(margins) >= 0:
            return Verdict.MET
        if max(margins) < 0:
            return Verdict.MISSED
        return Verdict.OPEN


def requirements_of(results: Results) -> list[Requirement]:
    """The requirements of a study that searches for the cheapest fleet; none of any other one."""
    rule = results.study.selection
    if not isinstance(rule, Cheapest):
        return []
    requirements = []
    for metric, required in rule.requirements.items():
        of_missions = metric_of(column_in_sheet_unit(metric, results.missions))
        if isinstance(required, str):
            of_missions = replace(of_missions, told_unit=unit_of(required, "s"))
        requirements.append(Requirement(of_missions, rule.amount(metric)))
    return requirements


def metric_asked_for(results: Results, column: str | Metric) -> Metric:
    """The metric of a column, told in the unit of the requirement if there is one on it."""
    asked = {requirement.column: requirement.metric for requirement in requirements_of(results)}
    measure = metric_of(column)
    return asked.get(measure.column, measure)


def requirements_in_words(requirements: Sequence[Requirement]) -> str:
    """Requirements as ``success of at least 99 % and collection ratio of at least 80 %``."""
    return numbers.join_words([requirement.in_words for requirement in requirements])


def relative_spare(fleets: pd.DataFrame, requirement: Requirement) -> pd.Series:
    """By how much every fleet keeps a requirement, on a scale that requirements share.

    It is the margin as a share of the range of the metric over the fleets that were compared. So a
    success of 100 % of every fleet has no end of spare room, although it is near its bound.

    Args:
        fleets: A row per fleet, with the mean of the metric.
        requirement: The requirement.
    """
    margins = requirement.margin(fleets[requirement.column])
    extent = float(np.ptp(fleets[requirement.column]))
    if extent:
        return margins / extent
    return pd.Series(np.where(margins >= 0, np.inf, -np.inf), fleets.index)


def least_spare(fleets: pd.DataFrame, requirements: Sequence[Requirement]) -> pd.Series:
    """The ``relative_spare`` of every fleet for the requirement that it keeps by the least."""
    return pd.concat(
        [relative_spare(fleets, requirement) for requirement in requirements], axis=1
    ).min(axis=1)
