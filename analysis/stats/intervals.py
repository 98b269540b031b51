"""Intervals of means: of values, of columns, and over design points.

Which interval the mean of a metric has is told by ``kinds.kind_of``.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from dess.analysis.metrics import PRODUCT, Metric, metric_of
from dess.analysis.stats import kinds
from dess.analysis.stats.kinds import LEVEL, Sample, Wilson, ends_of_means, skewness_of


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

    @property
    def sample(self) -> Sample:
        """What the interval of the mean depends on."""
        variance = self.squares / self.n
        if self.least == self.most:  # without what rounding adds
            variance = 0.0
        skewness = skewness_of(self.squares, self.cubes, self.n)
        return Sample(self.mean, variance, skewness, self.n, self._are_outcomes)

    @property
    def _are_outcomes(self) -> bool:
        """Whether all values may be 0 or 1: they have the sum and the spread of such."""
        spread = self.total * (self.n - self.total) / self.n
        return self.total.is_integer() and bool(np.isclose(self.squares, spread, atol=1e-9))

    def interval(self, metric: str | Metric, level: float = LEVEL) -> Interval:
        """The mean of a metric with the interval of ``interval_of``."""
        measure = metric_of(metric)
        ends = ends_of_means(measure, self.sample, measure.level_of_each(level))
        return Interval(self.mean, *map(float, ends))

    def student(self, level: float = LEVEL) -> Interval:
        """The mean with the interval of ``mean_interval``."""
        if self.least == self.most or not self.squares:  # the square of a tiny number is 0
            half = 0.0 if self.n > 1 else np.nan
            return Interval(self.mean, self.mean - half, self.mean + half)
        error = np.sqrt(self.squares / (self.n - 1)) / np.sqrt(self.n)
        ends = stdtrit(self.n - 1, [(1 - level) / 2, (1 + level) / 2]) * error + self.mean
        return Interval(self.mean, *map(float, ends))


def share_interval(successes: int, n: int, level: float = LEVEL) -> Interval:
    """Share of successes with its Wilson score interval, which holds near 0 and 1 as well."""
    share = successes / n
    low, high = Wilson().ends(Sample(share, share * (1 - share), 0.0, n), level)
    return Interval(share, float(low), float(high))


def bounded_interval(values: Sequence[float] | np.ndarray, level: float = LEVEL) -> Interval:
    """Mean of values from 0 to 1 with its interval, as that of the product."""
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
    """The mean of a metric of missions with the interval that is fit for it (``kinds.kind_of``)."""
    return Moments.of(values).interval(metric, level)


def stratified_interval(values: np.ndarray, metric: str | Metric, level: float = LEVEL) -> Interval:
    """Mean of the means of fixed design points with its interval: the points are strata.

    What differs from point to point is no chance, so the interval rests on the variance within the
    points. A replication has the same realisation at all points, so what it adds to the mean is
    counted as one contribution, as of a cluster of a stratified sample: this is the linearised
    variance of W. G. Cochran (Sampling Techniques, 3rd edition, 1977, Section 11.18). Where rare
    values are added (``kinds.StudentWithRare``), it is with the effective number of missions of
    L. Kish (Survey Sampling, 1965, Section 8.2): all missions, divided by how much more the mean
    varies than if every point had replications of its own. N. Dean and M. Pagano (Journal of Survey
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
    cubes = float(((residuals / n).sum(axis=1) ** 3).sum()) / points**3
    skewness = skewness_of(common, cubes, replications)
    if kinds.kind_of(measure, mean).counts_missions:
        alone = float(((residuals**2).sum(axis=0) / n**2).sum()) / points**2
        missions = points**2 / float((1 / n).sum())
        effect = float(points)
        if alone:
            effect = min(max(common / alone, 1.0), points)
        sample = Sample(mean, alone * missions, skewness, missions / effect)
    else:
        sample = Sample(mean, common * replications, skewness, float(replications))
    ends = ends_of_means(measure, sample, level)
    return Interval(mean, *map(float, ends))


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
    sample = Sample(mean, values.var(ddof=0), skewness, size)
    low, high = ends_of_means(measure, sample, level)
    if measure.is_outcome:
        are_outcomes = ((values.isin((0, 1)) | values.isna()).all() & (n > 0)).to_numpy()
        of_outcomes = ends_of_means(measure, sample._replace(is_of_outcomes=True), level)
        low = np.where(are_outcomes, of_outcomes[0], low)
        high = np.where(are_outcomes, of_outcomes[1], high)
    return pd.DataFrame({"mean": mean, "low": low, "high": high, "n": n})
