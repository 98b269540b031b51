"""Tests of paired differences: Student's t test, McNemar's test for shares, and the sign test.

Differences of values from 0 to 1 have Student's t, cut off at -1 and 1. Missions in which only one
of two policies fails occur on both sides, so the mean of the differences is less skewed than the
mean of the values.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd
from scipy import stats

from analysis.names import BOUNDED, SHARES
from analysis.stats.intervals import LEVEL, Interval, column_intervals, mean_interval

_ROUNDING = 64 * np.finfo(float).eps  # relative tolerance below which differences count as equal


def differences_of(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The differences A - B; if they differ only by rounding errors, they are made equal."""
    differences = a - b
    rounding = _ROUNDING * max(np.abs(a).max(), np.abs(b).max())
    if np.ptp(differences) > rounding:
        return differences
    first = differences.flat[0]
    return np.full_like(differences, first if abs(first) > rounding else 0.0)


def t_test(differences: np.ndarray, level: float) -> tuple[Interval, float]:
    """The mean difference with Student's interval, and the p-value of "no difference".

    If all differences are equal, the interval is degenerate and p is that of the sign test.
    """
    mean = mean_interval(differences, level)
    if np.ptp(differences) == 0:
        return mean, sign_test(differences)
    t = abs(mean.mean) / stats.sem(differences)
    return mean, float(2 * stats.t.sf(t, differences.size - 1))


def share_test(differences: np.ndarray, level: float) -> tuple[Interval, float]:
    """The mean difference of shares with its interval, and the p-value of "no difference".

    One gain and one loss are added before Student's t is used (as by Bonett and Price 2012), so
    that the interval has a length even if there are few discordant pairs, or none. The p-value of
    outcomes 0 and 1 is that of McNemar's exact test.
    """
    smooth, p = t_test(smoothed(differences), level)
    if np.isin(differences, (-1, 0, 1)).all():
        gains, losses = int(np.sum(differences > 0)), int(np.sum(differences < 0))
        p = float(stats.binomtest(gains, gains + losses).pvalue) if gains + losses else 1.0
    mean = float(differences.mean())
    return Interval(mean, max(smooth.low, -1.0), min(smooth.high, 1.0)), p


def bounded_test(differences: np.ndarray, level: float) -> tuple[Interval, float]:
    """The mean difference of values from 0 to 1 with its interval, and the p-value.

    The interval is Student's t, cut off at -1 and 1. If all differences are equal, one gain and one
    loss are added as for shares, because missions with another difference may just be too rare to
    be in the sample.
    """
    mean, p = t_test(smoothed(differences) if np.ptp(differences) == 0 else differences, level)
    return Interval(float(differences.mean()), max(mean.low, -1.0), min(mean.high, 1.0)), p


def difference_test(metric: str) -> Callable[[np.ndarray, float], tuple[Interval, float]]:
    """The test of paired differences that suits a metric of missions."""
    return share_test if metric in SHARES else bounded_test if metric in BOUNDED else t_test


def column_tests(values: pd.DataFrame, baseline: pd.Series, metric: str = "") -> pd.DataFrame:
    """Paired comparisons of many columns with a baseline, as ``stats.paired.paired`` makes them.

    Args:
        values: (R, K) a row per replication; nan where a column lacks one.
        baseline: (R,) the values of the baseline.
        metric: The metric; by default one without bounds.

    Returns:
        (K, 5): ``difference`` (column - baseline) with ``low``, ``high``, ``p`` and ``n``.
    """
    differences = values.sub(baseline, axis=0)
    size = values.abs().max().clip(lower=baseline.abs().max())
    constant = differences.max() - differences.min() <= _ROUNDING * size
    differences = differences.mask(differences.abs().le(_ROUNDING * size, axis=1), 0.0)
    table = column_intervals(differences).rename(columns={"mean": "difference"})
    t = (table["difference"] / differences.sem()).abs()
    table["p"] = 2 * stats.t.sf(t, np.maximum(table["n"] - 1, 1))
    known: dict[tuple[int, int, int], tuple[Interval, float]] = {}
    exact = {}  # columns for which Student's t is not suitable
    for column in differences if metric in SHARES else differences.columns[constant]:
        own = differences[column].dropna().to_numpy()
        if metric in SHARES and len(own):
            key = len(own), int((own > 0).sum()), int((own < 0).sum())  # all that the test needs
            known[key] = known.get(key) or share_test(own, LEVEL)
            exact[column] = (*known[key][0], known[key][1])
        elif len(own):
            mean, p = difference_test(metric)(np.full_like(own, own[0]), LEVEL)
            exact[column] = (*mean, p)
    if exact:
        table.loc[[*exact], ["difference", "low", "high", "p"]] = np.array([*exact.values()])
    if metric in BOUNDED:
        table[["low", "high"]] = table[["low", "high"]].clip(-1, 1)
    return table


def sign_test(equal: np.ndarray) -> float:
    """The two-sided p-value of n equal differences: 2^(1 - n), or 1 if they are 0."""
    return min(1.0, 2 * 0.5 ** len(equal)) if equal[0] else 1.0


def smoothed(differences: np.ndarray) -> np.ndarray:
    """The differences with one gain and one loss added, along the last axis."""
    more = np.broadcast_to([1.0, -1.0], (*differences.shape[:-1], 2))
    return np.concatenate([differences, more], axis=-1)
