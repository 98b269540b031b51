"""Means with intervals of groups of missions."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from dess.analysis.measured import metrics_in
from dess.analysis.metric_ranges import metric_in_missions
from dess.analysis.metrics import Metric
from dess.analysis.stats.intervals import Interval, interval_of, stratified_interval
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.rows import group_rows
from dess.analysis.stats.weights import by_replication, values_within


def summary(
    missions: pd.DataFrame, by: Sequence[str] = ("policy",), level: float = LEVEL
) -> pd.DataFrame:
    """Means with intervals of groups of missions.

    A group with missions at several design points (column ``point``), each of which has two or
    more, has the mean of the points' means and the interval of ``stratified_interval``. Points with
    a single mission each are taken for a sample of the design.

    Args:
        missions: A row per mission, with the fields of ``MISSION_RECORD`` and those of ``by``.
        by: Columns whose values form the groups; without any, all missions are one.
        level: Confidence level.

    Returns:
        A row per group, in order of first appearance, and metric: the columns ``by``, ``metric``
        (``success``, ``collection_ratio``, ``collection_ratio_and_communication``, ``reward``),
        ``mean``, ``low``, ``high`` and ``n``, the number of missions. Extended scenarios add what
        they measure; missions without a value are left out. The intervals are those of
        ``interval_of``.
    """
    strata = "point" in missions and "point" not in by
    rows = []
    for group, part in group_rows(missions, by):
        for metric in metrics_in(missions):
            if n := int(part[metric].count()):
                ends = _interval_of_group(part, metric_in_missions(part, metric), level, strata)
                rows.append((*group, metric, *ends, n))
    return pd.DataFrame(rows, columns=[*by, "metric", "mean", "low", "high", "n"])


def _interval_of_group(
    missions: pd.DataFrame, metric: Metric, level: float, strata: bool
) -> Interval:
    """The mean of a group: over its missions, or over the points that these are at."""
    if strata and missions["point"].nunique() > 1:
        wide = by_replication(missions, metric.column, "point").dropna(axis="columns", how="all")
        if (wide.count() > 1).all():
            # In this order, so that the last bits of sums are the same with every pandas.
            return stratified_interval(np.ascontiguousarray(wide, float), metric, level)
    values = values_within(missions, metric.column, ())
    return interval_of(metric, values[~np.isnan(values)], level)
