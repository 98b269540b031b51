"""Intervals of means, shares, quantiles and other statistics of missions, and what they rest on.

Means of the product, whose values are between 0 and 1 and whose failures may be rare, have bounded
intervals; statistics that have no formula are bootstrapped.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import reduce
from typing import Any, NamedTuple, Self

import numpy as np
import pandas as pd
import scipy
from scipy.special import ndtr, ndtri, stdtrit

from dess import InputError
from dess.analysis.metrics import (
    NODES_BEHIND,
    PRODUCT,
    Metric,
    metric_in_missions,
    metric_of,
    metrics_in,
)
from dess.base.errors import unknown_name

LEVEL = 0.95


def level_after(looks: Any, level: float = LEVEL) -> Any:
    """The level of each interval so that it covers at ``level`` after a search.

    A search ends the missions of a setting after a look at their results, so an interval at the
    plain level covers too seldom: the search stops where the results are extreme. After look k, the
    interval has the error (1 - level) / (k (k + 1)). These errors add up to 1 - level over all
    looks, so the interval covers at ``level``, whichever look was the last (the union bound).

    Args:
        looks: (...) numbers of looks; 0 where the number of missions was fixed.
        level: The level after the search.
    """
    return 1 - (1 - level) / np.maximum(looks * (looks + 1), 1)


def ends_of_means(
    metric: Metric, mean: Any, variance: Any, skewness: Any, n: Any, level: Any = LEVEL
) -> tuple[Any, Any]:
    """The ends of the confidence intervals of means of a metric: here it is decided which it has.

    Rare missions may lie far from all others: UAVs are lost, and a sample of some hundred missions
    often has none of these. Where the values of such missions are known (``rare_values``), the
    interval allows for them (``ends_with_rare``). All other metrics have the interval of
    ``skewed_ends``. Both end where the range of the metric does.

    A single mission of an unbounded metric has no interval. Outcomes of which all are 0 or 1 have
    Wilson's interval instead (``share_interval``).

    Args:
        metric: The metric. The ends of its range may be arrays, with one for each sample.
        mean: (...) means of the samples.
        variance: (...) mean squared deviations of the samples from these means.
        skewness: (...) skewness of the samples (``skewness_of``).
        n: (...) numbers of values, above 0; not whole where it is an effective number.
        level: Confidence level, or (...) levels.

    Returns:
        (...) lower and (...) upper ends, with low <= mean <= high.
    """
    rare = rare_values(metric, mean)
    if rare is None:
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.sqrt(variance / (n - 1))
        low, high = skewed_ends(mean, error, skewness, n, level)
    else:
        low, high = ends_with_rare(mean, variance, n, rare, level)
        if not metric.is_bounded:
            low, high = (np.where(np.asarray(n) > 1, end, np.nan) for end in (low, high))
    least, most = metric.range
    # A mean at an end of the range may lie beyond it by rounding.
    low = np.minimum(np.clip(low, least, most), mean)
    high = np.maximum(np.clip(high, least, most), mean)
    return low, high


def rare_values(metric: Metric, mean: Any) -> tuple[Any, Any] | None:
    """The lowest and the highest value that a rare mission may have of a metric.

    They are the ends of its range or, where these are not known, what a failure makes of the mean.

    Args:
        metric: The metric; that of missions (``metric_in_missions``) has the range of a time, a
            cost or an amount of data.
        mean: (...) means of the metric.

    Returns:
        (...) the lowest and (...) the highest values; None if nothing is known of them.
    """
    if metric.has_range:
        return metric.range
    if metric.failure:
        return np.maximum(mean - metric.failure, metric.range[0]), mean + metric.failure
    return None


def ends_with_rare(
    mean: Any, variance: Any, n: Any, rare: tuple[Any, Any], level: Any = LEVEL
) -> tuple[Any, Any]:
    """The ends of Student's intervals of samples to which rare values are added.

    Of each of the two rare values, ``ndtri((1 + level) / 2)**2 / 4`` are added: 0.96 at 95 %, 1.66
    at 99 %. The more certain the interval, the rarer the values that it must allow for. For shares,
    whose rare values are 0 and 1, A. Agresti and B. Caffo (The American Statistician 54 (2000)
    280-288) add nearly the same, one of each.

    Args:
        mean: (...) means of the samples.
        variance: (...) mean squared deviations of the samples from these means.
        n: (...) numbers of values, above 0; not whole where it is an effective number.
        rare: (...) the lowest and (...) the highest value that a rare mission may have.
        level: Confidence level, or (...) levels.

    Returns:
        (...) lower and (...) upper ends, with low <= mean <= high.
    """
    least, most = rare
    added = ndtri((1 + level) / 2) ** 2 / 4
    size = n + 2 * added
    centre = (n * mean + added * (least + most)) / size
    squares = n * (variance + (mean - centre) ** 2)
    squares = squares + added * ((least - centre) ** 2 + (most - centre) ** 2)
    half = stdtrit(size - 1, (1 + level) / 2) * np.sqrt(squares / (size - 1) / size)
    return np.minimum(centre - half, mean), np.maximum(centre + half, mean)


def bounded_ends(mean: Any, variance: Any, n: Any, level: Any = LEVEL) -> tuple[Any, Any]:
    """The ends of the confidence intervals of means of values from 0 to 1, see ``ends_of_means``.

    Returns:
        (...) lower and (...) upper ends, with 0 <= low <= mean <= high <= 1 and low < high.
    """
    return ends_of_means(metric_of(PRODUCT), mean, variance, 0.0, n, level)


def skewed_ends(mean: Any, error: Any, skewness: Any, n: Any, level: Any = LEVEL) -> Any:
    """The ends of the confidence intervals of means of skewed values.

    Student's interval covers too seldom where few values are much larger than the others, as ages
    and costs are. Here the Student t of the mean is transformed so that its skewness disappears.
    Without skewness, the ends are Student's.

    Source: P. Hall, On the removal of skewness by transformation, J. R. Statist. Soc. B 54 (1992)
    221-228, with Student's quantile in place of the normal one.

    Args:
        mean: (...) means of the samples.
        error: (...) their standard errors.
        skewness: (...) skewness of the samples (``skewness_of``).
        n: (...) numbers of values.
        level: Confidence level, or (...) levels.

    Returns:
        (...) lower and (...) upper ends; nan where the standard error is.
    """
    quantile = stdtrit(np.maximum(n - 1, 1), (1 + level) / 2)
    slope = skewness / np.sqrt(n) / 3
    low = mean - error * _skewed_quantile(quantile, slope)
    high = mean - error * _skewed_quantile(-quantile, slope)
    return low, high


def _skewed_quantile(quantile: Any, slope: Any) -> Any:
    """The t with a slope of skewness that belongs to a quantile without: Hall's inverse."""
    cube = 3 * slope * (quantile - slope / 2)
    near = np.expm1(np.log1p(np.maximum(cube, -0.5)) / 3)  # exact for a small slope
    root = np.where(cube > -0.5, near, np.cbrt(1 + cube) - 1)
    return np.where(slope == 0, quantile, root / np.where(slope == 0, 1, slope))


def skewness_of(squares: Any, cubes: Any, n: Any) -> Any:
    """The skewness of samples, with the usual correction for their size; 0 if it is not known.

    Args:
        squares: (...) sums of squared deviations from the mean.
        cubes: (...) sums of cubed deviations.
        n: (...) numbers of values.
    """
    is_known = (n > 2) & (squares > 0)
    size = np.where(is_known, n, 3)
    spread = np.where(is_known, squares, 1.0)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        plain = np.sqrt(size) * cubes / spread**1.5
    skewness = np.sqrt(size * (size - 1)) / (size - 2) * plain
    return np.where(is_known & np.isfinite(skewness), skewness, 0.0)


def rare_differences(metric: Metric, a: Any, b: Any) -> tuple[Any, Any] | None:
    """The differences A - B of missions in which only one of two policies does well.

    For outcomes, they are 1 and -1. Of a metric with a known range, one value goes to an end of
    the range, and the other one stays at its mean: what goes further counts. So a share falls to 0,
    an age rises to what it is where no UAV flies, and a cost rises by the price of a lost fleet. A
    reward changes by what a failure costs.

    Args:
        metric: The metric; that of missions (``metric_in_missions``) has the range of a time.
        a: (...) means of A.
        b: (...) means of B.

    Returns:
        The (...) highest and the (...) lowest differences; None if they are not known.
    """
    if metric.is_outcome:
        return 0 * (a - b) + 1, 0 * (a - b) - 1
    if metric.has_range:
        least, most = metric.range
        return np.maximum(a - least, most - b), -np.maximum(b - least, most - a)
    if metric.failure:
        return a - b + metric.failure, a - b - metric.failure
    return None


LEAST = 5  # missions of every number of UAVs for a post-stratified mean


class Interval(NamedTuple):
    """An estimate and the ends of its confidence interval."""

    mean: float
    low: float
    high: float


class Moments(NamedTuple):
    """What the interval of a mean depends on: it takes no more memory for more values.

    Attributes:
        n: Number of values.
        total: Their sum.
        squares: Sum of their squared deviations from the mean.
        cubes: Sum of their cubed deviations.
        least: The smallest value.
        most: The largest value.
    """

    n: int
    total: float
    squares: float
    cubes: float
    least: float
    most: float

    @classmethod
    def of(cls, values: Sequence[float] | np.ndarray) -> Self:
        """The moments of values, of which there is one or more."""
        sample = np.asarray(values, float)
        total = float(sample.sum())
        deviations = sample - total / sample.size
        squares = float((deviations**2).sum())
        cubes = float((deviations**3).sum())
        return cls(sample.size, total, squares, cubes, float(sample.min()), float(sample.max()))

    @property
    def mean(self) -> float:
        """The mean of the values."""
        return self.total / self.n

    def with_others(self, others: Self) -> Self:
        """The moments of these values and others together.

        Source: T. F. Chan, G. H. Golub, R. J. LeVeque, Algorithms for computing the sample
        variance, The American Statistician 37 (1983) 242-247, eq. 1.5b; of the cubes P. Pebay,
        Formulas for robust, one-pass parallel computation of covariances and arbitrary-order
        statistical moments, Sandia report SAND2008-6212.
        """
        n = self.n + others.n
        apart = others.mean - self.mean
        between = self.n * others.n / n * (self.n - others.n) / n
        within = (self.n * others.squares - others.n * self.squares) / n
        return type(self)(
            n,
            self.total + others.total,
            self.squares + others.squares + apart**2 * (self.n / n) * others.n,
            self.cubes + others.cubes + apart**3 * between + 3 * apart * within,
            min(self.least, others.least),
            max(self.most, others.most),
        )

    @classmethod
    def of_worst_node(cls, nodes: Sequence[Self], metric: str | Metric) -> Self:
        """The moments of the linearised values of ``worst_of_nodes``.

        Args:
            nodes: The moments of the metric at each node.
            metric: The metric, of as many nodes.
        """
        means = np.array([node.mean for node in nodes])
        ends = np.array([node.interval(metric)[1:] for node in nodes])
        worst, farthest, wider = worst_and_spread(means, ends, metric)
        chosen = nodes[int(farthest)]
        mean = float(means[worst])
        scale = float(wider)
        return cls(
            n=chosen.n,
            total=mean * chosen.n,
            squares=chosen.squares * scale**2,
            cubes=chosen.cubes * scale**3,
            least=mean + scale * (chosen.least - chosen.mean),
            most=mean + scale * (chosen.most - chosen.mean),
        )

    @classmethod
    def of_space(cls, fleets: Sequence[Self | None], missions: int) -> Self:
        """The moments of the linearised values of ``post_stratified``.

        Args:
            fleets: For every number of UAVs that may be drawn the moments of its missions; None
                where it has none.
            missions: Number of missions; what some of them have not measured has a plain mean.
        """
        drawn = [fleet for fleet in fleets if fleet]
        whole = reduce(cls.with_others, drawn)
        counts = np.array([fleet.n if fleet else 0 for fleet in fleets])
        weights = weights_of_fleets(counts)
        if weights is None or whole.n < missions:
            return whole
        mean = float(np.mean([fleet.mean for fleet in drawn]))
        spread = weights**2 * counts / (counts - 1) * (1 - 1 / whole.n)
        squares = float(spread @ [fleet.squares for fleet in drawn])
        cubes = float(spread**1.5 @ [fleet.cubes for fleet in drawn])
        return whole._replace(total=mean * whole.n, squares=squares, cubes=cubes)

    def interval(self, metric: str | Metric, level: float = LEVEL) -> Interval:
        """The mean of a metric with the interval of ``interval_of``."""
        measure = metric_of(metric)
        level = measure.level_of_each(level)
        if measure.is_outcome and self._are_outcomes:
            return share_interval(int(self.total), self.n, level)
        plain = self.student(level)
        if rare_values(measure, self.mean) is None and not plain.low < plain.high:
            return plain
        skewness = skewness_of(self.squares, self.cubes, self.n)
        ends = ends_of_means(measure, self.mean, self.squares / self.n, skewness, self.n, level)
        return Interval(self.mean, *map(float, ends))

    @property
    def _are_outcomes(self) -> bool:
        """Whether all values may be 0 or 1: they have the sum and the spread of such."""
        spread = self.total * (self.n - self.total) / self.n
        return self.total.is_integer() and bool(np.isclose(self.squares, spread, atol=1e-9))

    def student(self, level: float = LEVEL) -> Interval:
        """The mean with the interval of ``mean_interval``."""
        if self.least == self.most or not self.squares:  # the square of a tiny number is 0
            half = 0.0 if self.n > 1 else np.nan
            return Interval(self.mean, self.mean - half, self.mean + half)
        error = np.sqrt(self.squares / (self.n - 1)) / np.sqrt(self.n)
        ends = stdtrit(self.n - 1, [(1 - level) / 2, (1 + level) / 2]) * error + self.mean
        return Interval(self.mean, *map(float, ends))


def share_half_width(successes: Any, n: Any, level: float = LEVEL) -> Any:
    """Half the length of the Wilson score interval of a share of successes, or of an array."""
    share = successes / n
    z = ndtri(0.5 + 0.5 * level)
    return z / (2 * (n + z**2)) * np.sqrt(4 * n * share * (1 - share) + z**2)


def share_interval(successes: int, n: int, level: float = LEVEL) -> Interval:
    """Share of successes with its Wilson score interval, which holds near 0 and 1 as well."""
    share = successes / n
    z = ndtri(0.5 + 0.5 * level)
    centre = (2 * n * share + z**2) / (2 * (n + z**2))
    half = share_half_width(successes, n, level)
    low = 0.0
    if successes:
        low = float(centre - half)
    return Interval(share, low, float(centre + half) if successes < n else 1.0)


def bounded_interval(values: Sequence[float] | np.ndarray, level: float = LEVEL) -> Interval:
    """Mean of values from 0 to 1 with its interval, see ``bounded_ends``."""
    return Moments.of(values).interval(PRODUCT, level)


def mean_interval(values: Sequence[float] | np.ndarray, level: float = LEVEL) -> Interval:
    """Mean with its Student t interval: for values that are hardly skewed, and for differences.

    The means of metrics have the intervals of ``interval_of``. Equal values give a degenerate
    interval (low = mean = high). The ends of a single value are nan, because it says nothing about
    the spread.
    """
    return Moments.of(values).student(level)


def interval_of(
    metric: str | Metric, values: Sequence[float] | np.ndarray, level: float = LEVEL
) -> Interval:
    """The mean of a metric of missions with the interval that is fit for it.

    Wilson's interval for outcomes of ``success``, and that of ``ends_of_means`` for all others.
    """
    return Moments.of(values).interval(metric, level)


def stratified_interval(values: np.ndarray, metric: str | Metric, level: float = LEVEL) -> Interval:
    """Mean of the means of fixed design points with its interval: the points are strata.

    What differs from point to point is no chance, so the interval rests on the variance within the
    points. A replication has the same realisation at all points, so what it adds to the mean is
    counted as one contribution, as of a cluster of a stratified sample: this is the linearised
    variance of W. G. Cochran (Sampling Techniques, 3rd edition, 1977, Section 11.18). Where rare
    values are added (``ends_of_means``), it is with the effective number of missions of L. Kish
    (Survey Sampling, 1965, Section 8.2): all missions, divided by how much more the mean varies
    than if every point had replications of its own. N. Dean and M. Pagano (Journal of Survey
    Statistics and Methodology 3 (2015) 484-503) find it good for shares of clustered samples.

    Args:
        values: (R, K) values of K design points in R replications; nan where a point lacks one.
            Each point has one at least.
        metric: The metric.
        level: Confidence level.
    """
    measure = metric_of(metric)
    present = ~np.isnan(values)
    n = present.sum(axis=0)
    points = values.shape[1]
    if points == 1:
        return interval_of(measure, values[present], level)
    level = measure.level_of_each(level)
    means = np.nansum(values, axis=0) / n
    residuals = np.where(present, values - means, 0.0)
    mean = float(means.mean())
    common = float(((residuals / n).sum(axis=1) ** 2).sum()) / points**2  # variance of the mean
    replications = int(present.any(axis=1).sum())
    if replications == 1 and not measure.is_bounded:
        return Interval(mean, np.nan, np.nan)
    if rare_values(measure, mean) is None:
        size = float(replications)
        variance = common * replications
    else:
        alone = float(((residuals**2).sum(axis=0) / n**2).sum()) / points**2
        missions = points**2 / float((1 / n).sum())
        effect = float(points)
        if alone:
            effect = min(max(common / alone, 1.0), points)
        size = missions / effect
        variance = alone * missions
    cubes = float(((residuals / n).sum(axis=1) ** 3).sum()) / points**3
    skewness = skewness_of(common, cubes, replications)
    ends = ends_of_means(measure, mean, variance, skewness, size, level)
    return Interval(mean, *map(float, ends))


def summary(
    missions: pd.DataFrame, by: Sequence[str] = ("policy",), level: float = LEVEL
) -> pd.DataFrame:
    """Means with intervals of groups of missions.

    A group with missions at several design points (column ``point``), each of which has two or
    more, has the mean of the points' means and the interval of ``stratified_interval``. Points with
    a single mission each are taken for a sample of the design.

    Args:
        missions: A row per mission, with the fields of ``MISSION_RECORD`` and those of ``by``.
        by: Columns whose values form the groups; without any, all missions are one.
        level: Confidence level.

    Returns:
        A row per group, in order of first appearance, and metric: the columns ``by``, ``metric``
        (``success``, ``collection_ratio``, ``collection_ratio_and_communication``, ``reward``),
        ``mean``, ``low``, ``high`` and ``n``, the number of missions. Extended scenarios add what
        they measure; missions without a value are left out. The intervals are those of
        ``interval_of``.
    """
    strata = "point" in missions and "point" not in by
    rows = []
    for group, part in group_rows(missions, by):
        for metric in metrics_in(missions):
            if n := int(part[metric].count()):
                ends = _interval_of_group(part, metric_in_missions(part, metric), level, strata)
                rows.append((*group, metric, *ends, n))
    return pd.DataFrame(rows, columns=[*by, "metric", "mean", "low", "high", "n"])


def column_intervals(
    values: pd.DataFrame, metric: str | Metric = "", levels: float | np.ndarray = LEVEL
) -> pd.DataFrame:
    """Means of columns with their intervals (``interval_of``), for many columns at once.

    Args:
        values: (R, K) a row per replication, a column per group; nan where a group lacks one.
        metric: The metric; by default one without bounds. Values of ``success`` that are no
            outcomes 0 or 1, but means of such, have the interval of bounded values. The ends of its
            range may be (K,) arrays.
        levels: The confidence level, or (K,) levels.

    Returns:
        (K, 4): ``mean``, ``low``, ``high``, ``n``, with the columns as index; nan without values.
    """
    measure = metric_of(metric)
    n = values.count()
    mean = values.mean()
    level = measure.level_of_each(pd.Series(levels, index=values.columns))
    deviations = values - mean
    skewness = skewness_of((deviations**2).sum(), (deviations**3).sum(), n)
    size = np.maximum(n, 1)
    low, high = ends_of_means(measure, mean, values.var(ddof=0), skewness, size, level)
    table = pd.DataFrame({"mean": mean, "low": low, "high": high, "n": n})
    if measure.is_outcome:
        rows = ((values.isin((0, 1)) | values.isna()).all() & (n > 0)).to_numpy()
        successes = (mean * n)[rows].round().astype(int)
        samples = [*zip(successes, n[rows], level[rows], strict=True)]
        measures = {
            sample: share_interval(*sample)[1:] for sample in {*samples}
        }  # each takes its time
        table.loc[rows, ["low", "high"]] = np.array([measures[s] for s in samples]).reshape(-1, 2)
    return table


def check_columns(missions: pd.DataFrame, needed: Sequence[str]) -> None:
    """Raise ``InputError`` if a needed column is missing."""
    for name in needed:
        if name not in missions:
            raise unknown_name(name, "no such column", name, missions.columns)


def check_share(name: str, share: float) -> None:
    """Raise ``InputError`` unless a share, such as a confidence level, is between 0 and 1."""
    if not (isinstance(share, int | float) and 0 < share < 1):
        raise InputError(name, repr(share), "between 0 and 1")


def group_rows(missions: pd.DataFrame, by: Sequence[str]) -> Iterator[tuple[tuple, pd.DataFrame]]:
    """Groups of rows by the values of columns, in order of first appearance; all without any."""
    yield from missions.groupby(list(by), sort=False, dropna=False) if by else [((), missions)]


def _interval_of_group(
    missions: pd.DataFrame, metric: Metric, level: float, strata: bool
) -> Interval:
    """The mean of a group: over its missions, or over the points that these are at."""
    if strata and missions["point"].nunique() > 1:
        wide = by_replication(missions, metric.column, "point").dropna(axis="columns", how="all")
        if (wide.count() > 1).all():
            # In this order, so that the last bits of sums are the same with every pandas.
            return stratified_interval(np.ascontiguousarray(wide, float), metric, level)
    values = values_within(missions, metric.column, ())
    return interval_of(metric, values[~np.isnan(values)], level)


def weights_of_fleets(counts: np.ndarray) -> np.ndarray | None:
    """The weights of the missions of every number of UAVs, relative to those of a plain mean.

    Every number of UAVs of a scenario space is equally probable, so all have the same weight in a
    mean over the space, however many missions have drawn each: the mean is post-stratified
    (Cochran, Sampling Techniques, 1977, Section 5A.9).

    Args:
        counts: (K,) numbers of missions with each number of UAVs that may be drawn.

    Returns:
        (K,) the weights. None, for a plain mean, if the number is not drawn, or if one of the
        numbers has fewer missions than ``LEAST``, which tell too little about their spread.
    """
    if len(counts) == 1 or counts.min() < LEAST:
        return None
    return counts.sum() / len(counts) / counts


def post_stratified(values: np.ndarray, fleets: np.ndarray) -> np.ndarray:
    """Values whose mean, and its standard error, are post-stratified by the number of UAVs.

    They are the linearised values: the mean of the strata's means, and the weighted deviations from
    the mean of the own stratum. So what tells an interval or a test from a sample of missions takes
    them in place of the values.

    Args:
        values: (n,) values of missions of one scenario space.
        fleets: (n,) their numbers of UAVs; those from the smallest to the largest may be drawn.

    Returns:
        (n,) the linearised values. The values themselves, if ``weights_of_fleets`` gives none, or
        if some are nan: then a mean is over the missions that have measured it, whose fleets have
        unknown weights.
    """
    if not values.size or np.isnan(values).any():
        return values
    stratum = fleets.astype(int) - int(fleets.min())
    counts = np.bincount(stratum)
    weights = weights_of_fleets(counts)
    if weights is None:
        return values
    means = np.bincount(stratum, values) / counts
    spread = weights * np.sqrt(counts / (counts - 1) * (1 - 1 / len(values)))
    return means.mean() + spread[stratum] * (values - means[stratum])


def values_within(missions: pd.DataFrame, metric: str, spaces: Sequence[str]) -> np.ndarray:
    """The values of a metric, ``post_stratified`` in every scenario space by itself.

    Args:
        missions: A row per mission; without a column ``uavs``, the values are taken as they are.
        metric: The metric.
        spaces: The columns that tell the spaces apart, such as ``point``.
    """
    is_of_node = NODES_BEHIND.get(metric) in missions
    if is_of_node:
        values = np.empty(len(missions))
    else:
        values = missions[metric].to_numpy(float).copy()
        if "uavs" not in missions:
            return values
    table = missions[[*spaces]].reset_index(drop=True)
    for _, part in group_rows(table, spaces):
        rows = part.index.to_numpy()
        if is_of_node:
            values[rows] = _values_of_worst_node(missions, metric, rows)
        else:
            values[rows] = post_stratified(values[rows], missions["uavs"].to_numpy()[rows])
    return values


def _values_of_worst_node(missions: pd.DataFrame, metric: str, rows: np.ndarray) -> np.ndarray:
    """The linearised values of ``worst_of_nodes``, of rows of missions of one scenario space.

    Those of scenarios with different numbers of nodes are the values of the worst node of each.
    """
    of_space = missions.iloc[rows]
    of_missions = of_space[NODES_BEHIND[metric]].to_numpy()
    if len({len(nodes) for nodes in of_missions}) > 1:
        return of_space[metric].to_numpy(float)
    by_node = np.stack(of_missions)
    if "uavs" in of_space and of_space["uavs"].nunique() > 1:
        fleets = of_space["uavs"].to_numpy()
        by_node = np.apply_along_axis(post_stratified, 0, by_node, fleets)
    return worst_of_nodes(by_node, metric_in_missions(of_space, metric))


def worst_node(means: np.ndarray, metric: str | Metric) -> int:
    """The node whose mean is the worst; the first one of several."""
    if metric_of(metric).less_is_better:
        return int(np.argmax(means))
    return int(np.argmin(means))


def worst_and_spread(
    means: np.ndarray, ends: np.ndarray, metric: str | Metric
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The worst node, and how wide the interval of its mean has to be: see ``worst_of_nodes``.

    Args:
        means: (..., K) means of the nodes.
        ends: (..., K, 2) ends of intervals that hold for all nodes together; nan if unknown.
        metric: The metric.

    Returns:
        (...) the worst node, (...) the node whose interval has the worst end, and (...) by which
        factor the deviations of the latter give an interval of the worst mean with that end.
    """
    if metric_of(metric).less_is_better:
        worst = np.argmax(means, axis=-1)
        ends_of_nodes = np.nan_to_num(ends[..., 1], nan=-np.inf)
        farthest = np.argmax(ends_of_nodes, axis=-1)
    else:
        worst = np.argmin(means, axis=-1)
        ends_of_nodes = np.nan_to_num(ends[..., 0], nan=np.inf)
        farthest = np.argmin(ends_of_nodes, axis=-1)
    end = _of_node(ends_of_nodes, farthest)
    width = _of_node(means, farthest) - end
    is_known = np.isfinite(width) & (width != 0)
    distance = np.where(is_known, _of_node(means, worst) - end, 1.0)
    return worst, np.where(is_known, farthest, worst), distance / np.where(is_known, width, 1.0)


def _of_node(values: np.ndarray, node: np.ndarray) -> np.ndarray:
    """The (...) values of one node each, of (..., K) values."""
    return np.take_along_axis(values, np.expand_dims(node, -1), axis=-1)[..., 0]


def worst_of_nodes(by_node: np.ndarray, metric: Metric) -> np.ndarray:
    """Values whose mean is that of the worst node, and whose interval holds whichever it is.

    The own interval of the node that did worst would be too narrow, since another one, whose values
    vary more, may be the worst. So the lower end of a ratio (the upper one of an age) is to be the
    lowest of all nodes, of intervals that hold for all nodes together (``Metric.level_of_each``):
    these values deviate from their mean as those of the node with this end, by as much less as its
    mean is higher.

    Why it holds, for a ratio: with the probability asked for, the interval of every node has its
    true mean. Then the lower end here is not above that of the node that is truly the worst, which
    is below its mean. The upper end is not below the own one of the node that did worst, which is
    above its true mean, and no true mean is below the worst.

    Args:
        by_node: (n, K) values of n missions at K nodes.
        metric: The metric, of K nodes.

    Returns:
        (n,) the values.
    """
    means = by_node.mean(axis=0)
    if rare_values(metric, means) is not None:  # as column_intervals, which takes much longer
        level = metric.level_of_each(LEVEL)
        ends_of_nodes = ends_of_means(metric, means, by_node.var(axis=0), 0.0, len(by_node), level)
        ends = np.transpose(ends_of_nodes)
    else:
        ends = column_intervals(pd.DataFrame(by_node), metric)[["low", "high"]].to_numpy()
    worst, farthest, scale = worst_and_spread(means, ends, metric)
    return means[worst] + scale * (by_node[:, farthest] - means[farthest])


def by_replication(
    missions: pd.DataFrame, metric: str, columns: str | Sequence[str]
) -> pd.DataFrame:
    """A metric with a row per replication and a column per setting, ``post_stratified``.

    Args:
        missions: A row per mission.
        metric: The metric.
        columns: What tells the settings apart, such as ``point``.
    """
    if isinstance(columns, str):
        names = [columns]
    else:
        names = [*columns]
    table = missions[["replication", *names]].assign(value=values_within(missions, metric, names))
    return table.pivot(index="replication", columns=columns, values="value")


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
