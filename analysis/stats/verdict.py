"""The judge: verdicts that follow from intervals and tests, with the words and marks for them.

A *requirement* is met if a whole interval keeps its bound, missed if it breaks it, else open:

    >>> judge_margins(low=-0.01, high=0.2)
    <Verdict.OPEN: 'open'>

A *difference* lies above 0 or below it if its whole interval does, else it is inconclusive. The
intervals of differences allow for failures that are too rare to be in the missions. Where they
contain 0 only because of this allowance, the difference lies on one side *in what was seen*:

    >>> position_of(Interval(0.2, 0.1, 0.3))
    'above'
    >>> position_with_allowance(INCONCLUSIVE, without=BELOW)
    'below in what was seen'
    >>> better_or_worse(SEEN_BELOW, "age")
    'better in what was seen'

A part of a *claim* is shown (True), refuted (False) or open (None), by a complete interval.
"""

from collections.abc import Iterable
from enum import StrEnum
from typing import Any

import pandas as pd

from dess.analysis.metrics import Metric, metric_of
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.kinds import LEVEL

ABOVE, INCONCLUSIVE, BELOW = "above", "inconclusive", "below"
SEEN_ABOVE, SEEN_BELOW = "above in what was seen", "below in what was seen"
# In tables.
MARKS = {ABOVE: "▲", SEEN_ABOVE: "△", INCONCLUSIVE: "≈", SEEN_BELOW: "▽", BELOW: "▼"}
# What is to be said of a difference that is shown in what was seen, and no further.
NOT_RULED_OUT = "a rare failure is not ruled out"
BETTER, WORSE = "better", "worse"
SEEN_BETTER, SEEN_WORSE = "better in what was seen", "worse in what was seen"
HOLDS, IN_PART, REFUTED = "holds", "holds in part", "does not hold"

Part = bool | None


class Verdict(StrEnum):
    """Whether requirements are met; *open* is what the missions do not decide."""

    MISSED = "missed"  # the most serious first
    OPEN = "open"
    MET = "met"

    @classmethod
    def of_all(cls, verdicts: Iterable[str]) -> "Verdict":
        """The verdict on several requirements, or conditions, together: the most serious one."""
        all_verdicts = {*verdicts}
        return next(verdict for verdict in cls if verdict in all_verdicts)


# By whether a bound is known to be kept, and whether it is known to be broken. Both are known only
# within a tolerance of the bound, where either verdict is right: there the mean decides.
RULE = {
    (True, False): Verdict.MET,
    (False, True): Verdict.MISSED,
    (False, False): Verdict.OPEN,
}


def rule_for_pages() -> dict[str, Any]:
    """The rule as data for scripts: ``table[is kept][is broken]``, and all verdicts in order."""
    sides = (False, True)
    return {
        "mostSeriousFirst": [*Verdict],
        "table": [[RULE.get((kept, broken)) for broken in sides] for kept in sides],
    }


def judge_facts(is_kept: bool, is_broken: bool, margin: float) -> Verdict:
    """Whether a requirement is met, by what is known of its bound.

    Args:
        is_kept: Whether it is known to be kept, within the tolerance.
        is_broken: Whether it is known to be broken, within the tolerance.
        margin: How far the mean is on the right side of it.
    """
    if is_kept and is_broken:
        is_kept = margin >= 0
        is_broken = not is_kept
    return RULE[is_kept, is_broken]


def judge_margins(low: float, high: float) -> Verdict:
    """Whether a requirement is met, by how far both ends of an interval are on the right side."""
    return judge_facts(min(low, high) >= 0, max(low, high) < 0, margin=0.0)


def better_or_worse(side: str, metric: str | Metric = "") -> str:
    """What it means for a metric that its difference lies on a side of 0.

    Args:
        side: One of the keys of ``MARKS``.
        metric: The metric, by default one of which more is better.

    Returns:
        ``BETTER``, ``SEEN_BETTER``, ``INCONCLUSIVE``, ``SEEN_WORSE`` or ``WORSE``.
    """
    sides = [ABOVE, SEEN_ABOVE, INCONCLUSIVE, SEEN_BELOW, BELOW]
    if metric_of(metric).less_is_better:
        sides.reverse()
    words = (BETTER, SEEN_BETTER, INCONCLUSIVE, SEEN_WORSE, WORSE)
    return words[sides.index(side)]


def position_of(interval: Interval, reference: float = 0.0) -> str:
    """Whether a complete interval is above a reference, below it, or contains it.

    Args:
        interval: The interval, or a row of a table of estimates, with ``low`` and ``high``.
        reference: The reference.

    Returns:
        ``ABOVE``, ``BELOW`` or ``INCONCLUSIVE``; also ``INCONCLUSIVE`` if an end is nan.
    """
    if interval.low > reference:
        return ABOVE
    if interval.high < reference:
        return BELOW
    return INCONCLUSIVE


def position_with_allowance(whole: str, without: str) -> str:
    """The verdict on a difference, from its position with the allowance for failures and without.

    Args:
        whole: The position by the complete interval, or by its p-value.
        without: The position by Student's interval, or by its p-value.

    Returns:
        ``whole``, or where that is ``INCONCLUSIVE`` the side in what was seen, if there is one.
    """
    sides = {ABOVE: SEEN_ABOVE, BELOW: SEEN_BELOW}
    if whole == INCONCLUSIVE:
        return sides.get(without, INCONCLUSIVE)
    return whole


def judge_intervals(whole: Interval, seen: Interval) -> str:
    """The verdict on a difference by its interval with the allowance for failures and without."""
    return position_with_allowance(position_of(whole), position_of(seen))


def judge_difference(row: Any) -> str:
    """The verdict on a paired difference by its intervals with the allowance and without.

    An interval without a length tells nothing about the variance, so the test has to show the
    difference as well.

    Args:
        row: A row of ``dess.analysis.compare``: ``difference``, ``low``, ``high``, ``p``,
            ``student`` and ``p_student``.

    Returns:
        One of the keys of ``MARKS``.
    """
    whole = INCONCLUSIVE
    if row.low < row.high or row.p <= 1 - LEVEL:
        whole = position_of(row)
    return position_with_allowance(whole, position_by_test(row.difference, row.p_student))


def judge_by_tests(rows: pd.DataFrame) -> list[str]:
    """The verdicts on paired differences by their adjusted p-values.

    Args:
        rows: Rows of ``dess.analysis.compare``, or of ``compare_learners``.

    Returns:
        For each row one of the keys of ``MARKS``.
    """
    whole = map(position_by_test, rows["difference"], rows["p_adjusted"])
    without = map(position_by_test, rows["difference"], rows["p_student_adjusted"])
    return [*map(position_with_allowance, whole, without)]


def position_by_test(difference: float, p: float, level: float = LEVEL) -> str:
    """On which side of 0 a difference lies by its (adjusted) p-value.

    Returns:
        ``ABOVE``, ``BELOW`` or ``INCONCLUSIVE``.
    """
    significant = p <= 1 - level
    if significant and difference > 0:
        return ABOVE
    if significant and difference < 0:
        return BELOW
    return INCONCLUSIVE


def verdict_above(interval: Interval, bound: float = 0.0) -> Part:
    """Whether something is above a bound."""
    return {ABOVE: True, BELOW: False}.get(position_of(interval, bound))


def judge_parts(*parts: Part) -> str:
    """The verdict on a claim of several parts.

    The claim holds if all parts are shown, and holds in part if some are. It does not hold if none
    is shown and one is refuted.
    """
    if any(parts):
        return HOLDS if all(parts) else IN_PART
    if False in parts:
        return REFUTED
    return INCONCLUSIVE
