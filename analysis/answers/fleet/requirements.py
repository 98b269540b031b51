"""The requirements of a search for the cheapest fleet, and by how much fleets keep them.

for requirement in requirements_of(results):  # of a study that searches for the cheapest fleet
    print(requirement.in_words, requirement.margin(0.995))
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.metrics import Metric, column_in_sheet_unit, metric_of
from dess.analysis.results.tables import Results
from dess.analysis.stats.requirement import Requirement
from dess.analysis.study.cheapest import Cheapest
from dess.scenario.quantities import unit_of


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
