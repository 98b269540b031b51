"""Bootstrap intervals of statistics that have no formula."""

import warnings
from collections.abc import Callable, Sequence

import numpy as np
import scipy
from scipy.special import ndtr, stdtrit

from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.kinds import LEVEL

_BATCH = 2**18  # resampled values at a time, which take some megabytes for every n


def bootstrap_interval(
    samples: np.ndarray | Sequence[np.ndarray],
    statistic: Callable[..., float],
    generator: np.random.Generator,
    level: float = LEVEL,
    resamples: int = 9999,
) -> Interval:
    """A statistic with its bootstrap interval, for example a median, a ratio or a small sample.

    Args:
        samples: (n,) values, or several such arrays that are resampled together; entry r of all
            arrays belongs to the same replication.
        statistic: A function with as many arguments as there are samples, not a builtin of Python.
            If it takes ``axis``, like ``np.mean``, it is computed for many resamples at once, in
            limited memory.
        generator: The random generator of the resamples.
        level: Confidence level.
        resamples: Number of resamples.

    Returns:
        The statistic of the samples as ``mean``, and its interval. Where BCa is not defined or does
        not contain the statistic, the interval is that of the percentiles. If all resamples agree,
        it is degenerate (low = mean = high). The ends of a single value are nan.

    Raises:
        ValueError: If there are no values.
    """
    if isinstance(samples, np.ndarray):
        samples = (samples,)
    arrays = tuple(samples)
    n = len(arrays[0])
    if not n:
        raise ValueError("bootstrap_interval: no values")
    estimate = float(statistic(*arrays))
    if n == 1:
        return Interval(estimate, np.nan, np.nan)
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.simplefilter("ignore", scipy.stats.DegenerateDataWarning)
        result = scipy.stats.bootstrap(
            arrays,
            statistic,
            n_resamples=resamples,
            batch=max(1, _BATCH // n),
            confidence_level=level,
            paired=True,
            rng=generator,
        )
    low, high = result.confidence_interval
    if not low <= estimate <= high:  # nan, or too large a bias or level
        low, high = np.quantile(result.bootstrap_distribution, [(1 - level) / 2, (1 + level) / 2])
    return Interval(estimate, float(low), float(high))


def expanded_level(level: float, n: float) -> float:
    """The nominal level at which a bootstrap interval of a mean of few values covers at ``level``.

    The variance of resamples is only (n - 1) / n of that of samples, and the bootstrap corresponds
    to the normal distribution in place of Student's t. The correction is the expanded percentile
    interval (T. C. Hesterberg, The American Statistician 69 (2015) 371-386).

    Args:
        level: The coverage that the interval should have.
        n: Number of values; fewer than 2 count as 2.
    """
    n = max(n, 2)
    end = np.sqrt(n / (n - 1)) * stdtrit(n - 1, (1 + level) / 2)
    return float(1 - 2 * ndtr(-end))
