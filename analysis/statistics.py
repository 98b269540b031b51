"""What the numbers of many missions say: means with intervals, all by scipy.

Replications are independent, so missions are the sampling unit. Intervals are two-sided.
"""

import warnings
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

LEVEL = 0.95

# Metrics of ``summary``: shares of missions by Wilson, the others by Student's t.
SHARES = ("success",)
MEANS = ("collection_ratio", "collection_ratio_and_communication", "reward")


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
        statistic: Function of the samples, as many arguments as there are.
        generator: Draws the resamples.
        level: Confidence level.
        method: ``BCa``, ``percentile`` or ``basic``, as of ``scipy.stats.bootstrap``.
        resamples: Number of resamples.

    Returns:
        The statistic of the samples as ``mean``, and its interval: by percentiles where BCa is not
        defined, degenerate (low = mean = high) where all resamples agree.

    Raises:
        ValueError: If there are no values.
    """
    arrays = (samples,) if isinstance(samples, np.ndarray) else tuple(samples)
    if not len(arrays[0]):
        raise ValueError("bootstrap_interval: no values")
    estimate = float(statistic(*arrays))
    if len(arrays[0]) == 1:
        return Interval(estimate, estimate, estimate)
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)
        result = stats.bootstrap(
            arrays,
            statistic,
            n_resamples=resamples,
            confidence_level=level,
            method=method,
            paired=True,
            vectorized=False,
            rng=generator,
        )
    ends = tuple(result.confidence_interval)
    if np.isnan(ends).any():
        ends = np.quantile(result.bootstrap_distribution, [(1 - level) / 2, (1 + level) / 2])
    return Interval(estimate, float(ends[0]), float(ends[1]))


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
    keys = list(by)
    groups = missions.groupby(keys, sort=False) if keys else [((), missions)]
    rows = [
        (*group, metric, *interval, len(part))
        for group, part in groups
        for metric, interval in _intervals(part, level)
    ]
    return pd.DataFrame(rows, columns=[*keys, "metric", "mean", "low", "high", "n"])


def _intervals(missions: pd.DataFrame, level: float) -> list[tuple[str, Interval]]:
    shares = [(m, wilson(missions[m].sum(), len(missions), level)) for m in SHARES]
    return shares + [(m, mean_interval(missions[m].to_numpy(), level)) for m in MEANS]
