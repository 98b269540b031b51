"""Chi-square tests of observed counts against the counts that a distribution predicts."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

LEAST = 5.0  # expected observations that each class needs for the chi-square test to be accurate


class Fit(NamedTuple):
    """Observed and expected numbers of observations.

    Attributes:
        table: A row per class: ``label``, ``observed``, ``expected``.
        p: The p-value of the chi-square test; None if the observations are too few for two classes.
    """

    table: pd.DataFrame
    p: float | None

    @property
    def n(self) -> int:
        """Number of observations."""
        return int(self.table["observed"].sum())

    @property
    def shares(self) -> str:
        """The observed and expected shares of the first classes, as many as fit on a line."""
        if not self.n:
            return ""
        rows, percent = self.table.head(3), 100 / self.n
        observed = ", ".join(f"{r.label}: {percent * r.observed:.2f} %" for r in rows.itertuples())
        expected = " / ".join(f"{percent * number:.2f}" for number in rows["expected"])
        return f"{observed}; expected {expected} %"

    @property
    def range(self) -> str:
        """The numbers of observations of the rarest and the most frequent class, in words."""
        counts = self.table["observed"]
        return f"each {counts.min():,} to {counts.max():,} times"


def poisson_fit(counts: np.ndarray, mean: float) -> Fit:
    """Compare counts with a Poisson distribution; rare counts at both ends are pooled.

    Args:
        counts: An array of counts, of any shape.
        mean: Mean of the distribution, above 0.
    """
    n, law = counts.size, stats.poisson(mean)
    numbers = np.arange(int(law.ppf(1 - 1e-12)) + 1)
    frequent = numbers[n * law.pmf(numbers) >= LEAST]
    if not len(frequent):
        return _fit(["0 or more"], np.array([n]), np.array([float(n)]))
    low, high = int(frequent[0]), int(frequent[-1])
    low -= n * law.cdf(low - 1) >= LEAST
    high += n * law.sf(high) >= LEAST
    classes = np.arange(low, high + 1)
    observed = np.bincount(np.clip(counts, low, high).ravel() - low, minlength=len(classes))
    below = law.cdf(classes)
    below[-1] = 1.0
    labels = [*map(str, classes)]
    labels[0] += " or less" if low > 0 else ""
    labels[-1] += " or more"
    return _fit(labels, observed, n * np.diff(below, prepend=0.0))


def uniform_fit(values: np.ndarray, low: int, high: int) -> Fit:
    """Compare integers with the uniform distribution on ``low..high``, both included.

    A value outside has probability 0, so the p-value of the fit is 0 then.
    """
    classes = np.arange(low, high + 1)
    observed = (np.asarray(values)[:, None] == classes).sum(0)
    fit = _fit([*map(str, classes)], observed, np.full(len(classes), len(values) / len(classes)))
    return fit if fit.n == len(values) else fit._replace(p=0.0)


def chi_square(observed: np.ndarray, expected: np.ndarray, freedom: int) -> float:
    """The p-value of observed and expected numbers by Pearson's chi-square statistic."""
    return float(stats.chi2.sf(((observed - expected) ** 2 / expected).sum(), freedom))


def _fit(labels: Sequence[str], observed: np.ndarray, expected: np.ndarray) -> Fit:
    table = pd.DataFrame({"label": labels, "observed": observed, "expected": expected})
    if len(table) < 2 or expected.min() < LEAST:
        return Fit(table, None)
    return Fit(table, chi_square(observed, expected, len(table) - 1))
