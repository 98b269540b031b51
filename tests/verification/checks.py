"""Checks of the simulator, the verdict on each of them, and tests of whole distributions.

A statistical check has a p-value; an exact check has an error and an upper bound of it::

    checks = [Check.normal(CHANNEL, "Mean", known=0, estimate=0.1, error=0.2, n=50), ...]
    table = judge_checks(checks)
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
import pandas as pd
from scipy import stats

from dess.analysis import numbers
from dess.analysis.stats.corrections import adjust_p_values
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED

ARRIVALS, CHANNEL, DRAWS, COVERAGE = "Arrivals", "Channel", "Draws", "Intervals"
CONSERVATION, ENERGY, RECORDS = "Conservation", "Energy", "Records"
REALISATIONS, ENGINES = "Realisations", "Engines"
TOPICS = (ARRIVALS, CHANNEL, CONSERVATION, ENERGY, RECORDS, REALISATIONS, ENGINES, DRAWS, COVERAGE)

# The probability that any statistical check fails although the simulator is correct.
ALPHA = 0.01

_NORMAL = stats.norm.ppf((1 + LEVEL) / 2)


class Check(NamedTuple):
    """A comparison with a known value; inconclusive if it has neither ``p`` nor ``error``.

    Attributes:
        topic: The part of the simulator, one of the constants of this module.
        test: What was compared, and how.
        known: The known value or law, as text.
        seen: The observed value, as text.
        n: Number of observations.
        p: Probability of a deviation as large as the observed one if the known value is true.
        error: The deviation, for an exact check.
        bound: The largest error that is allowed.
    """

    topic: str
    test: str
    known: str
    seen: str
    n: int
    p: float | None = None
    error: float | None = None
    bound: float = 0.0

    @classmethod
    def exact(
        cls, topic: str, test: str, known: str, seen: str, n: int, error: float, bound: float = 0.0
    ) -> Self:
        """An exact check; inconclusive without observations."""
        return cls(topic, test, known, seen, n, error=float(error) if n else None, bound=bound)

    @classmethod
    def counted(cls, topic: str, test: str, known: str, wrong: int, n: int) -> Self:
        """An exact check of n cases, of which ``wrong`` are wrong."""
        if wrong:
            seen = f"otherwise {wrong:,} times"
        else:
            seen = "always"
        return cls.exact(topic, test, known, seen, n, wrong)

    @classmethod
    def normal(
        cls,
        topic: str,
        test: str,
        known: float,
        estimate: float,
        error: float,
        n: int,
        digits: int = 4,
    ) -> Self:
        """A statistical check of an estimate that is normally distributed around the known value.

        Args:
            topic, test, n: As above.
            known: The value in closed form.
            estimate: The observed value.
            error: The standard error of the estimate, if the known value holds.
            digits: Decimals of the estimate as text.
        """
        ends = (estimate - _NORMAL * error, estimate + _NORMAL * error)
        seen = numbers.format_decimals(estimate, *ends, digits=digits)
        p = float(2 * stats.norm.sf(abs(estimate - known) / error))
        return cls(topic, test, f"{known:g}", seen, n, p)


def judge_checks(checks: Sequence[Check], alpha: float = ALPHA) -> pd.DataFrame:
    """The verdicts on checks: by p-values corrected by Holm, and by the bounds of exact checks.

    Args:
        checks: All checks; their p-values are corrected together.
        alpha: Probability that any check is refuted although the simulator is correct.

    Returns:
        A row per check: its fields, ``p_adjusted`` and ``verdict``, one of ``HOLDS``, ``REFUTED``
        and ``INCONCLUSIVE`` of ``dess.analysis.stats.verdict``.
    """
    table = pd.DataFrame(checks, columns=Check._fields).astype({"p": float, "error": float})
    chance = table["p"].notna()
    table.loc[chance, "p_adjusted"] = adjust_p_values(table.loc[chance, "p"].to_numpy(), "holm")
    fails = (table["p_adjusted"] <= alpha) | (table["error"] > table["bound"])
    decided = chance | table["error"].notna()
    verdicts = np.select([fails, decided], [REFUTED, HOLDS], INCONCLUSIVE)
    return table.assign(verdict=verdicts)


def reason_in_words(row: pd.Series) -> str:
    """The p-value of a judged check and its correction, or its error and the bound."""
    if not np.isnan(row["p"]):
        adjusted = numbers.format_p_value(row["p_adjusted"])
        return f"p {numbers.format_p_value(row['p'])}, Holm {adjusted}"
    if np.isnan(row["error"]):
        return ""
    if not row["bound"]:
        return f"error {row['error']:g}"
    return f"error {row['error']:.2g}, allowed {row['bound']:.2g}"


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
        rows = self.table.head(3)
        percent = 100 / self.n
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
    n = counts.size
    law = stats.poisson(mean)
    numbers = np.arange(int(law.ppf(1 - 1e-12)) + 1)
    frequent = numbers[n * law.pmf(numbers) >= LEAST]
    if not len(frequent):
        return _fit_of_counts(["0 or more"], np.array([n]), np.array([float(n)]))
    low = int(frequent[0])
    high = int(frequent[-1])
    low -= n * law.cdf(low - 1) >= LEAST
    high += n * law.sf(high) >= LEAST
    classes = np.arange(low, high + 1)
    observed = np.bincount(np.clip(counts, low, high).ravel() - low, minlength=len(classes))
    below = law.cdf(classes)
    below[-1] = 1.0
    labels = [*map(str, classes)]
    if low > 0:
        labels[0] += " or less"
    labels[-1] += " or more"
    return _fit_of_counts(labels, observed, n * np.diff(below, prepend=0.0))


def uniform_fit(values: np.ndarray, low: int, high: int) -> Fit:
    """Compare integers with the uniform distribution on ``low..high``, both included.

    A value outside has probability 0, so the p-value of the fit is 0 then.
    """
    classes = np.arange(low, high + 1)
    observed = (np.asarray(values)[:, None] == classes).sum(0)
    fit = _fit_of_counts(
        [*map(str, classes)], observed, np.full(len(classes), len(values) / len(classes))
    )
    if fit.n == len(values):
        return fit
    return fit._replace(p=0.0)


def chi_square(observed: np.ndarray, expected: np.ndarray, freedom: int) -> float:
    """The p-value of observed and expected numbers by Pearson's chi-square statistic."""
    return float(stats.chi2.sf(((observed - expected) ** 2 / expected).sum(), freedom))


def _fit_of_counts(labels: Sequence[str], observed: np.ndarray, expected: np.ndarray) -> Fit:
    table = pd.DataFrame({"label": labels, "observed": observed, "expected": expected})
    if len(table) < 2 or expected.min() < LEAST:
        return Fit(table, None)
    return Fit(table, chi_square(observed, expected, len(table) - 1))
