"""What the numbers of many missions say: means, quantiles, tails, with intervals by scipy.

Replications are independent, so missions are the sampling unit; design points share the sea of a
replication, so compare them by ``comparison.compare``. Intervals are two-sided.
"""

import inspect
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import pandas as pd
from scipy import stats

from analysis.names import MEANS, SHARES
from dess.errors import InputError

LEVEL = 0.95

# Views of ``distribution``: the quantiles, and the share of missions that counts as the worst.
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
TAIL = 0.05
Worst = Literal["lowest", "highest"]

_BATCH = 2**18  # resampled values at a time: some megabytes, whatever n


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


def bootstrap_interval(
    samples: np.ndarray | Sequence[np.ndarray],
    statistic: Callable[..., float],
    generator: np.random.Generator,
    level: float = LEVEL,
    method: str = "BCa",
    resamples: int = 9999,
) -> Interval:
    """A statistic with its bootstrap interval: for medians, ratios, and small or odd samples.

    Args:
        samples: (n,) values, or several such arrays of which entry r belongs to the same
            replication; these are resampled together.
        statistic: Function of the samples, as many arguments as there are. One that takes ``axis``,
            like ``np.mean``, is computed for many resamples at once, in bounded memory.
        generator: Draws the resamples.
        level: Confidence level.
        method: ``BCa``, ``percentile`` or ``basic``, as of ``scipy.stats.bootstrap``.
        resamples: Number of resamples.

    Returns:
        The statistic of the samples as ``mean``, and its interval: by percentiles where BCa is not
        defined or misses the statistic, degenerate (low = mean = high) where all resamples agree.

    Raises:
        ValueError: If there are no values.
    """
    arrays = (samples,) if isinstance(samples, np.ndarray) else tuple(samples)
    n = len(arrays[0])
    if not n:
        raise ValueError("bootstrap_interval: no values")
    estimate = float(statistic(*arrays))
    if n == 1:
        return Interval(estimate, estimate, estimate)
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)
        result = stats.bootstrap(
            arrays,
            statistic,
            n_resamples=resamples,
            batch=max(1, _BATCH // n),
            confidence_level=level,
            method=method,
            paired=True,
            vectorized=_takes_axis(statistic),
            rng=generator,
        )
    low, high = result.confidence_interval
    if method == "BCa" and not low <= estimate <= high:  # nan, or bias or level beyond its reach
        low, high = np.quantile(result.bootstrap_distribution, [(1 - level) / 2, (1 + level) / 2])
    return Interval(estimate, float(low), float(high))


def expanded_level(level: float, n: float) -> float:
    """The level at which a bootstrap interval of a mean of few values holds ``level``.

    Resamples vary by (n - 1) / n of what samples do, and take the normal distribution where
    Student's t is due (Hesterberg 2015, the expanded percentile interval).

    Args:
        level: The level that is wanted.
        n: Number of values; fewer than 2 count as 2.
    """
    n = max(n, 2)
    end = np.sqrt(n / (n - 1)) * stats.t.ppf((1 + level) / 2, n - 1)
    return float(1 - 2 * stats.norm.sf(end))


def quantile_interval(
    values: Sequence[float] | np.ndarray, share: float, level: float = LEVEL
) -> Interval:
    """A quantile with its distribution-free interval between two order statistics.

    It covers at least at its level, for every distribution. An end that the sample is too small
    for is infinite: no observation bounds the quantile on that side.

    Args:
        values: (n,) values.
        share: Of the missions that lie below the quantile, in (0, 1).
        level: Confidence level.

    Raises:
        ValueError: If there are no values, or no such quantile.
    """
    sample = np.asarray(values, float)
    if not sample.size:
        raise ValueError("quantile_interval: no values")
    low, high = stats.quantile_test(sample, p=share).confidence_interval(level)
    ends = (-np.inf if np.isnan(low) else float(low), np.inf if np.isnan(high) else float(high))
    return Interval(float(np.quantile(sample, share)), *ends)


def tail_mean(values: np.ndarray, share: float = TAIL, axis: int = -1) -> Any:
    """Mean of the lowest values: the conditional value at risk of the sample.

    Args:
        values: (..., n, ...) values.
        share: Of the values that are the lowest, in (0, 1]. Where ``share * n`` is not whole, the
            last of them counts in part; the lowest counts in any case.
        axis: Of the n values.

    Returns:
        The means over the axis.
    """
    sample = np.moveaxis(np.asarray(values, float), axis, -1)
    size = share * sample.shape[-1]
    last = min(int(np.ceil(size)), sample.shape[-1]) - 1
    lowest = np.partition(sample, last)[..., : last + 1]
    return lowest @ np.clip(size - np.arange(last + 1), 0, 1) / size


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


def distribution(
    missions: pd.DataFrame,
    metric: str,
    generator: np.random.Generator,
    by: Sequence[str] = ("policy",),
    quantiles: Sequence[float] = QUANTILES,
    tail: float = TAIL,
    worst: Worst = "lowest",
    level: float = LEVEL,
    resamples: int = 9999,
) -> pd.DataFrame:
    """How a metric spreads over the missions of groups: quantiles, and the mean of the worst.

    The mean of the worst missions is the conditional value at risk. Its BCa bootstrap interval,
    expanded for the size of the tail, is fit from some 30 missions in the tail on (600 missions
    for the worst 5 %); with fewer it is too narrow. The quantiles have the intervals of
    ``quantile_interval``, whose ends may be infinite.

    Args:
        missions: A row per mission, with the metric and the fields of ``by``.
        metric: A column of numbers.
        generator: Draws the resamples.
        by: Columns whose values form the groups; without any, all missions are one.
        quantiles: Shares of the missions below each quantile, in (0, 1).
        tail: Share of the missions that are the worst, in (0, 1).
        worst: Whether the ``lowest`` or the ``highest`` values are.
        level: Confidence level.
        resamples: Number of bootstrap resamples.

    Returns:
        A row per group, in order of first appearance, and view: the columns ``by``, ``metric``,
        ``view`` (``quantile``, then ``worst mean``), ``share`` (of the missions below the quantile,
        or in the tail), ``value``, ``low``, ``high`` and ``n``, the number of missions.

    Raises:
        InputError: If a column is missing, or an argument is not allowed.
    """
    check_columns(missions, [metric, *by])
    if worst not in get_args(Worst):
        raise InputError(f"worst: {worst!r}; allowed: {', '.join(get_args(Worst))}")
    for name, share in [*(("quantiles", q) for q in quantiles), ("tail", tail), ("level", level)]:
        if not 0 < share < 1:
            raise InputError(f"{name}: {share}; allowed: between 0 and 1")
    sign = 1 if worst == "lowest" else -1

    def worst_mean(values: np.ndarray, axis: int = -1) -> Any:
        return sign * tail_mean(sign * values, tail, axis)

    rows = []
    for group, part in groups(missions, by):
        values = part[metric].to_numpy(float)
        views = [("quantile", q, quantile_interval(values, q, level)) for q in quantiles]
        expanded = expanded_level(level, tail * len(values))
        risk = bootstrap_interval(values, worst_mean, generator, expanded, resamples=resamples)
        views.append(("worst mean", tail, risk))
        rows += [(*group, metric, view, q, *ends, len(part)) for view, q, ends in views]
    columns = [*by, "metric", "view", "share", "value", "low", "high", "n"]
    return pd.DataFrame(rows, columns=columns)


def check_columns(missions: pd.DataFrame, needed: Sequence[str]) -> None:
    """Raise ``InputError`` if a needed column is missing."""
    for name in needed:
        if name not in missions:
            raise InputError(f"{name}: no such column; allowed: {', '.join(missions.columns)}")


def groups(missions: pd.DataFrame, by: Sequence[str]) -> Iterator[tuple[tuple, pd.DataFrame]]:
    """Groups of rows by the values of columns, in order of first appearance; all without any."""
    yield from missions.groupby(list(by), sort=False, dropna=False) if by else [((), missions)]


def _takes_axis(statistic: Callable[..., Any]) -> bool:
    try:
        return "axis" in inspect.signature(statistic).parameters
    except ValueError:  # some builtins show no signature
        return False


def _intervals(missions: pd.DataFrame, level: float) -> list[tuple[str, Interval]]:
    shares = [(m, wilson(missions[m].sum(), len(missions), level)) for m in SHARES]
    return shares + [(m, mean_interval(missions[m].to_numpy(), level)) for m in MEANS]
