"""Decide, mission by mission, whether the mean of a metric between 0 and 1 meets a requirement.

    test = MeanTest(required=0.99, tolerance=0.005, error=0.001)
    test.observe(successes)  # in any number of blocks
    test.verdict, test.missions

A mean of ``required`` + ``tolerance`` or more is taken for missed with probability ``error`` at
most, and so is a mean of ``required`` - ``tolerance`` or less for met; in the zone between, either
verdict is right. That holds for any distribution on [0, 1], however rare its failures, for any
number of missions, and whenever one looks. Nothing is asymptotic.

Two tests by betting run side by side. Against "the mean is at most m" one bets on every value x at
odds that are fair if the mean is m: a share b of the wealth becomes b (1 + l (x - m)), 0 < l < 1/m.
While the mean is m or less, the wealth is a nonnegative supermartingale, so by Ville's inequality
the chance that it ever grows to 1 / ``error`` times its start is ``error`` at most; then the claim
is rejected. The wealth is spread over stakes l that halve from 1/m on: one of them is near the best
for any distribution, and the whole is worth a share of what the best one makes. Against "the mean
is at least m" the same test takes 1 - x and 1 - m.

Source: I. Waudby-Smith, A. Ramdas, Estimating means of bounded random variables by betting, JRSS-B
86 (2024) 1-27.
"""

from typing import Literal

import numpy as np

Verdict = Literal["met", "missed", "open"]

# The largest stake as a share of the one that a single value can ruin.
_BOLDEST = 0.999


class MeanTest:
    """Whether a mean meets a requirement; the verdict is the first one that the values force.

    Attributes:
        verdict: ``met``, ``missed``, or ``open``.
        missions: Values observed up to the verdict, or all of them.
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
    """The wealth of one who bets that a mean is above a bound."""

    def __init__(self, bound: float, tolerance: float):
        # The best stake is 4 * tolerance or more: the lead of the mean over its variance.
        steps = max(int(np.ceil(np.log2(1 / (4 * tolerance * bound)))), 0)
        self._bound, self._stakes = bound, _BOLDEST / bound * 0.5 ** np.arange(steps + 1)
        self._logs = np.full(steps + 1, -np.log(steps + 1))

    def after(self, values: np.ndarray) -> np.ndarray:
        """(n,) logarithms of the wealth after each of further values, for a start of 1."""
        growth = np.log1p(self._stakes[:, None] * (values - self._bound))
        paths = np.cumsum(np.column_stack([self._logs, growth]), axis=1)[:, 1:]
        self._logs = paths[:, -1]
        return np.logaddexp.reduce(paths, axis=0)


def _first(holds: np.ndarray) -> int:
    """The first place where something holds, or the number of places."""
    return int(np.argmax(holds)) if holds.any() else len(holds)
