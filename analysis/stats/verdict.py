"""Verdicts that follow from intervals and tests, and the words and marks for them.

An estimate is ``ABOVE`` or ``BELOW`` a reference if its whole interval is, else ``INCONCLUSIVE``:

    >>> position(Interval(0.2, 0.1, 0.3))
    'above'

A part of a claim is shown (True), refuted (False) or open (None), by a complete interval.
"""

from typing import Protocol

from dess.analysis.stats.intervals import LEVEL

ABOVE, INCONCLUSIVE, BELOW = POSITIONS = ("above", "inconclusive", "below")
MARKS = {ABOVE: "▲", INCONCLUSIVE: "≈", BELOW: "▼"}  # in tables
HOLDS, IN_PART, REFUTED = "holds", "holds in part", "does not hold"

Part = bool | None


class Ends(Protocol):
    """The ends of an interval: an ``Interval``, or a row of a table of estimates."""

    @property
    def low(self) -> float:
        """Its lower end."""

    @property
    def high(self) -> float:
        """Its upper end."""


def position(interval: Ends, reference: float = 0.0) -> str:
    """Whether a complete interval is above a reference, below it, or contains it.

    Returns:
        ``ABOVE``, ``BELOW`` or ``INCONCLUSIVE``; also ``INCONCLUSIVE`` if an end is nan.
    """
    if interval.low > reference:
        return ABOVE
    return BELOW if interval.high < reference else INCONCLUSIVE


def position_by_test(difference: float, p: float, level: float = LEVEL) -> str:
    """On which side of 0 a difference lies by its (adjusted) p-value.

    Returns:
        ``ABOVE``, ``BELOW`` or ``INCONCLUSIVE``.
    """
    significant = p <= 1 - level
    if significant and difference > 0:
        return ABOVE
    return BELOW if significant and difference < 0 else INCONCLUSIVE


def above(interval: Ends, bound: float = 0.0) -> Part:
    """Whether something is above a bound."""
    return {ABOVE: True, BELOW: False}.get(position(interval, bound))


def judged(*parts: Part) -> str:
    """The verdict on a claim of several parts.

    The claim holds if all parts are shown, and holds in part if some are. It does not hold if none
    is shown and one is refuted.
    """
    if any(parts):
        return HOLDS if all(parts) else IN_PART
    return REFUTED if False in parts else INCONCLUSIVE
