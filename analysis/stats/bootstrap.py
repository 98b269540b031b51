"""Bootstrap intervals: for medians, ratios and other statistics without an interval of their own.

For a paired comparison, take the differences of the pairs:

    bootstrap_interval(a - b, np.median, generator)
"""

import inspect
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import stats

from analysis.stats.intervals import LEVEL, Interval

_BATCH = 2**18  # resampled values at a time: some megabytes, whatever n


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


def _takes_axis(statistic: Callable[..., Any]) -> bool:
    try:
        return "axis" in inspect.signature(statistic).parameters
    except ValueError:  # some builtins show no signature
        return False
