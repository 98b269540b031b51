"""Bets against means: what they win rules a mean out, however often somebody looks.

A gambler begins with a capital of 1 and stakes, in every mission, a part of it on a value above a
certain mean, or below it. Against the true mean, the capital grows to 1 / error with a probability
of at most the error, at whatever time (J. Ville, 1939). So a mean against which it has grown so
much is ruled out for ever. Confidence sequences bet against all means (``sequences``), and a
``MeanTest`` against two.

They stake differently. A sequence follows the values so far, since it has to be narrow wherever the
mean is. A test knows what it waits for: it divides the capital among constant stakes, up to all but
nothing. To find that missions which never fail have a success of 0.99, within 0.005 and with an
error of 5 %, it takes 318 of them, and the stakes of a sequence 435.
"""

from abc import ABC, abstractmethod

import numpy as np
from scipy.special import stdtrit

from dess.analysis.stats.verdict import Verdict, judge_facts
from dess.base.kernels import kernel

# The largest stake, as a share of the stake with which a single value could lose everything.
_BOLDEST = 0.999


@kernel
def settle(capital, stake, value, mean):
    """The capital after a bet on a value above a mean; below it, if the stake is negative."""
    return capital * (1.0 + stake * (value - mean))


@kernel
def first_win(capitals, stakes, mean, values, target):
    """The place of the first value with which the mean capital reaches a target.

    Args:
        capitals: (k,) the capitals, which change.
        stakes: (k,) the stake of each.
        mean: The mean that is bet against.
        values: (n,) values from 0 to 1.
        target: The target.

    Returns:
        The place, or n if there is none.
    """
    for place in range(len(values)):
        total = 0.0
        for number in range(len(stakes)):
            capitals[number] = settle(capitals[number], stakes[number], values[place], mean)
            total += capitals[number]
        if total >= target * len(stakes):
            return place
    return len(values)


class _Bets:
    """Bets with constant stakes that a mean is above a bound, or below it."""

    def __init__(self, bound: float, is_above: bool, tolerance: float, error: float):
        loss = bound  # of a stake, at most
        if not is_above:
            loss = 1 - bound
        # The best stake is about (mean - bound) / variance, which is 4 * tolerance or more.
        steps = max(int(np.ceil(np.log2(1 / (4 * tolerance * loss)))), 0)
        self._stakes = _BOLDEST / loss * 0.5 ** np.arange(steps + 1)
        if not is_above:
            self._stakes = -self._stakes
        self._capitals = np.ones(steps + 1)
        self._bound = bound
        self._target = 1 / error

    def first_win(self, values: np.ndarray) -> int:
        """The place of the value that rules the bound out, or the number of values."""
        return first_win(self._capitals, self._stakes, self._bound, values, self._target)


class RequirementTest(ABC):
    """A test of whether a mean meets a requirement; the first verdict is final.

    Attributes:
        required: The least mean.
        verdict: Whether it is met; ``OPEN`` until that is known.
        missions: Number of values observed up to the verdict; all values if it is open.
    """

    def __init__(self, required: float, tolerance: float, error: float):
        """Begin a test.

        Args:
            required: The least mean.
            tolerance: How far from it either verdict is right.
            error: The largest probability of each wrong verdict.
        """
        self.required = required
        self.verdict = Verdict.OPEN
        self.missions = 0
        self._tolerance = tolerance
        self._error = error

    @abstractmethod
    def observe(self, values: np.ndarray) -> None:
        """Take more values into account, in the order of their replications."""


class MeanTest(RequirementTest):
    """A sequential test of whether a mean meets a requirement, by bets."""

    def __init__(
        self, required: float, tolerance: float, error: float, error_of_miss: float | None = None
    ):
        """Begin a test; ``error_of_miss`` is the error of ``MISSED``, if it has another one."""
        super().__init__(required, tolerance, error)
        self._above = _Bets(required - tolerance, True, tolerance, error)
        self._below = _Bets(required + tolerance, False, tolerance, error_of_miss or error)
        self._total = 0.0

    def observe(self, values: np.ndarray) -> None:
        """Take more values into account, in the order of their replications."""
        if self.verdict != Verdict.OPEN or not len(values):
            return
        shares = np.ascontiguousarray(values, float)
        kept = self._above.first_win(shares)
        broken = self._below.first_win(shares)
        first = min(kept, broken)
        seen = shares[: first + 1]
        self._total += float(seen.sum())
        self.missions += len(seen)
        if first < len(shares):
            margin = self._total / self.missions - self.required
            self.verdict = judge_facts(kept == first, broken == first, margin)


class YearsTest(RequirementTest):
    """A test of whether a mean meets a requirement, by all values at once.

    There are far too few years for bets. So the interval is Student's, which holds once: for
    values that are observed in one part. Of the (n, K) values of nodes, the worst one counts.
    """

    def observe(self, values: np.ndarray) -> None:
        """Take all values into account, in the order of their replications."""
        if self.missions or len(values) < 2:
            return
        self.missions = len(values)
        by_node = values.reshape(len(values), -1)
        means, deviations = by_node.mean(axis=0), by_node.std(axis=0, ddof=1)
        one_sided = [1 - self._error, 1 - self._error / by_node.shape[1]]
        below, above = stdtrit(len(values) - 1, one_sided) / np.sqrt(len(values))
        least = self.required - self._tolerance
        most = self.required + self._tolerance
        is_met = bool((means - below * deviations > least).all())
        is_missed = bool((means + above * deviations < most).any())
        self.verdict = judge_facts(is_met, is_missed, float(means.min()) - self.required)


class WorstNodeTest(RequirementTest):
    """A sequential test of whether the means of all nodes meet a requirement.

    It is met once each node has been found to meet it. That is wrong only if it is wrong of the
    worst node, so the test of every node has the whole error (an intersection-union test: R. L.
    Berger, Technometrics 24 (1982) 295-300). It is missed once a node has been found to miss it,
    for which the nodes share the error.
    """

    def __init__(self, required: float, tolerance: float, error: float):
        super().__init__(required, tolerance, error)
        self._tests: list[MeanTest] = []

    def observe(self, values: np.ndarray) -> None:
        """Take more (n, K) values of K nodes into account, in the order of their replications."""
        if self.verdict != Verdict.OPEN or not len(values):
            return
        nodes = values.shape[1]
        self._tests = self._tests or [
            MeanTest(self.required, self._tolerance, self._error, self._error / nodes)
            for _ in range(nodes)
        ]
        for test, of_node in zip(self._tests, values.T, strict=True):
            test.observe(of_node)
        self.missions += len(values)
        self.verdict = Verdict.of_all(test.verdict for test in self._tests)
