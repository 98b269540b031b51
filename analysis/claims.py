"""Claims of the paper, and the rules by which figures of ours judge them.

A rule is a function from figures to a verdict, beside its words. Intervals are of 95 %, differences
are taken mission by mission, unless a rule says otherwise.
"""

from collections.abc import Collection

from analysis import effects
from analysis.curves import FAILS, HOLDS, IN_PART
from analysis.selection import Choice
from analysis.statistics import Interval

NO_RESULTS = "no results"
VERDICTS = (HOLDS, IN_PART, FAILS, NO_RESULTS)

# A mean that is less than this below a printed figure is near it; a small change is less than it.
NEAR = 0.05
# A difference below this does not matter: the indifference of the study of the sweet spot.
MARGIN = 0.01

REACHED = (
    "Holds if the interval reaches the paper's figure or lies above it, and the mean is less than "
    f"{100 * NEAR:g} points below it; in part if only one of the two is so. So holding means "
    "reaching, not equalling."
)


def reached(ours: Interval, printed: float) -> str:
    """Whether a printed figure is reached."""
    return _both(ours.high >= printed, ours.mean > printed - NEAR)


GAINED = (
    "Holds if the whole interval of the difference is above 0 and it reaches the paper's "
    "difference; in part if only the former."
)


def gained(difference: Interval, printed: float) -> str:
    """Whether something rises, by as much as is printed."""
    if difference.low <= 0:
        return FAILS
    return HOLDS if difference.high >= printed else IN_PART


HIGHER = (
    "Holds if the whole interval of the difference is above 0; in part if only the mean difference."
)


def higher(difference: Interval) -> str:
    """Whether something is higher, surely or on the face of it."""
    if difference.low > 0:
        return HOLDS
    return IN_PART if difference.mean > 0 else FAILS


LOWER = HIGHER.replace("above", "below")


def lower(difference: Interval) -> str:
    """Whether something is lower, surely or on the face of it."""
    return higher(Interval(-difference.mean, -difference.high, -difference.low))


SLIGHTLY_LOWER = (
    "Holds if the whole interval of the difference is below 0 and above "
    f"−{100 * NEAR:g} points; does not hold if all of it is elsewhere; else in part."
)


def slightly_lower(difference: Interval) -> str:
    """Whether something falls, but not by much."""
    if difference.low >= 0 or difference.high <= -NEAR:
        return FAILS
    return HOLDS if -NEAR < difference.low <= difference.high < 0 else IN_PART


def margin_in_words(margin: float) -> str:
    """``1 point``, ``0.5 points``."""
    return f"{100 * margin:g} point{'' if margin == 0.01 else 's'}"


def kept_words(margin: float) -> str:
    """The words of ``kept``."""
    return (
        f"Holds if no interval of a difference reaches {margin_in_words(margin)} down; does not "
        "hold if a difference is surely below 0; else in part."
    )


def kept(difference: Interval, margin: float) -> str:
    """Whether something is no lower, up to a margin."""
    if difference.high < 0:
        return FAILS
    return HOLDS if difference.low > -margin else IN_PART


def same_words(margin: float) -> str:
    """The words of ``same``."""
    return (
        "Both would be equal if failed missions collected as much as the others. Holds if the "
        f"whole interval of the difference is within {margin_in_words(margin)}; in part if only "
        "the mean is."
    )


def same(difference: Interval, margin: float) -> str:
    """Whether a difference does not matter."""
    if abs(difference.mean) > margin:
        return FAILS
    return HOLDS if max(-difference.low, difference.high) <= margin else IN_PART


MOST = "Holds if the whole interval of the share is above one half; in part if only the mean."


def most(share: Interval) -> str:
    """Whether something is so in most cases."""
    if share.low > 0.5:
        return HOLDS
    return IN_PART if share.mean > 0.5 else FAILS


ALWAYS = (
    "Holds if that is so in every mission that succeeded; in part if in more than half of them."
)


def always(share: float) -> str:
    """Whether something is so without exception."""
    if share == 1:
        return HOLDS
    return IN_PART if share > 0.5 else FAILS


NEVER_ALL = (
    "Holds if no mission collected everything; in part if some did, and the whole interval of the "
    "mean ratio is below 100 %."
)


def never_all(share_of_all: float, ratio: Interval) -> str:
    """Whether the collection ratio stays below 100 %."""
    if share_of_all == 0:
        return HOLDS
    return IN_PART if ratio.high < 1 else FAILS


IGNORED = (
    "A node is ignored if less than half of its data is collected. Holds if that befalls most of "
    "these nodes, and more of them than of the others, both by the whole interval; in part if "
    "only one of the two is so."
)


def ignored(there: Interval, more: Interval) -> str:
    """Whether most of some nodes are ignored, more often than the others."""
    return _both(there.low > 0.5, more.low > 0)


DIVIDED = (
    "A straight line parts the nodes, the best one for the share of the data that every UAV "
    "collects on its own side. Holds if that share is above what chance gives (the same data, the "
    "nodes shuffled), and the UAV that serves a node most collects more than three quarters of its "
    "data, both by the whole interval; in part if only one of the two is so."
)


def divided(beyond_chance: Interval, division: Interval) -> str:
    """Whether two UAVs have sectors, and nodes, of their own."""
    return _both(beyond_chance.low > 0, division.low > 0.75)


# Verdicts of ``effects`` as those here: open is what nothing contradicts, but not all of it shows.
OF_EFFECTS = {effects.HOLDS: HOLDS, effects.OPEN: IN_PART, effects.REFUTED: FAILS}
_OPEN = "in part if nothing contradicts it, but not all of it is sure (Holm-adjusted)."
BEST = f"Holds if every other value is surely lower; {_OPEN}"
LOWEST = f"Holds if every other value is surely higher; {_OPEN}"
RISES = f"Holds if some values differ surely, and all that do go up; {_OPEN}"
PEAKS = (
    "Holds if it rises, then falls, and may be highest there; in part if nothing that differs "
    "surely contradicts it."
)


def alike_words(margin: float) -> str:
    """The words of ``effects.alike``."""
    return f"Holds if all intervals of differences lie within {margin_in_words(margin)}; {_OPEN}"


CHOSEN = (
    "Holds if the setting that the study selects has that many, and so have all that it could not "
    "rule out; in part if only some of these have."
)


def chosen(choice: Choice, wanted: Collection[int]) -> str:
    """Whether a selection came to one of the wanted points.

    Args:
        choice: The selection.
        wanted: Numbers of the design points.
    """
    left = {choice.best, *choice.survivors}
    if left <= {*wanted}:
        return HOLDS
    return IN_PART if left & {*wanted} else FAILS


THROUGHOUT = (
    "Mean curves (exponential moving averages) are compared in phase II. Holds if that with "
    "transfer is above at every step and the 99 % interval of the last difference is above 0; in "
    "part if only its end is above."
)


def throughout(verdict: str, all_along: bool) -> str:
    """Whether the curve with transfer learning is above, all along.

    Args:
        verdict: Of ``curves.transfer``.
        all_along: Whether it is above at every step.
    """
    return IN_PART if verdict == HOLDS and not all_along else verdict


PASSES = (
    "Mean curves are compared in phase II. Holds if that with transfer is above from some step to "
    "the end and the 99 % interval of the last difference is above 0; in part if only the curve is."
)

LEVELS_OFF = (
    f"Holds if the mean curve stays within {margin_in_words(MARGIN)} of its end from the first "
    "half of the training on, and ends lower than that with transfer, by the 99 % interval; in "
    "part if only one of the two is so."
)


def levels_off(settled: float, gap: Interval) -> str:
    """Whether training without transfer learning levels off, and low.

    Args:
        settled: Share of the training after which the curve stays near its end.
        gap: Last difference, with transfer - without.
    """
    return _both(settled <= 0.5, gap.low > 0)


def _both(one: bool, other: bool) -> str:
    """Holds if both are so, in part if one is."""
    return (FAILS, IN_PART, HOLDS)[int(one) + int(other)]
