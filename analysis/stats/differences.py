"""Tests of paired differences: Student's t test, McNemar's test for shares, and the sign test.

A sample of missions in which neither policy fails alone, or only one of them does, knows too little
of lone failures: Student's t is far too narrow then. So one mission in which A alone does well and
one in which B alone does are added to the differences (``stats.bounded.rare_differences``) before
Student's t is taken, as D. G. Bonett and R. M. Price (Statistical Methods in Medical Research 21
(2012) 449-466) add them to paired outcomes. The interval and the p-value rest on the same sample,
so p is below 0.05 where the 95 % interval leaves out 0. Paired outcomes 0 and 1 have the exact
p-value of McNemar, which may be on the other side of 0.05 where the interval ends close to 0.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pandas as pd
from scipy import stats

from analysis.names import REWARD, SHARES
from analysis.stats.bounded import rare_differences
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

    If all differences are equal, the interval is degenerate and p is that of the sign test. The
    interval of a single difference is nan.
    """
    mean = mean_interval(differences, level)
    if np.ptp(differences) == 0:
        return mean, sign_test(differences)
    t = abs(mean.mean) / stats.sem(differences)
    return mean, float(2 * stats.t.sf(t, differences.size - 1))


def difference_test(
    a: np.ndarray, b: np.ndarray, metric: str, level: float
) -> tuple[Interval, float]:
    """The mean difference A - B of pairs, the interval that suits the metric, and the p-value.

    Args:
        a: (n,) values of A.
        b: (n,) values of B.
        metric: The metric; Student's t, if nothing is known of its rare differences.
        level: Confidence level.
    """
    differences = differences_of(a, b)
    rare = rare_differences(metric, a.mean(), b.mean())
    if rare is None or (metric == REWARD and differences.size == 1):
        return t_test(differences, level)
    smooth, p = t_test(smoothed(differences, rare), level)
    if metric in SHARES and np.isin(differences, (-1, 0, 1)).all():
        p = mcnemar(int(np.sum(differences > 0)), int(np.sum(differences < 0)))
    limit = np.inf if metric == REWARD else 1.0
    mean = float(differences.mean())
    return Interval(mean, max(smooth.low, -limit), min(smooth.high, limit)), p


@cache
def mcnemar(gains: int, losses: int) -> float:
    """The p-value of McNemar's exact test."""
    return float(stats.binomtest(gains, gains + losses).pvalue) if gains + losses else 1.0


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
    present = differences.notna()
    table = column_intervals(differences).rename(columns={"mean": "difference"})
    n, mean = table["n"], table["difference"]
    own = values.where(present).mean()
    rare = rare_differences(metric, own, own - mean)
    if rare is None:
        t = (mean / differences.sem()).abs()
        table["p"] = 2 * stats.t.sf(t, np.maximum(n - 1, 1))
        for column in differences.columns[constant & (n > 0)]:
            table.loc[column, "p"] = sign_test(differences[column].dropna().to_numpy())
            if n[column] > 1:
                table.loc[column, ["low", "high"]] = mean[column]
        return table
    size = n + 2
    centre = (n * mean + rare[0] + rare[1]) / size
    squares = n * (differences.var(ddof=0) + (mean - centre) ** 2)
    squares += (rare[0] - centre) ** 2 + (rare[1] - centre) ** 2
    error = np.sqrt(squares / (size - 1) / size)
    half = stats.t.isf((1 - LEVEL) / 2, size - 1) * error
    table["low"], table["high"] = centre - half, centre + half
    table["p"] = 2 * stats.t.sf((centre / error).abs(), size - 1)
    if metric == REWARD:
        table.loc[n == 1, ["low", "high", "p"]] = np.nan, np.nan, 1.0
    else:
        table[["low", "high"]] = table[["low", "high"]].clip(-1, 1)
    if metric in SHARES:
        gains, losses = (differences > 0).sum(), (differences < 0).sum()
        exact = (differences.isin((-1, 0, 1)) | ~present).all() & (n > 0)
        table.loc[exact, "p"] = [*map(mcnemar, gains[exact], losses[exact])]
    return table


def sign_test(equal: np.ndarray) -> float:
    """The two-sided p-value of n equal differences: 2^(1 - n), or 1 if they are 0."""
    return min(1.0, 2 * 0.5 ** len(equal)) if equal[0] else 1.0


def smoothed(differences: np.ndarray, rare: Sequence[float] = (1.0, -1.0)) -> np.ndarray:
    """The differences with rare ones added, along the last axis: one gain and one loss."""
    more = np.broadcast_to(np.asarray(rare, float), (*differences.shape[:-1], 2))
    return np.concatenate([differences, more], axis=-1)
