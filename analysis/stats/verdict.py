"""Verdicts on claims: their words, and how intervals come to them.

A part of a claim is shown (true) or refuted (false) by a whole interval; else it is open (None).
"""

from analysis.stats.intervals import Interval

HOLDS, IN_PART, INCONCLUSIVE, REFUTED = "holds", "holds in part", "inconclusive", "does not hold"

Part = bool | None


def above(interval: Interval, bound: float = 0.0) -> Part:
    """Whether something is above a bound."""
    return True if interval.low > bound else False if interval.high < bound else None


def judged(*parts: Part) -> str:
    """The verdict on a claim of several parts.

    It holds if all are shown, in part if some are; it does not hold if none is and one is refuted.
    """
    if any(parts):
        return HOLDS if all(parts) else IN_PART
    return REFUTED if False in parts else INCONCLUSIVE
