"""Differences of treatments on the same missions, with their tests."""

from collections.abc import Sequence
from functools import cache
from math import hypot
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy
from scipy.special import stdtr

from dess import InputError
from dess.analysis.metrics import REWARD, Metric, metric_group, metric_of
from dess.analysis.stats.corrections import Correction, add_adjusted
from dess.analysis.stats.intervals import Interval, mean_interval
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.matching import (
    Treatment,
    check_same_missions,
    group_key,
    match_groups,
    metrics_by_group,
    metrics_by_treatment,
    select_table,
)
from dess.analysis.stats.rows import check_share

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
    t = abs(mean.mean) / scipy.stats.sem(differences)
    return mean, float(2 * stdtr(differences.size - 1, -t))


def difference_test(
    a: np.ndarray,
    b: np.ndarray,
    metric: str | Metric,
    level: float,
    metric_of_b: Metric | None = None,
) -> tuple[Interval, float]:
    """The mean difference A - B of pairs, the interval that suits the metric, and its p-value.

    The interval ends where the ranges of both sides end: the wait for a pad is not shorter than
    where no UAV can wait.

    Args:
        a: (n,) values of A.
        b: (n,) values of B.
        metric: The metric; Student's t, if nothing is known of its rare differences.
        level: Confidence level.
        metric_of_b: The metric with the range that it has on side B; by default the same.
    """
    differences = differences_of(a, b)
    measure = metric_of(metric)
    level = measure.level_of_each(level)
    rare = rare_differences(measure, a.mean(), b.mean(), metric_of_b)
    if rare is None or (differences.size == 1 and not measure.is_bounded):
        interval, p = t_test(differences, level)
    else:
        interval, p = t_test(add_rare_pairs(differences, rare), level)
    if measure.is_outcome and np.isin(differences, (-1, 0, 1)).all():
        p = mcnemar_p_value(int(np.sum(differences > 0)), int(np.sum(differences < 0)))
    p = min(p * measure.among, 1.0)
    mean = float(differences.mean())
    lowest, highest = range_of_difference(measure, metric_of_b)
    # A mean at an end of the range may lie beyond it by rounding; nan stays nan.
    low = np.minimum(np.maximum(interval.low, lowest), mean)
    high = np.maximum(np.minimum(interval.high, highest), mean)
    return Interval(mean, float(low), float(high)), p


def range_of_difference(metric: Metric, metric_of_b: Metric | None = None) -> tuple[Any, Any]:
    """The lowest and the highest difference A - B that two values of a metric can have.

    Args:
        metric: The metric, with its range on side A.
        metric_of_b: The metric with its range on side B; by default the same.
    """
    least, most = metric.range
    least_of_b, most_of_b = (metric_of_b or metric).range
    return least - most_of_b, most - least_of_b


def rare_differences(
    metric: Metric, a: Any, b: Any, metric_of_b: Metric | None = None
) -> tuple[Any, Any] | None:
    """The differences A - B of missions in which only one of two policies does well.

    For outcomes, they are 1 and -1. Of a metric with a known range, one value goes to an end of
    the range, and the other one stays at its mean: what goes further counts. So a share falls to 0,
    an age rises to what it is where no UAV flies, and a cost rises by the price of a lost fleet. A
    reward changes by what a failure costs.

    Args:
        metric: The metric; that of missions (``metric_in_missions``) has the range of a time.
        a: (...) means of A.
        b: (...) means of B.
        metric_of_b: The metric with the range that it has on side B; by default the same.

    Returns:
        The (...) highest and the (...) lowest differences; None if they are not known.
    """
    if metric.is_outcome:
        return 0 * (a - b) + 1, 0 * (a - b) - 1
    other = metric_of_b or metric
    if metric.has_range and other.has_range:
        least, most = metric.range
        least_of_b, most_of_b = other.range
        return np.maximum(a - least_of_b, most - b), -np.maximum(b - least, most_of_b - a)
    if metric.failure:
        return a - b + metric.failure, a - b - metric.failure
    return None


@cache
def mcnemar_p_value(gains: int, losses: int) -> float:
    """The p-value of McNemar's exact test."""
    if gains + losses:
        return float(scipy.stats.binomtest(gains, gains + losses).pvalue)
    return 1.0


def column_tests(
    values: pd.DataFrame,
    baseline: pd.Series,
    metric: str | Metric = "",
    levels: float | np.ndarray = LEVEL,
    metric_of_baseline: Metric | None = None,
) -> pd.DataFrame:
    """Paired comparisons of many columns with a baseline, as ``compare_pairs`` makes them.

    Args:
        values: (R, K) a row per replication; nan where a column lacks one.
        baseline: (R,) the values of the baseline.
        metric: The metric; by default one without bounds. The ends of its range may be (K,) arrays.
        levels: The confidence level, or (K,) levels.
        metric_of_baseline: The metric with the range that it has there; by default the same.

    Returns:
        (K, 5): ``difference`` (column - baseline) with ``low``, ``high``, ``p`` and ``n``.
    """
    of_baseline = baseline.to_numpy(float)
    measure = metric_of(metric)
    rows = []
    levels = np.broadcast_to(levels, values.shape[1])
    for place, (column, level) in enumerate(zip(values, levels, strict=True)):
        of_column = values[column].to_numpy(float)
        measured = ~np.isnan(of_column) & ~np.isnan(of_baseline)
        ends = Interval(np.nan, np.nan, np.nan)
        p = np.nan
        if measured.any():
            pairs = of_column[measured], of_baseline[measured]
            measure_there = measure.at(place)
            ends, p = difference_test(*pairs, measure_there, float(level), metric_of_baseline)
        rows.append((*ends, p, measured.sum()))
    return pd.DataFrame(rows, values.columns, ["difference", "low", "high", "p", "n"])


def sign_test(equal: np.ndarray) -> float:
    """The two-sided p-value of n equal differences: 2^(1 - n), or 1 if they are 0."""
    if equal[0]:
        return min(1.0, 2 * 0.5 ** len(equal))
    return 1.0


def add_rare_pairs(differences: np.ndarray, rare: Sequence[float] = (1.0, -1.0)) -> np.ndarray:
    """The differences with rare ones added, along the last axis: one gain and one loss."""
    more = np.broadcast_to(np.asarray(rare, float), (*differences.shape[:-1], 2))
    return np.concatenate([differences, more], axis=-1)


class Paired(NamedTuple):
    """A comparison of n pairs: the mean difference, its interval, and the gain by pairing.

    ``variance_reduction`` is v = 1 - Var(A - B) / (Var A + Var B). Without common random numbers,
    1 / (1 - v) times as many missions would be needed. If v is negative, pairing made the interval
    wider. ``student`` is half the length of Student's interval of these differences, without what
    is added for rare failures; nan for a single pair. ``p_student`` is its p-value; of outcomes,
    whose exact test adds nothing, it is ``p``.
    """

    difference: float
    low: float
    high: float
    p: float
    correlation: float
    variance_reduction: float
    n: int
    student: float = np.nan
    p_student: float = np.nan


def compare_pairs(
    a: np.ndarray,
    b: np.ndarray,
    level: float = LEVEL,
    metric: str | Metric = "",
    metric_of_b: Metric | None = None,
) -> Paired:
    """Compare two samples pair by pair; differences are A - B.

    Args:
        a: (n,) values of A.
        b: (n,) values of B; entry r forms a pair with entry r of A.
        level: Confidence level.
        metric: The metric of the values; by default one without bounds. Post-stratified values of
            shares may lie outside [0, 1].
        metric_of_b: The metric with the range that it has on side B; by default the same.

    Returns:
        The interval and the p-value of ``differences.difference_test``: of Student's t, with
        rare differences added for all metrics of known range, and for the reward, and ends where
        the ranges of both sides do.

        - If all differences of another metric are equal (up to rounding), the interval is
          degenerate (low = difference = high). p is that of the sign test, 2^(1 - n); it is 1 if
          all differences are 0.
        - A single pair of a metric without bounds has no interval: its ends are nan, and p is 1.
        - If A or B is constant, their correlation is 0. If both are, the variance reduction is 0.
    """
    mean, p = difference_test(a, b, metric, level, metric_of_b)
    differences = differences_of(a, b)
    of_a, of_b, of_differences = map(_sample_variance, (a, b, differences))
    correlation = 0.0
    if of_a and of_b:
        correlation = float(np.corrcoef(a, b)[0, 1])
    reduction = 0.0
    if of_a + of_b:
        reduction = 1 - of_differences / (of_a + of_b)
    plain, p_student = t_test(differences, level)
    half = (plain.high - plain.low) / 2
    if metric_of(metric).is_outcome:
        p_student = p
    return Paired(*mean, p, correlation, reduction, a.size, half, p_student)


def compare_unpaired(a: Sequence[float], b: Sequence[float], metric: str) -> Paired:
    """Compare two samples of different missions by Welch's t test; differences are A - B.

    To both samples of a share, a 0 and a 1 are added for the test (A. Agresti and B. Caffo, The
    American Statistician 54 (2000) 280-288), so that samples without any failure have an interval.

    Returns:
        The comparison without what only pairs have, which is nan; ``n`` is that of the smaller one.
    """
    more = [] if metric == REWARD else [0.0, 1.0]
    test = scipy.stats.ttest_ind([*a, *more], [*b, *more], equal_var=False)
    ends = test.confidence_interval(LEVEL)
    p = 1.0
    if not np.isnan(test.pvalue):
        p = float(test.pvalue)
    n = min(len(a), len(b))
    difference = float(np.mean(a) - np.mean(b))
    low, high = np.clip((ends.low, ends.high), *range_of_difference(metric_of(metric)))
    return Paired(difference, float(low), float(high), p, np.nan, np.nan, n)


def difference_of_intervals(mean: Interval, other: Interval) -> Interval:
    """How much higher a mean is than another one, from their two intervals.

    Source: R. G. Newcombe, Statistics in Medicine 17 (1998) 873-890, method 10.
    """
    difference = mean.mean - other.mean
    below = hypot(mean.mean - mean.low, other.high - other.mean)
    beyond = hypot(mean.high - mean.mean, other.mean - other.low)
    return Interval(difference, difference - below, difference + beyond)


def relative_change(
    values: np.ndarray,
    reference: np.ndarray,
    metric: str | Metric = "",
    metric_of_reference: Metric | None = None,
) -> Interval:
    """The change of a mean as a share of a reference mean, with the interval of a ratio of means.

    Source: W. G. Cochran, Sampling Techniques, 3rd edition, 1977, Section 6.3: the variance of the
    ratio of two means of paired values; with Student's quantile. As in ``difference_test``, rare
    differences are added: one value at an end of the metric's range, the other one at its mean.

    Args:
        values: (n,) values.
        reference: (n,) reference values of the same replications, whose mean is not 0.
        metric: The metric; by default one without bounds.
        metric_of_reference: The metric with the range that it has there; by default the same.
    """
    mean = values.mean()
    base = reference.mean()
    n = len(values)
    measure = metric_of(metric)
    ratio = float(mean / base)
    if n == 1:
        return Interval(ratio - 1, np.nan, np.nan)
    residuals = values - ratio * reference
    other = metric_of_reference or measure
    least, most = measure.range
    if measure.has_range and other.has_range:
        least_there, most_there = other.range
        more = max(most - mean, mean - ratio * least_there)
        less = min(least - mean, mean - ratio * most_there)
        residuals = add_rare_pairs(residuals, (more, less))
    _, low, high = (ratio - 1 + end for end in mean_interval(residuals / abs(base)))
    return Interval(ratio - 1, max(low, -1.0) if least >= 0 else low, high)


def compare(
    missions: pd.DataFrame,
    baseline: str | int,
    metrics: Sequence[str] = (*metric_group("paper", "reward"),),
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
        correction: Correction of the p-values over all rows: ``holm`` or ``fdr``. With None, there
            is no column ``p_adjusted``.
        of: What is compared: ``policy`` or ``point``.

    Returns:
        A row per policy (in order of first appearance), group (in order of their values) and
        metric: ``policy`` (or ``point``), ``baseline``, the columns ``by``, ``metric``, the fields
        of ``Paired`` and, after ``p``, ``p_adjusted``. A positive difference means that the value
        is above that of the baseline. What a mission of a pair did not measure is left out. If a
        group has several missions of a replication (at several
        design points, which share its random draws), their means are compared, and ``n`` is the
        number of replications. Where the number of UAVs is drawn, means and differences are
        post-stratified by it (``stats.weights.post_stratified``).

    Raises:
        InputError: If a column is missing or does not contain numbers, the baseline is missing or
            the only one, a mission appears twice or only for one of a pair, or an argument is not
            allowed.
    """
    check_share("level", level)
    tables = metrics_by_treatment(missions, of, metrics, by)
    reference = select_table(tables, of, baseline)
    others = [name for name in tables if name != baseline]
    if not others:
        raise InputError(of, f"nothing to compare with {baseline}", "two or more")
    rows = []
    measures = metrics_by_group(missions, metrics, [of, *by])
    for name in others:
        check_same_missions(tables, name, baseline)
        for group, (a, b) in match_groups([tables[name], reference], by):
            for metric in metrics:
                measured = ~np.isnan(a[metric]) & ~np.isnan(b[metric])
                if measured.any():
                    pairs = a[metric][measured], b[metric][measured]
                    ranges = [
                        measures[metric, side, *group_key(group)] for side in (name, baseline)
                    ]
                    result = compare_pairs(*pairs, level, *ranges)
                    rows.append((name, baseline, *group, metric, *result))
    columns = [of, "baseline", *by, "metric", *Paired._fields]
    return add_adjusted(pd.DataFrame(rows, columns=columns), correction)


def _sample_variance(values: np.ndarray) -> float:
    if np.ptp(values):
        return float(values.var())
    return 0.0
