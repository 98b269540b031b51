"""Paired comparisons of A with B under common random numbers.

Replication r of two policies, or of two design points, has the same random draws. So missions are
compared pair by pair, and the randomness that both share cancels in the difference:

    compare(results.missions, "greedy")
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from analysis.names import MEANS, SHARES
from analysis.stats.correction import Correction, with_adjusted
from analysis.stats.differences import difference_test, differences_of
from analysis.stats.intervals import LEVEL, Interval, check_share
from analysis.stats.matching import (
    Treatment,
    check_same_missions,
    matched,
    metrics_by_treatment,
    select,
)
from dess import InputError


class Paired(NamedTuple):
    """A comparison of n pairs: the mean difference, its interval, and the gain by pairing.

    ``variance_reduction`` is v = 1 - Var(A - B) / (Var A + Var B). Without common random numbers,
    1 / (1 - v) times as many missions would be needed. If v is negative, pairing made the interval
    wider.
    """

    difference: float
    low: float
    high: float
    p: float
    correlation: float
    variance_reduction: float
    n: int


def paired(a: np.ndarray, b: np.ndarray, level: float = LEVEL, metric: str = "") -> Paired:
    """Compare two samples pair by pair; differences are A - B.

    Args:
        a: (n,) values of A.
        b: (n,) values of B; entry r forms a pair with entry r of A.
        level: Confidence level.
        metric: The metric of the values; by default one without bounds. Post-stratified values of
            shares may lie outside [0, 1].

    Returns:
        The interval and the p-value of ``differences.difference_test``: of Student's t, with
        rare differences added for the success, metrics from 0 to 1 and the reward.

        - If all differences of another metric are equal (up to rounding), the interval is
          degenerate (low = difference = high). p is that of the sign test, 2^(1 - n); it is 1 if
          all differences are 0.
        - A single pair of a metric without bounds has no interval: its ends are nan, and p is 1.
        - If A or B is constant, their correlation is 0. If both are, the variance reduction is 0.

    Raises:
        ValueError: If the samples are empty or differ in length.
    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.shape != b.shape or not a.size:
        raise ValueError(f"paired: {a.size} and {b.size} values; allowed: as many, at least one")
    mean, p = difference_test(a, b, metric, level)
    differences = differences_of(a, b)
    of_a, of_b, of_differences = map(_variance, (a, b, differences))
    correlation = float(np.corrcoef(a, b)[0, 1]) if of_a and of_b else 0.0
    reduction = 1 - of_differences / (of_a + of_b) if of_a + of_b else 0.0
    return Paired(*mean, p, correlation, reduction, a.size)


def relative_change(values: np.ndarray, reference: np.ndarray, level: float = LEVEL) -> Interval:
    """The change of a mean as a share of a reference mean, with the interval of a ratio of means.

    Source: W. G. Cochran, Sampling Techniques, 3rd edition, 1977, Section 6.3: the variance of the
    ratio of two means of paired values; with Student's quantile.

    Args:
        values: (n,) values.
        reference: (n,) reference values of the same replications, whose mean is not 0.
        level: Confidence level.
    """
    ratio, n = float(values.mean() / reference.mean()), len(values)
    if n == 1:
        return Interval(ratio - 1, np.nan, np.nan)
    error = np.std(values - ratio * reference, ddof=1) / np.sqrt(n) / abs(reference.mean())
    half = float(stats.t.isf((1 - level) / 2, n - 1) * error)
    return Interval(ratio - 1, ratio - 1 - half, ratio - 1 + half)


def compare(
    missions: pd.DataFrame,
    baseline: str | int,
    metrics: Sequence[str] = (*SHARES, *MEANS),
    by: Sequence[str] = (),
    level: float = LEVEL,
    correction: Correction | None = "holm",
    of: Treatment = "policy",
) -> pd.DataFrame:
    """Compare every other policy, or design point, with a baseline, mission by mission.

    Args:
        missions: A row per mission, with the metrics, the fields of ``by`` and, as far as they
            exist, ``policy``, ``point``, ``seed`` and ``replication``.
        baseline: The policy, or the number of the design point, to compare with.
        metrics: Columns of numbers.
        by: Columns whose values form groups of missions, compared one by one.
        level: Confidence level of each interval.
        correction: Correction of the p-values over all rows, as for ``correction.adjust``.
        of: What is compared: ``policy`` or ``point``.

    Returns:
        A row per policy (in order of first appearance), group (in order of their values) and
        metric: ``policy`` (or ``point``), ``baseline``, the columns ``by``, ``metric``, the fields
        of ``Paired`` and, after ``p``, ``p_adjusted``. A positive difference means that the value
        is above that of the baseline. What a mission of a pair did not measure is left out. If a
        group has several missions of a replication (at several
        design points, which share its random draws), their means are compared, and ``n`` is the
        number of replications. Where the number of UAVs is drawn, means and differences are
        post-stratified by it (``stats.intervals.post_stratified``).

    Raises:
        InputError: If a column is missing or does not contain numbers, the baseline is missing or
            the only one, a mission appears twice or only for one of a pair, or an argument is not
            allowed.
    """
    check_share("level", level)
    tables = metrics_by_treatment(missions, of, metrics, by)
    reference = select(tables, of, baseline)
    others = [name for name in tables if name != baseline]
    if not others:
        raise InputError(f"{of}: nothing to compare with {baseline}; allowed: two or more")
    rows = []
    for name in others:
        check_same_missions(tables, name, baseline)
        for group, (a, b) in matched([tables[name], reference], by):
            for metric in metrics:
                measured = ~np.isnan(a[metric]) & ~np.isnan(b[metric])
                if measured.any():
                    result = paired(a[metric][measured], b[metric][measured], level, metric)
                    rows.append((name, baseline, *group, metric, *result))
    columns = [of, "baseline", *by, "metric", *Paired._fields]
    return with_adjusted(pd.DataFrame(rows, columns=columns), correction)


def _variance(values: np.ndarray) -> float:
    return float(values.var()) if np.ptp(values) else 0.0
