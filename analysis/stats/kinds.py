"""The kinds of confidence intervals of means, and which kind a metric has.

Each kind is a class that tells the ends from a ``Sample``, of one mean or of many at once. All
estimates of means ask ``ends_of_means``: of missions and of evaluations, of settings side by side,
over design points, and after each mission for the stopping rules. So another interval for a metric
is another class, chosen in ``kind_of``.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from scipy.special import ndtri, stdtrit

from dess.analysis.metrics import Metric

LEVEL = 0.95


class Sample(NamedTuple):
    """What the interval of a mean depends on: numbers, or arrays with an entry for each mean.

    Attributes:
        mean: The mean.
        variance: The mean squared deviation from it.
        skewness: The skewness (``skewness_of``).
        n: The number of values, above 0; not whole where it is an effective number.
        is_of_outcomes: Whether all values are 0 or 1.
    """

    mean: Any
    variance: Any
    skewness: Any
    n: Any
    is_of_outcomes: bool = False


class Kind(Protocol):
    """A kind of interval.

    Attributes:
        counts_missions: Whether, over several design points, its sample is of missions, with their
            effective number; otherwise it is of the means of replications.
    """

    counts_missions: ClassVar[bool]

    def ends(self, sample: Sample, level: Any) -> tuple[Any, Any]:
        """The (...) lower and (...) upper ends at a level, or (...) levels."""


class Wilson:
    """The score interval of a share of outcomes, which holds near 0 and 1 as well."""

    counts_missions: ClassVar[bool] = True

    def ends(self, sample: Sample, level: Any) -> tuple[Any, Any]:
        """The ends; those of no success and of no failure begin at 0 and end at 1."""
        share = sample.mean
        n = sample.n
        z = ndtri(0.5 + 0.5 * level)
        centre = (2 * n * share + z**2) / (2 * (n + z**2))
        half = z / (2 * (n + z**2)) * np.sqrt(4 * n * share * (1 - share) + z**2)
        low = np.where(share > 0, centre - half, 0.0)
        high = np.where(share < 1, centre + half, 1.0)
        return low, high


@dataclass(frozen=True)
class StudentWithRare:
    """Student's interval of a sample to which rare values are added.

    Rare missions may lie far from all others: UAVs are lost, and a sample of some hundred missions
    often has none of these. Of each of the two rare values, ``ndtri((1 + level) / 2)**2 / 4`` are
    added: 0.96 at 95 %, 1.66 at 99 %. The more certain the interval, the rarer the values that it
    must allow for. For shares, whose rare values are 0 and 1, A. Agresti and B. Caffo (The American
    Statistician 54 (2000) 280-288) add nearly the same, one of each.

    Attributes:
        least: The lowest value that a rare mission may have, or (...) such.
        most: The highest one.
        is_bounded: Whether values lie between 0 and 1; a single one without bounds has no interval.
    """

    least: Any
    most: Any
    is_bounded: bool
    counts_missions: ClassVar[bool] = True

    def ends(self, sample: Sample, level: Any) -> tuple[Any, Any]:
        """The ends; nan for a single value without bounds."""
        mean = sample.mean
        n = sample.n
        added = ndtri((1 + level) / 2) ** 2 / 4
        size = n + 2 * added
        centre = (n * mean + added * (self.least + self.most)) / size
        squares = n * (sample.variance + (mean - centre) ** 2)
        squares = squares + added * ((self.least - centre) ** 2 + (self.most - centre) ** 2)
        half = stdtrit(size - 1, (1 + level) / 2) * np.sqrt(squares / (size - 1) / size)
        has_ends = self.is_bounded | (np.asarray(n) > 1)
        return np.where(has_ends, centre - half, np.nan), np.where(has_ends, centre + half, np.nan)


class Skewed:
    """Hall's interval of the mean of skewed values.

    Student's interval covers too seldom where few values are much larger than the others, as ages
    and costs are. Here the Student t of the mean is transformed so that its skewness disappears.
    Without skewness, the ends are Student's.

    Source: P. Hall, On the removal of skewness by transformation, J. R. Statist. Soc. B 54 (1992)
    221-228, with Student's quantile in place of the normal one.
    """

    counts_missions: ClassVar[bool] = False

    def ends(self, sample: Sample, level: Any) -> tuple[Any, Any]:
        """The ends; nan for a single value."""
        mean = sample.mean
        n = sample.n
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.sqrt(np.divide(sample.variance, n - 1))
        quantile = stdtrit(np.maximum(n - 1, 1), (1 + level) / 2)
        slope = sample.skewness / np.sqrt(n) / 3
        low = mean - error * self._skewed_quantile(quantile, slope)
        high = mean - error * self._skewed_quantile(-quantile, slope)
        return low, high

    def _skewed_quantile(self, quantile: Any, slope: Any) -> Any:
        """The t with a slope of skewness that belongs to a quantile without: Hall's inverse."""
        cube = 3 * slope * (quantile - slope / 2)
        near = np.expm1(np.log1p(np.maximum(cube, -0.5)) / 3)  # exact for a small slope
        root = np.where(cube > -0.5, near, np.cbrt(1 + cube) - 1)
        return np.where(slope == 0, quantile, root / np.where(slope == 0, 1, slope))


class StudentOfYears:
    """Student's interval of years, of which there are too few to tell their skewness.

    Two years tell nothing of others, so their mean has no interval.
    """

    counts_missions: ClassVar[bool] = False

    def ends(self, sample: Sample, level: Any) -> tuple[Any, Any]:
        """The ends; nan for fewer than three years."""
        n = np.asarray(sample.n)
        error = np.sqrt(sample.variance / np.maximum(n - 1, 1))
        half = stdtrit(np.maximum(n - 1, 1), (1 + level) / 2) * error
        half = np.where(n > 2, half, np.nan)
        return sample.mean - half, sample.mean + half


def kind_of(metric: Metric, mean: Any = 0.0, is_of_outcomes: bool = False) -> Kind:
    """Which interval the mean of a metric has: here, and nowhere else, it is decided.

    Args:
        metric: The metric; that of missions (``metric_in_missions``) has the range of a time, a
            cost or an amount of data. The ends of its range may be arrays, with one for each mean.
        mean: (...) its means.
        is_of_outcomes: Whether they are of outcomes 0 or 1; those of ``success`` may be of means of
            such, which are shares.
    """
    if metric.is_of_years:
        return StudentOfYears()
    if metric.is_outcome and is_of_outcomes:
        return Wilson()
    if metric.has_range:
        return StudentWithRare(*metric.range, metric.is_bounded)
    if metric.failure:  # what it makes of the mean
        least = np.maximum(mean - metric.failure, metric.range[0])
        return StudentWithRare(least, mean + metric.failure, metric.is_bounded)
    return Skewed()


def ends_of_means(metric: Metric, sample: Sample, level: Any = LEVEL) -> tuple[Any, Any]:
    """The ends of the confidence intervals of means of a metric, which end where its range does.

    Args:
        metric: The metric, see ``kind_of``.
        sample: What the means are of.
        level: Confidence level, or (...) levels.

    Returns:
        (...) lower and (...) upper ends, with low <= mean <= high.
    """
    kind = kind_of(metric, sample.mean, sample.is_of_outcomes)
    low, high = kind.ends(sample, level)
    least, most = metric.range
    # A mean at an end of the range may lie beyond it by rounding.
    low = np.minimum(np.clip(low, least, most), sample.mean)
    high = np.maximum(np.clip(high, least, most), sample.mean)
    return low, high


def level_after(analyses: Any, level: float = LEVEL) -> Any:
    """The level of each interval so that it covers at ``level`` after a search.

    A search ends the missions of a setting after an interim analysis of their results, so an
    interval at the plain level covers too seldom: the search stops where the results are extreme.
    After analysis k, the interval has the error (1 - level) / (k (k + 1)). These errors add up to
    1 - level over all analyses, so the interval covers at ``level``, whichever analysis was the
    last (the union bound).

    Args:
        analyses: (...) numbers of interim analyses; 0 where the number of missions was fixed.
        level: The level after the search.
    """
    return 1 - (1 - level) / np.maximum(analyses * (analyses + 1), 1)


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
