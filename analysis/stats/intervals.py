"""Means and shares of missions with their confidence intervals.

Replications are independent, so missions are the sampling unit. Design points share the realisation
of a replication: compare them by ``analysis.compare``. Intervals are two-sided.

    >>> wilson(9, 10)
    Interval(mean=0.9, low=0.596, high=0.982)
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from analysis.names import MEANS, SHARES
from dess.errors import InputError, one_of

LEVEL = 0.95


class Interval(NamedTuple):
    """An estimate and the ends of its confidence interval."""

    mean: float
    low: float
    high: float


def wilson(successes: int, n: int, level: float = LEVEL) -> Interval:
    """Share of successes with its Wilson score interval, which holds near 0 and 1 as well.

    Raises:
        ValueError: If there are no trials.
    """
    if n < 1:
        raise ValueError("wilson: no trials")
    ends = stats.binomtest(int(successes), int(n)).proportion_ci(level, method="wilson")
    return Interval(successes / n, float(ends.low), float(ends.high))


def mean_interval(values: Sequence[float] | np.ndarray, level: float = LEVEL) -> Interval:
    """Mean with its Student t interval; fit for skewed metrics from some 30 values on.

    A single value, or values without variance, give a degenerate interval (low = mean = high): the
    sample says nothing about the spread.

    Raises:
        ValueError: If there are no values.
    """
    sample = np.asarray(values, float)
    if not sample.size:
        raise ValueError("mean_interval: no values")
    mean = float(sample.mean())
    if np.ptp(sample) == 0:
        return Interval(mean, mean, mean)
    low, high = stats.t.interval(level, sample.size - 1, mean, stats.sem(sample))
    return Interval(mean, float(low), float(high))


def summary(
    missions: pd.DataFrame, by: Sequence[str] = ("policy",), level: float = LEVEL
) -> pd.DataFrame:
    """Means with intervals of groups of missions.

    Args:
        missions: A row per mission, with the fields of ``MISSION_RECORD`` and those of ``by``.
        by: Columns whose values form the groups; without any, all missions are one.
        level: Confidence level.

    Returns:
        A row per group, in order of first appearance, and metric: the columns ``by``, ``metric``
        (``success``, ``collection_ratio``, ``collection_ratio_and_communication``, ``reward``),
        ``mean``, ``low``, ``high`` and ``n``, the number of missions. ``success`` has its Wilson
        interval, the others Student's t.
    """
    rows = [
        (*group, metric, *interval, len(part))
        for group, part in groups(missions, by)
        for metric, interval in _intervals(part, level)
    ]
    return pd.DataFrame(rows, columns=[*by, "metric", "mean", "low", "high", "n"])


def column_intervals(
    values: pd.DataFrame, share: bool = False, level: float = LEVEL
) -> pd.DataFrame:
    """Means of columns with their intervals, as of ``summary``, for many columns at once.

    Args:
        values: (R, K) a row per replication, a column per group; nan where a group lacks one.
        share: Whether the values are outcomes 0 or 1, or means of such. Outcomes, and means that
            are all the same, have Wilson's interval, other means Student's t.
        level: Confidence level.

    Returns:
        (K, 4): ``mean``, ``low``, ``high``, ``n``, with the columns as index; nan without values.
    """
    n, mean, errors = values.count(), values.mean(), values.sem().fillna(0.0)
    half = errors * stats.t.isf((1 - level) / 2, np.maximum(n - 1, 1))
    table = pd.DataFrame({"mean": mean, "low": mean - half, "high": mean + half, "n": n})
    if share:
        outcomes = (values.isin((0, 1)) | values.isna()).all() | (errors == 0)
        rows = (outcomes & (n > 0)).to_numpy()
        successes = (mean * n)[rows].round().astype(int)
        pairs = [*zip(successes, n[rows], strict=True)]
        known = {pair: wilson(*pair, level)[1:] for pair in {*pairs}}  # each takes its time
        table.loc[rows, ["low", "high"]] = np.array([known[p] for p in pairs]).reshape(-1, 2)
    return table


def check_columns(missions: pd.DataFrame, needed: Sequence[str]) -> None:
    """Raise ``InputError`` if a needed column is missing."""
    for name in needed:
        if name not in missions:
            raise InputError(f"{name}: no such column{one_of(name, missions.columns)}")


def check_share(name: str, share: float) -> None:
    """Raise ``InputError`` unless a share, such as a confidence level, is between 0 and 1."""
    if not 0 < share < 1:
        raise InputError(f"{name}: {share}; allowed: between 0 and 1")


def groups(missions: pd.DataFrame, by: Sequence[str]) -> Iterator[tuple[tuple, pd.DataFrame]]:
    """Groups of rows by the values of columns, in order of first appearance; all without any."""
    yield from missions.groupby(list(by), sort=False, dropna=False) if by else [((), missions)]


def _intervals(missions: pd.DataFrame, level: float) -> list[tuple[str, Interval]]:
    shares = [(m, wilson(missions[m].sum(), len(missions), level)) for m in SHARES]
    return shares + [(m, mean_interval(missions[m].to_numpy(), level)) for m in MEANS]
