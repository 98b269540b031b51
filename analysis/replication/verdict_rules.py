"""The rules that judge the paper's claims; a rule consists of its words and its judge.

A judge is a function from quantities to a verdict; the words explain the rule on the page:

    >>> rules.higher.judge(Interval(0.02, 0.01, 0.03))
    'holds'

A claim holds, or does not hold, if complete intervals show it. It holds in part if only a part of
it is shown. Otherwise it is inconclusive. Unless the words say otherwise, intervals have a level of
95 %, and differences are taken mission by mission.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from math import hypot

import pandas as pd

from analysis import numbers
from analysis.questions import main_effects
from analysis.questions.learning.curves import BAND, Transfer
from analysis.questions.main_effects import Shape
from analysis.replication.paper import CROSSING
from analysis.stats.intervals import Interval
from analysis.stats.verdict import (
    ABOVE,
    BELOW,
    HOLDS,
    IN_PART,
    INCONCLUSIVE,
    REFUTED,
    Part,
    above,
    judged,
    position,
    position_by_test,
)
from analysis.study.selection import Choice

NO_RESULTS = "no results"
VERDICTS = (HOLDS, IN_PART, INCONCLUSIVE, REFUTED, NO_RESULTS)

# A value is near a printed number if its interval is above that number - NEAR; a change is small if
# it is less than NEAR.
NEAR = 0.05
# A smaller difference does not matter, unless the study of the sweet spot gives another margin.
MARGIN = 0.01

Judge = Callable[..., str]

_NEAR = f"{100 * NEAR:g} points"
_PAIRS = "(Holm, all pairs of values)"
_TWO = (
    "both by the whole interval; in part if only one of the two is shown; does not hold if none "
    "is, and one is surely not so"
)
_AT_THE_END = f"the {100 * BAND:g} % interval of the last difference is above 0"
_LONG = f"Trainings of fewer than the {CROSSING:,} steps of the paper's crossing cannot tell."


@dataclass(frozen=True)
class Rule:
    """A rule that judges a claim by quantities.

    Attributes:
        words: When the claim holds; ``{margin}`` stands for a difference that does not matter.
        judge: A function from quantities to one of ``VERDICTS``.
        takes: What else the judge takes by name: ``printed``, the interval of the paper's number,
            or ``margin``.
        remark: A remark that follows the words.
    """

    words: str
    judge: Judge
    takes: tuple[str, ...] = ()
    remark: str = ""

    def in_words(self, margin: float) -> str:
        """The words of the rule with the margin filled in."""
        words = self.words.format(margin=numbers.margin(margin))
        return f"{words}; else it is inconclusive. {self.remark}".strip()


def rule(words: str, *takes: str, remark: str = "") -> Callable[[Judge], Rule]:
    """A decorator that joins words to the judge below them."""
    return lambda judge: Rule(words, judge, takes, remark)


# Means, shares and differences.


@rule(
    "By our mean minus the paper's. Holds if the interval reaches 0 or lies above it, and all of "
    f"it is above −{_NEAR}: holding means reaching, not equalling. If all of it is below 0, it "
    f"holds in part if all of it is above −{_NEAR}, and does not hold otherwise",
    "printed",
)
def reached(mean: Interval, printed: Interval) -> str:
    """Whether a printed number is reached."""
    difference = gap(mean, printed)
    near = difference.low > -NEAR
    if difference.high < 0:
        return IN_PART if near else REFUTED
    return HOLDS if near else INCONCLUSIVE


def gap(mean: Interval, printed: Interval) -> Interval:
    """How much higher a mean is than a printed number, which may have its own interval.

    The interval of the difference is computed from the two intervals (R. G. Newcombe, Statistics in
    Medicine 17 (1998) 873-890, method 10).
    """
    difference = mean.mean - printed.mean
    below = hypot(mean.mean - mean.low, printed.high - printed.mean)
    beyond = hypot(mean.high - mean.mean, printed.mean - printed.low)
    return Interval(difference, difference - below, difference + beyond)


@rule(
    "Holds if the whole interval of the difference is above 0, and it reaches the paper's "
    f"difference with all of it above that − {_NEAR}; in part if only the former is shown; does "
    "not hold if neither is, and one is surely not so",
    "printed",
)
def gained(difference: Interval, printed: Interval) -> str:
    """Whether a metric rises, and by as much as the paper prints."""
    near = difference.low > printed.mean - NEAR or None
    return judged(above(difference), near if difference.high >= printed.mean else False)


higher = Rule(
    "Holds if the whole interval of the difference is above 0; does not hold if all of it is below",
    lambda difference: judged(above(difference)),
)

lower = Rule(
    "Holds if the whole interval of the difference is below 0; does not hold if all of it is above",
    lambda difference: judged({BELOW: True, ABOVE: False}.get(position(difference))),
)


@rule(
    f"Holds if the whole interval of the difference is below 0 and above −{_NEAR}; in part if it "
    "is below 0, but may be more; does not hold if all of it is elsewhere"
)
def slightly_lower(difference: Interval) -> str:
    """Whether a metric falls, but only slightly."""
    if difference.low > 0 or difference.high <= -NEAR:
        return REFUTED
    if difference.high >= 0:
        return INCONCLUSIVE
    return HOLDS if difference.low > -NEAR else IN_PART


kept = Rule(
    "Holds if the whole interval of the difference is above −{margin}; does not hold if all of it "
    "is below",
    lambda difference, margin: judged(above(difference, -margin)),
    ("margin",),
)

most = Rule(
    "Holds if the whole interval of the share is above one half; does not hold if all of it is "
    "below",
    lambda share: judged(above(share, 0.5)),
)


@rule(
    "Holds if no mission collected everything, and by the whole interval less than "
    f"{100 * NEAR:g} % of missions do; in part if only the mean ratio is surely below 100 %; does "
    "not hold if every mission collected everything"
)
def never_all(ratio: Interval, whole: Interval) -> str:
    """Whether the collection ratio stays below 100 %, by the share of missions that reach it."""
    if whole.mean == 1:
        return REFUTED
    never = whole.mean == 0 and whole.high < NEAR
    return judged(never or None, ratio.high < 1 or None)


# Who serves which nodes.

ignored = Rule(
    "A node is ignored if less than half of its data is collected. Holds if this is true "
    f"for most of these nodes, and more of them than of the others, {_TWO}",
    lambda share, beyond_others: judged(above(share, 0.5), above(beyond_others)),
)

divided = Rule(
    "A straight line parts the nodes, the best one for the share of the data that every UAV "
    "collects on its own side. Holds if that share is above what chance gives (the same data, the "
    "nodes shuffled), and the UAV that serves a node most collects more than three quarters of its "
    f"data, {_TWO}",
    lambda beyond_chance, division: judged(above(beyond_chance), above(division, 0.75)),
)

# The values of a parameter. ``leads`` are rows of ``main_effects.changes``, with signs such that a
# difference is the value in question minus another value.


@rule(f"Holds if every other value is surely lower {_PAIRS}; does not hold if one is surely higher")
def best(leads: pd.DataFrame) -> str:
    """Whether the metric is highest at a value."""
    tests = zip(leads["difference"], leads["p_adjusted"], strict=True)
    positions = {position_by_test(difference, p) for difference, p in tests}
    if BELOW in positions:
        return REFUTED
    return HOLDS if positions == {ABOVE} else INCONCLUSIVE


lowest = Rule(
    f"Holds if every other value is surely higher {_PAIRS}; does not hold if one is surely lower",
    best.judge,
)


@rule(
    "Holds if all intervals of differences lie above −{margin}; does not hold if one, widened "
    "for their number (Bonferroni), lies wholly below",
    "margin",
)
def no_lower(leads: pd.DataFrame, margin: float) -> str:
    """Whether the metric at some values is not lower than at all others, up to a margin."""
    if (leads["wide_high"] < -margin).any():
        return REFUTED
    return HOLDS if (leads["low"] > -margin).all() else INCONCLUSIVE


@rule(
    "Holds if all intervals of differences lie within {margin}; does not hold if one, widened "
    "for their number (Bonferroni), lies wholly beyond",
    "margin",
)
def alike(changes: pd.DataFrame, margin: float) -> str:
    """Whether the metric is the same at all values, up to a margin."""
    if ((changes["wide_low"] > margin) | (changes["wide_high"] < -margin)).any():
        return REFUTED
    within = (changes["low"] >= -margin) & (changes["high"] <= margin)
    return HOLDS if within.all() else INCONCLUSIVE


@rule(
    f"Holds if some values differ surely {_PAIRS}, and all that do go up; does not hold if some "
    "surely go down"
)
def rises(shape: Shape) -> str:
    """Whether the metric rises along the values."""
    verdicts = {main_effects.RISES: HOLDS, main_effects.LEVELS: INCONCLUSIVE}
    return verdicts.get(shape.words, REFUTED)


@rule(
    f"Holds if it surely rises {_PAIRS}, then falls, and may be highest there; does not hold if "
    "values that differ surely contradict that"
)
def peaks(shape: Shape, wanted: int) -> str:
    """Whether the metric rises up to a value and falls after it."""
    if wanted not in shape.peaks:
        return REFUTED
    return HOLDS if shape.words == main_effects.PEAK else INCONCLUSIVE


@rule(
    "Holds if the setting that the study selects has that many, and so have all that it could not "
    "rule out; does not hold if none of these has"
)
def chosen(choice: Choice, wanted: Collection[int]) -> str:
    """Whether a selection has chosen one of the design points with these numbers."""
    left = {choice.best, *choice.survivors}
    part: Part = None if left & {*wanted} else False
    return judged(left <= {*wanted} or part)


# Learning curves, with transfer learning and without.

passes = Rule(
    f"Mean curves are compared in phase II. Holds if {_AT_THE_END}: the curve with transfer is "
    "then above from some step to the end; does not hold if that is below 0",
    lambda transfer: transfer.verdict,
    remark=_LONG,
)


@rule(
    "Mean curves (exponential moving averages) are compared in phase II. Holds if that with "
    f"transfer is above at every step and {_AT_THE_END}; in part if only its end is above; "
    "does not hold if that is below 0",
    remark=_LONG,
)
def throughout(transfer: Transfer) -> str:
    """Whether the curve with transfer learning is above at every step."""
    in_part = transfer.verdict == HOLDS and not transfer.throughout
    return IN_PART if in_part else transfer.verdict


@rule(
    f"Holds if the mean curve stays within {numbers.margin(MARGIN)} of its end from the first "
    "half of the training on, and ends lower than that with transfer, by the "
    f"{100 * BAND:g} % interval; in part if only one of the two is so; does not hold if neither "
    "is, and it ends surely higher",
    remark=_LONG,
)
def levels_off(settled: float, transfer: Transfer) -> str:
    """Whether training without transfer learning levels off early, and at a low value."""
    if transfer.length < CROSSING:
        return INCONCLUSIVE
    return judged(settled <= 0.5 or None, above(transfer.last))
