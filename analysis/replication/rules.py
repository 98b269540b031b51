"""Claims of the paper, and the rules by which figures of ours judge them.

A rule is a function from figures to a verdict, beside its words. A claim holds, or does not, where
whole intervals say so, and in part where a part of it is shown; else it is inconclusive. Intervals
are of 95 %, differences are taken mission by mission, unless a rule says otherwise.
"""

from collections.abc import Collection, Iterable
from math import hypot

import pandas as pd

from analysis.questions import main_effects
from analysis.questions.learning import BAND
from analysis.replication.paper import CROSSING
from analysis.stats.intervals import Interval
from analysis.stats.verdict import HOLDS, IN_PART, INCONCLUSIVE, REFUTED, Part, above, judged
from analysis.study.selection import Choice

NO_RESULTS = "no results"
VERDICTS = (HOLDS, IN_PART, INCONCLUSIVE, REFUTED, NO_RESULTS)

# A figure that is surely less than this below a printed one is near it; a small change is less.
NEAR = 0.05
# A difference below this does not matter: the indifference of the study of the sweet spot.
MARGIN = 0.01

_NEAR = f"{100 * NEAR:g} points"
_ELSE = "else it is inconclusive."


def gap(ours: Interval, printed: Interval) -> Interval:
    """By how much ours is above a printed figure, which may have an interval of its own.

    The interval of a difference from those of the two (Newcombe 1998, method 10).
    """
    mean = ours.mean - printed.mean
    low = hypot(ours.mean - ours.low, printed.high - printed.mean)
    return Interval(
        mean, mean - low, mean + hypot(ours.high - ours.mean, printed.mean - printed.low)
    )


REACHED = (
    "By our mean minus the paper's. Holds if the interval reaches 0 or lies above it, and all of "
    f"it is above −{_NEAR}: holding means reaching, not equalling. If all of it is below 0, it "
    f"holds in part if all of it is above −{_NEAR}, and does not hold otherwise; {_ELSE}"
)


def reached(difference: Interval) -> str:
    """Whether a printed figure is reached, by our difference to it."""
    near = difference.low > -NEAR
    if difference.high < 0:
        return IN_PART if near else REFUTED
    return HOLDS if near else INCONCLUSIVE


GAINED = (
    "Holds if the whole interval of the difference is above 0, and it reaches the paper's "
    f"difference with all of it above that − {_NEAR}; in part if only the former is shown; does "
    f"not hold if neither is, and one is surely not so; {_ELSE}"
)


def gained(difference: Interval, printed: float) -> str:
    """Whether something rises, by as much as is printed."""
    near = difference.low > printed - NEAR or None
    return judged(above(difference), near if difference.high >= printed else False)


HIGHER = (
    "Holds if the whole interval of the difference is above 0; does not hold if all of it is "
    f"below; {_ELSE}"
)


def higher(difference: Interval) -> str:
    """Whether something is higher."""
    return judged(above(difference))


LOWER = (
    "Holds if the whole interval of the difference is below 0; does not hold if all of it is "
    f"above; {_ELSE}"
)


def lower(difference: Interval) -> str:
    """Whether something is lower."""
    return higher(Interval(-difference.mean, -difference.high, -difference.low))


SLIGHTLY_LOWER = (
    f"Holds if the whole interval of the difference is below 0 and above −{_NEAR}; in part if it "
    f"is below 0, but may be more; does not hold if all of it is elsewhere; {_ELSE}"
)


def slightly_lower(difference: Interval) -> str:
    """Whether something falls, but not by much."""
    if difference.low > 0 or difference.high <= -NEAR:
        return REFUTED
    if difference.high >= 0:
        return INCONCLUSIVE
    return HOLDS if difference.low > -NEAR else IN_PART


def margin_in_words(margin: float) -> str:
    """``1 point``, ``0.5 points``."""
    return f"{100 * margin:g} point{'' if margin == 0.01 else 's'}"


def kept_words(margin: float) -> str:
    """The words of ``kept``."""
    points = margin_in_words(margin)
    return (
        f"Holds if the whole interval of the difference is above −{points}; does not hold if all "
        f"of it is below; {_ELSE}"
    )


def kept(difference: Interval, margin: float) -> str:
    """Whether something is no lower, up to a margin."""
    return judged(above(difference, -margin))


MOST = (
    "Holds if the whole interval of the share is above one half; does not hold if all of it is "
    f"below; {_ELSE}"
)


def most(share: Interval) -> str:
    """Whether something is so in most cases."""
    return judged(above(share, 0.5))


NEVER_ALL = (
    "Holds if no mission collected everything, and by the whole interval less than "
    f"{100 * NEAR:g} % of missions do; in part if only the mean ratio is surely below 100 %; does "
    f"not hold if every mission collected everything; {_ELSE}"
)


def never_all(whole: Interval, ratio: Interval) -> str:
    """Whether the collection ratio stays below 100 %.

    Args:
        whole: Share of the missions that collected everything.
        ratio: Mean collection ratio.
    """
    if whole.mean == 1:
        return REFUTED
    never = whole.mean == 0 and whole.high < NEAR
    return judged(never or None, ratio.high < 1 or None)


_TWO = (
    "both by the whole interval; in part if only one of the two is shown; does not hold if none "
    f"is, and one is surely not so; {_ELSE}"
)
IGNORED = (
    "A node is ignored if less than half of its data is collected. Holds if that befalls most of "
    f"these nodes, and more of them than of the others, {_TWO}"
)


def ignored(there: Interval, more: Interval) -> str:
    """Whether most of some nodes are ignored, more often than the others."""
    return judged(above(there, 0.5), above(more))


DIVIDED = (
    "A straight line parts the nodes, the best one for the share of the data that every UAV "
    "collects on its own side. Holds if that share is above what chance gives (the same data, the "
    "nodes shuffled), and the UAV that serves a node most collects more than three quarters of its "
    f"data, {_TWO}"
)


def divided(beyond_chance: Interval, division: Interval) -> str:
    """Whether two UAVs have sectors, and nodes, of their own."""
    return judged(above(beyond_chance), above(division, 0.75))


# Of the differences between all values of a parameter, as of ``main_effects.changes``.
_PAIRS = "(Holm, all pairs of values)"
BEST = (
    f"Holds if every other value is surely lower {_PAIRS}; does not hold if one is surely higher; "
    f"{_ELSE}"
)
LOWEST = (
    f"Holds if every other value is surely higher {_PAIRS}; does not hold if one is surely lower; "
    f"{_ELSE}"
)
RISES = (
    f"Holds if some values differ surely {_PAIRS}, and all that do go up; does not hold if some "
    f"surely go down; {_ELSE}"
)
PEAKS = (
    f"Holds if it surely rises {_PAIRS}, then falls, and may be highest there; does not hold if "
    f"values that differ surely contradict that; {_ELSE}"
)


def alike_words(margin: float) -> str:
    """The words of ``alike``."""
    points = margin_in_words(margin)
    return (
        f"Holds if all intervals of differences lie within {points}; does not hold if one, widened "
        f"for their number (Bonferroni), lies wholly beyond; {_ELSE}"
    )


def no_lower_words(margin: float) -> str:
    """The words of ``no_lower``."""
    points = margin_in_words(margin)
    return (
        f"Holds if all intervals of differences lie above −{points}; does not hold if one, widened "
        f"for their number (Bonferroni), lies wholly below; {_ELSE}"
    )


def best_at(pairs: pd.DataFrame, position: int) -> str:
    """Whether the metric is highest at a value: it differs from every other, upwards."""
    ups, downs = main_effects.differing(pairs, 1), main_effects.differing(pairs, -1)
    others = set(range(int(pairs["second"].max()) + 1)) - {position}
    below = {a for a, b in ups if b == position} | {b for a, b in downs if a == position}
    above = {b for a, b in ups if a == position} | {a for a, b in downs if b == position}
    if above:
        return REFUTED
    return HOLDS if below == others else INCONCLUSIVE


def no_lower(pairs: pd.DataFrame, positions: Iterable[int], margin: float) -> str:
    """Whether the metric is no lower at some values than at all others, up to a margin.

    It holds if all intervals of a difference are above -margin; it does not if one of those that
    hold at once is below.
    """
    chosen = [*positions]
    inside = pairs["second"].isin(chosen)
    across = inside != pairs["first"].isin(chosen)
    rows, upwards = pairs[across], inside[across]
    lows = rows["low"].where(upwards, -rows["high"])
    tops = rows["wide_high"].where(upwards, -rows["wide_low"])
    if (tops < -margin).any():
        return REFUTED
    return HOLDS if (lows > -margin).all() else INCONCLUSIVE


def alike(pairs: pd.DataFrame, margin: float) -> str:
    """Whether all values are alike: every interval of a difference within a margin.

    They are not if one of the intervals that hold at once is wholly beyond.
    """
    if ((pairs["wide_low"] > margin) | (pairs["wide_high"] < -margin)).any():
        return REFUTED
    within = (pairs["low"] >= -margin) & (pairs["high"] <= margin)
    return HOLDS if within.all() else INCONCLUSIVE


def peaks_at(pairs: pd.DataFrame, position: int) -> str:
    """Whether the metric rises up to a value and falls behind it."""
    found = main_effects.shape(pairs)
    if position not in found.peaks:
        return REFUTED
    return HOLDS if found.words == main_effects.PEAK else INCONCLUSIVE


def rises(pairs: pd.DataFrame) -> str:
    """Whether the metric rises along the values."""
    found = main_effects.shape(pairs).words
    return {main_effects.RISES: HOLDS, main_effects.LEVELS: INCONCLUSIVE}.get(found, REFUTED)


CHOSEN = (
    "Holds if the setting that the study selects has that many, and so have all that it could not "
    f"rule out; does not hold if none of these has; {_ELSE}"
)


def chosen(choice: Choice, wanted: Collection[int]) -> str:
    """Whether a selection came to one of the wanted points.

    Args:
        choice: The selection.
        wanted: Numbers of the design points.
    """
    left = {choice.best, *choice.survivors}
    part: Part = None if left & {*wanted} else False
    return judged(left <= {*wanted} or part)


_LONG = f"Trainings of fewer than the {CROSSING:,} steps of the paper's crossing cannot tell."
_AT_THE_END = f"the {100 * BAND:g} % interval of the last difference is above 0"
_NOT_AT_THE_END = f"does not hold if that is below 0; {_ELSE} {_LONG}"

PASSES = (
    f"Mean curves are compared in phase II. Holds if {_AT_THE_END}: the curve with transfer is "
    f"then above from some step to the end; {_NOT_AT_THE_END}"
)
THROUGHOUT = (
    "Mean curves (exponential moving averages) are compared in phase II. Holds if that with "
    f"transfer is above at every step and {_AT_THE_END}; in part if only its end is above; "
    f"{_NOT_AT_THE_END}"
)


def throughout(verdict: str, all_along: bool) -> str:
    """Whether the curve with transfer learning is above, all along.

    Args:
        verdict: Of ``curves.transfer``.
        all_along: Whether it is above at every step.
    """
    return IN_PART if verdict == HOLDS and not all_along else verdict


LEVELS_OFF = (
    f"Holds if the mean curve stays within {margin_in_words(MARGIN)} of its end from the first "
    "half of the training on, and ends lower than that with transfer, by the "
    f"{100 * BAND:g} % interval; in part if only one of the two is so; does not hold if neither "
    f"is, and it ends surely higher; {_ELSE} {_LONG}"
)


def levels_off(settled: float, end: Interval) -> str:
    """Whether training without transfer learning levels off, and low.

    Args:
        settled: Share of the training after which the curve stays near its end.
        end: Last difference, with transfer - without.
    """
    return judged(settled <= 0.5 or None, above(end))
