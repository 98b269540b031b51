"""The distribution of a metric over missions: quantiles, and the mean of the worst missions."""

from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
import pandas as pd
import scipy

from dess import InputError
from dess.analysis.metric_ranges import metric_in_missions
from dess.analysis.stats.bootstrap import bootstrap_interval, expanded_level
from dess.analysis.stats.intervals import Interval, interval_of
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.rows import check_columns, check_share, group_rows

# Views of ``distribution``: the quantiles, and the share of missions that counts as the worst.
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
TAIL = 0.05
Worst = Literal["lowest", "highest"]


def distribution(
    missions: pd.DataFrame,
    metric: str,
    generator: np.random.Generator,
    by: Sequence[str] = ("policy",),
    quantiles: Sequence[float] = QUANTILES,
    tail: float = TAIL,
    worst: Worst | None = None,
    level: float = LEVEL,
    *,
    resamples: int = 9999,
) -> pd.DataFrame:
    """The distribution of a metric over groups of missions: quantiles, and the mean of the worst.

    The mean of the worst missions is the conditional value at risk. Its BCa bootstrap interval is
    expanded for the size of the tail. It is reliable with about 30 missions or more in the tail
    (600 missions for the worst 5 %), and too narrow with fewer. Where all resamples agree, a metric
    of known range has the ``interval_of`` as many values as the tail has. The quantiles
    have the intervals of ``quantile_interval``; an end that no observation limits is nan.

    Args:
        missions: A row per mission, with the metric and the fields of ``by``.
        metric: A column of numbers.
        generator: The random generator of the resamples.
        by: Columns whose values form the groups; without any, all missions are one group.
        quantiles: Shares of the missions below each quantile, in (0, 1).
        tail: Share of the missions that are the worst, in (0, 1).
        worst: Whether the ``lowest`` or the ``highest`` values are the worst; by default the
            highest of a metric of which less is better, such as an age, and otherwise the lowest.
        level: Confidence level.
        resamples: Number of bootstrap resamples.

    Returns:
        A row per group, in order of first appearance, and view: the columns ``by``, ``metric``,
        ``view`` (``quantile``, then ``worst mean``), ``share`` (of the missions below the quantile,
        or in the tail), ``value``, ``low``, ``high`` and ``n``, the number of missions; those that
        have not measured the metric are left out.

    Raises:
        InputError: If a column is missing, or an argument is not allowed.
    """
    check_columns(missions, [metric, *by])
    measure = metric_in_missions(missions, metric)
    if worst is None and measure.less_is_better:
        worst = "highest"
    elif worst is None:
        worst = "lowest"
    if worst not in get_args(Worst):
        raise InputError("worst", repr(worst), ", ".join(get_args(Worst)))
    for name, share in [*(("quantiles", q) for q in quantiles), ("tail", tail), ("level", level)]:
        check_share(name, share)
    sign = 1 if worst == "lowest" else -1

    def worst_mean(values: np.ndarray, axis: int = -1) -> Any:
        return sign * tail_mean(sign * values, tail, axis)

    rows = []
    for group, part in group_rows(missions, by):
        values = part[metric].dropna().to_numpy(float)
        if not len(values):
            continue
        views = [("quantile", q, quantile_interval(values, q, level)) for q in quantiles]
        expanded = expanded_level(level, tail * len(values))
        risk = bootstrap_interval(values, worst_mean, generator, expanded, resamples=resamples)
        if measure.has_range and risk.low == risk.high:
            tail_values = np.full(max(int(tail * len(values)), 1), risk.mean)
            risk = interval_of(measure, tail_values, level)
        views.append(("worst mean", tail, risk))
        rows += [(*group, metric, view, q, *ends, len(values)) for view, q, ends in views]
    columns = [*by, "metric", "view", "share", "value", "low", "high", "n"]
    return pd.DataFrame(rows, columns=columns).replace([-np.inf, np.inf], np.nan)


def quantile_interval(
    values: Sequence[float] | np.ndarray, share: float, level: float = LEVEL
) -> Interval:
    """A quantile with its distribution-free interval between two order statistics.

    Its coverage is at least its level for every distribution. If the sample is too small for an
    end, that end is infinite, because no observation limits the quantile on that side.

    Args:
        values: (n,) values, one or more.
        share: Share of the missions below the quantile, in (0, 1).
        level: Confidence level.
    """
    sample = np.asarray(values, float)
    low, high = scipy.stats.quantile_test(sample, p=share).confidence_interval(level)
    ends = (-np.inf if np.isnan(low) else float(low), np.inf if np.isnan(high) else float(high))
    return Interval(float(np.quantile(sample, share)), *ends)


def tail_mean(values: np.ndarray, share: float = TAIL, axis: int = -1) -> Any:
    """Mean of the lowest values: the conditional value at risk of the sample.

    Args:
        values: (..., n, ...) values.
        share: Share of the lowest values, in (0, 1]. If ``share * n`` is not an integer, the last
            of them counts in part; at least the lowest value counts.
        axis: The axis of the n values.

    Returns:
        The means over the axis.
    """
    sample = np.moveaxis(np.asarray(values, float), axis, -1)
    size = share * sample.shape[-1]
    last = min(int(np.ceil(size)), sample.shape[-1]) - 1
    lowest = np.partition(sample, last)[..., : last + 1]
    return lowest @ np.clip(size - np.arange(last + 1), 0, 1) / size
