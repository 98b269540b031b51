"""The rules of the verdicts on the paper's claims: judges of what is measured.

Each is a function from what a measure finds to one of ``VERDICTS``. Its words are in
``claims.toml``, which also has the limits of the rules that only need ``all_above``.
"""

from collections.abc import Collection, Sequence

import pandas as pd

from dess.analysis.answers.settings import shapes
from dess.analysis.answers.settings.shapes import Shape
from dess.analysis.answers.training.transfer import Transfer
from dess.analysis.paper.values import CROSSING
from dess.analysis.stats import verdict
from dess.analysis.stats.differences import difference_of_intervals
from dess.analysis.stats.intervals import Interval
from dess.analysis.study.selection import Choice

# A value is near a printed number if its interval is above that number - NEAR; a change is small if
# it is less than NEAR.
NEAR = 0.05
# A smaller difference does not matter, unless the study of the sweet spot gives another margin.
MARGIN = 0.01


# Means, shares and differences.


def all_above(limits: Sequence[float], *intervals: Interval) -> str:
    """Whether all of some means, shares or differences are above their limits."""
    return verdict.judge_parts(*map(verdict.verdict_above, intervals, limits))


def reached(mean: Interval, printed: Interval) -> str:
    """Whether a printed number is reached."""
    difference = difference_of_intervals(mean, printed)
    near = difference.low > -NEAR
    if difference.high < 0:
        if near:
            return verdict.IN_PART
        return verdict.REFUTED
    if near:
        return verdict.HOLDS
    return verdict.INCONCLUSIVE


def gained(difference: Interval, printed: Interval) -> str:
    """Whether a metric rises, and by as much as the paper prints."""
    near = difference.low > printed.mean - NEAR or None
    return verdict.judge_parts(
        verdict.verdict_above(difference), near if difference.high >= printed.mean else False
    )


def lower(difference: Interval) -> str:
    """Whether a metric is lower."""
    return {verdict.BELOW: verdict.HOLDS, verdict.ABOVE: verdict.REFUTED}.get(
        verdict.position_of(difference), verdict.INCONCLUSIVE
    )


def kept(difference: Interval, margin: float) -> str:
    """Whether a metric does not fall by more than the margin."""
    return verdict.judge_parts(verdict.verdict_above(difference, -margin))


def slightly_lower(difference: Interval) -> str:
    """Whether a metric falls, but only slightly."""
    if difference.low > 0 or difference.high <= -NEAR:
        return verdict.REFUTED
    if difference.high >= 0:
        return verdict.INCONCLUSIVE
    if difference.low > -NEAR:
        return verdict.HOLDS
    return verdict.IN_PART


def never_all(ratio: Interval, whole: Interval) -> str:
    """Whether the collection ratio stays below 100 %, by the share of missions that reach it."""
    if whole.mean == 1:
        return verdict.REFUTED
    never = whole.mean == 0 and whole.high < NEAR
    return verdict.judge_parts(never or None, ratio.high < 1 or None)


# The values of a parameter. ``leads`` are rows of ``shapes.compare_values``, with signs such
# that a difference is the value in question minus another value.


def best(leads: pd.DataFrame) -> str:
    """Whether the metric is highest at a value."""
    tests = zip(leads["difference"], leads["p_adjusted"], strict=True)
    positions = {verdict.position_by_test(difference, p) for difference, p in tests}
    if verdict.BELOW in positions:
        return verdict.REFUTED
    if positions == {verdict.ABOVE}:
        return verdict.HOLDS
    return verdict.INCONCLUSIVE


def no_lower(leads: pd.DataFrame, margin: float) -> str:
    """Whether the metric at some values is not lower than at all others, up to a margin."""
    if (leads["wide_high"] < -margin).any():
        return verdict.REFUTED
    if (leads["low"] > -margin).all():
        return verdict.HOLDS
    return verdict.INCONCLUSIVE


def alike(changes: pd.DataFrame, margin: float) -> str:
    """Whether the metric is the same at all values, up to a margin."""
    if ((changes["wide_low"] > margin) | (changes["wide_high"] < -margin)).any():
        return verdict.REFUTED
    within = (changes["low"] >= -margin) & (changes["high"] <= margin)
    if within.all():
        return verdict.HOLDS
    return verdict.INCONCLUSIVE


def rises(shape: Shape) -> str:
    """Whether the metric rises along the values."""
    verdicts = {shapes.RISES: verdict.HOLDS, shapes.LEVELS: verdict.INCONCLUSIVE}
    return verdicts.get(shape.words, verdict.REFUTED)


def peaks(shape: Shape, wanted: int) -> str:
    """Whether the metric rises up to a value and falls after it."""
    if wanted not in shape.peaks:
        return verdict.REFUTED
    if shape.words == shapes.PEAK:
        return verdict.HOLDS
    return verdict.INCONCLUSIVE


def chosen(choice: Choice, wanted: Collection[int]) -> str:
    """Whether a selection has chosen one of the design points with these numbers."""
    left = {choice.best, *choice.survivors}
    return verdict.judge_parts(left <= {*wanted} or (None if left & {*wanted} else False))


# Learning curves, with transfer learning and without.


def passes(transfer: Transfer) -> str:
    """Whether the curve with transfer learning is above from some step to the end."""
    return transfer.verdict


def throughout(transfer: Transfer) -> str:
    """Whether the curve with transfer learning is above at every step."""
    in_part = transfer.verdict == verdict.HOLDS and not transfer.throughout
    if in_part:
        return verdict.IN_PART
    return transfer.verdict


def levels_off(settled: float, transfer: Transfer) -> str:
    """Whether training without transfer learning levels off early, and at a low value."""
    if transfer.length < CROSSING:
        return verdict.INCONCLUSIVE
    return verdict.judge_parts(settled <= 0.5 or None, verdict.verdict_above(transfer.last))
