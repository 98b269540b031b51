"""Decide, mission by mission, whether the mean of a metric between 0 and 1 meets a requirement.

    test = MeanTest(required=0.99, tolerance=0.005, error=0.001)
    test.observe(successes)  # in any number of blocks
    test.verdict, test.missions

If the mean is ``required`` + ``tolerance`` or more, the verdict is ``missed`` with probability
``error`` at most; if it is ``required`` - ``tolerance`` or less, the verdict is ``met`` with
probability ``error`` at most. Between these two values, either verdict is acceptable. This holds
for any distribution on [0, 1], however rare failures are, and for any number of missions, even if
the verdict is looked at after every mission. It is not an asymptotic statement.

Two tests by betting run in parallel. To test the hypothesis "the mean is at most m", one bets on
every value x at odds that would be fair if the mean were m: a wealth b becomes b (1 + l (x - m)),
where the stake l satisfies 0 < l < 1/m. If the mean is at most m, the wealth is a nonnegative
supermartingale, so by Ville's inequality the probability that it ever grows to 1 / ``error`` times
its initial value is ``error`` at most. As soon as it does, the hypothesis is rejected. The wealth
is divided among several stakes l, the largest near 1/m and each half the one before, since the
best stake is not known in advance. To test "the mean is at least m", the same test is applied to
1 - x and 1 - m.

Source: I. Waudby-Smith, A. Ramdas, Estimating means of bounded random variables by betting, JRSS-B
86 (2024) 1-27.
"""

from typing import Literal

import numpy as np

Verdict = Literal["met", "missed", "open"]

# The largest stake, as a share of the stake with which a single value could lose everything.
_BOLDEST = 0.999


class MeanTest:
    """A sequential test of whether a mean meets a requirement; the first verdict is final.

    Attributes:
        verdict: ``met``, ``missed``, or ``open``.
        missions: Number of values observed up to the verdict; all values if it is ``open``.
    """

    def __init__(self, required: float, tolerance: float, error: float):
        least, most = required - tolerance, required + tolerance
        self._at_most, self._at_least = _Wealth(least, tolerance), _Wealth(1 - most, tolerance)
        self._target = -np.log(error)
        self.verdict: Verdict = "open"
        self.missions = 0

    def observe(self, values: np.ndarray) -> None:
        """Take more values into account, in the order of their replications."""
        if self.verdict != "open" or not len(values):
            return
        met = _first(self._at_most.after(values) >= self._target)
        missed = _first(self._at_least.after(1 - values) >= self._target)
        if min(met, missed) < len(values):
            self.verdict = "met" if met < missed else "missed"
        self.missions += min(met + 1, missed + 1, len(values))


class _Wealth:
    """The wealth of a gambler who bets that a mean is above a bound."""

    def __init__(self, bound: float, tolerance: float):
        # The best stake is about (mean - bound) / variance, which is 4 * tolerance or more.
        steps = max(int(np.ceil(np.log2(1 / (4 * tolerance * bound)))), 0)
        self._bound, self._stakes = bound, _BOLDEST / bound * 0.5 ** np.arange(steps + 1)
        self._logs = np.full(steps + 1, -np.log(steps + 1))

    def after(self, values: np.ndarray) -> np.ndarray:
        """The (n,) logarithms of the wealth after each of n more values; the first wealth is 1."""
        growth = np.log1p(self._stakes[:, None] * (values - self._bound))
        paths = np.cumsum(np.column_stack([self._logs, growth]), axis=1)[:, 1:]
        self._logs = paths[:, -1]
        return np.logaddexp.reduce(paths, axis=0)


def _first(holds: np.ndarray) -> int:
    """The index of the first true value, or the number of values if none is true."""
    return int(np.argmax(holds)) if holds.any() else len(holds)
