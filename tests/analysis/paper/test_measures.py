"""Every rule can be met, refuted and left open, by figures made up for it."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import pandas as pd
import pytest

from analysis.answers import main_effects
from analysis.answers.learning import Transfer
from analysis.answers.main_effects import Shape
from analysis.paper import measures, values
from analysis.paper.measures import Pairs, negated
from analysis.paper.scorecard import RULES
from analysis.stats.intervals import Interval
from analysis.stats.verdict import HOLDS, IN_PART, INCONCLUSIVE, REFUTED
from analysis.study.selection import Choice
from tests.analysis.answers.test_main_effects import pairs_of


def exactly(figure: float) -> Interval:
    return Interval(figure, figure, figure)


def around(mean: float, half: float = 0.01) -> Interval:
    return Interval(mean, mean - half, mean + half)


REACHED, GAINED = (
    partial(measures.reached, printed=exactly(0.5)),
    partial(measures.gained, printed=exactly(0.2)),
)
KEPT = partial(measures.kept, margin=0.01)


@pytest.mark.parametrize(
    ("judge", "mean", "half", "verdict"),
    [
        (REACHED, 0.60, 0.01, HOLDS),  # wholly above
        (REACHED, 0.495, 0.01, HOLDS),  # around it
        (REACHED, 0.49, 0.01, HOLDS),  # the upper end is the figure
        (REACHED, 0.48, 0.01, IN_PART),  # wholly below, but near
        (REACHED, 0.40, 0.20, INCONCLUSIVE),  # too few missions to say, but far
        (REACHED, 0.51, 0.20, INCONCLUSIVE),  # too few missions to say, if near
        (REACHED, 0.44, 0.005, REFUTED),
        (REACHED, 0.45, 0.01, REFUTED),  # wholly below, and not shown to be near
        (GAINED, 0.24, 0.01, HOLDS),
        (GAINED, 0.195, 0.01, HOLDS),
        (GAINED, 0.195, 0.19, IN_PART),  # it rises, but who knows how much
        (GAINED, 0.09, 0.01, IN_PART),
        (GAINED, 0.005, 0.01, REFUTED),  # perhaps it rises, but surely not that much
        (GAINED, -0.3, 0.01, REFUTED),
        (GAINED, 0.14, 0.3, INCONCLUSIVE),
        (measures.higher, 0.02, 0.01, HOLDS),
        (measures.higher, -0.001, 0.01, INCONCLUSIVE),
        (measures.higher, -0.02, 0.01, REFUTED),
        (measures.lower, -0.02, 0.01, HOLDS),
        (measures.lower, -0.005, 0.01, INCONCLUSIVE),
        (measures.lower, 0.02, 0.01, REFUTED),
        (measures.slightly_lower, -0.02, 0.01, HOLDS),
        (measures.slightly_lower, 0.0, 0.01, INCONCLUSIVE),
        (measures.slightly_lower, -0.05, 0.04, IN_PART),  # it falls, but who knows how much
        (measures.slightly_lower, -0.10, 0.01, REFUTED),  # more than slightly
        (measures.slightly_lower, 0.02, 0.01, REFUTED),
        (KEPT, 0.0, 0.009, HOLDS),
        (KEPT, -0.005, 0.001, HOLDS),  # surely lower, but by less than matters
        (KEPT, 0.0, 0.02, INCONCLUSIVE),  # it might be lower by more than the margin
        (KEPT, -0.05, 0.01, REFUTED),
        (measures.most, 0.6, 0.05, HOLDS),
        (measures.most, 0.6, 0.2, INCONCLUSIVE),
        (measures.most, 0.4, 0.05, REFUTED),
    ],
)
def test_a_rule_about_one_interval(
    judge: Callable[[Interval], str], mean: float, half: float, verdict: str
) -> None:
    assert judge(around(mean, half)) == verdict
    assert judge(Interval(mean, -9.0, 9.0)) == INCONCLUSIVE


def test_the_paper_s_figures_vary_as_well() -> None:
    """Newcombe's example: 56 of 70 against 48 of 80, 20 points [5.2, 33.4]."""
    ours, theirs = values.spread(56 / 70, 70), values.spread(48 / 80, 80)
    assert tuple(measures.gap(ours, theirs)) == pytest.approx((0.2, 0.0524, 0.3339), abs=5e-5)
    assert tuple(measures.gap(around(0.8, 0.02), exactly(0.7))) == pytest.approx((0.1, 0.08, 0.12))
    below = around(0.89, 0.009)
    assert measures.reached(below, exactly(0.9)) == IN_PART
    assert measures.reached(below, Interval(0.9, 0.88, 0.92)) == HOLDS


def test_missions_that_collect_everything() -> None:
    none, some, every = Interval(0, 0, 0.01), Interval(0.1, 0.05, 0.2), Interval(1, 0.9, 1)
    assert measures.never_all(around(0.9), none) == HOLDS
    assert measures.never_all(around(0.9), some) == IN_PART
    assert measures.never_all(around(0.9), Interval(0, 0, 0.2)) == IN_PART  # few missions
    assert measures.never_all(around(0.99), some) == INCONCLUSIVE
    assert measures.never_all(around(1.0, 0), every) == REFUTED


def test_ignored_nodes() -> None:
    assert measures.ignored(around(0.8), around(0.5)) == HOLDS
    assert measures.ignored(around(0.4), around(0.2)) == IN_PART  # more than others, not most
    assert measures.ignored(around(0.9), around(-0.1)) == IN_PART  # most, but the others too
    assert measures.ignored(around(0.2), around(-0.1)) == REFUTED
    assert measures.ignored(around(0.5), around(0.0)) == INCONCLUSIVE


def test_divided_nodes() -> None:
    assert measures.divided(around(0.2), around(0.95)) == HOLDS
    assert measures.divided(around(0.0), around(0.95)) == IN_PART  # nodes of their own, no sectors
    assert measures.divided(around(0.2), around(0.6)) == IN_PART
    assert measures.divided(around(0.0), around(0.6)) == REFUTED
    assert measures.divided(around(0.0), around(0.75)) == INCONCLUSIVE


@pytest.mark.parametrize(
    ("best", "left", "verdict"),
    [
        (4, (4, 5), HOLDS),
        (4, (4, 1), INCONCLUSIVE),
        (1, (1, 4), INCONCLUSIVE),
        (1, (1, 2), REFUTED),
    ],
)
def test_a_chosen_setting(best: int, left: tuple[int, ...], verdict: str) -> None:
    choice = Choice((), 0, True, "", best, left, guaranteed=True, stage=0)
    assert measures.chosen(choice, [4, 5]) == verdict


def transfer(last: Interval, verdict: str = HOLDS, throughout: bool = True) -> Transfer:
    """Trainings that are as long as the paper's."""
    return Transfer(verdict, 0, throughout, last, values.CROSSING, (3, 3))


def test_learning_curves() -> None:
    throughout, levels_off = measures.throughout, measures.levels_off
    above = around(0.1)
    assert throughout(transfer(above)) == measures.passes(transfer(above)) == HOLDS
    below_at_first = transfer(above, throughout=False)
    assert (throughout(below_at_first), measures.passes(below_at_first)) == (IN_PART, HOLDS)
    for verdict in (INCONCLUSIVE, REFUTED):
        assert throughout(transfer(above, verdict)) == verdict
    assert levels_off(0.4, transfer(above)) == HOLDS
    assert levels_off(0.4, transfer(around(0.0))) == IN_PART  # early, not shown to be low
    assert levels_off(0.9, transfer(above)) == IN_PART  # low, not early
    assert levels_off(0.9, transfer(around(0.0))) == INCONCLUSIVE
    assert levels_off(0.9, transfer(around(-0.1))) == REFUTED
    short = replace(transfer(above), length=values.CROSSING - 1)
    assert levels_off(0.4, short) == INCONCLUSIVE


def test_the_margin_is_in_the_words() -> None:
    for rule in (RULES["kept"], RULES["no_lower"], RULES["alike"]):
        assert "1 point" in rule.in_words(0.01) and "2.5 points" in rule.in_words(0.025)


def leads_of(
    steps: list[float], *positions: int, sure: bool = True, half: float = 0.001
) -> pd.DataFrame:
    """The differences of some values of a parameter to all others, from the steps in between."""
    changes = pairs_of(steps, sure, half)
    return Pairs(changes, {str(n): n for n in range(len(steps) + 1)}).leads(*map(str, positions))


def test_the_best_value() -> None:
    best = measures.best
    assert best(leads_of([1, 1], 2)) == HOLDS
    assert best(leads_of([1, -2], 1)) == HOLDS
    assert best(leads_of([1, 1], 1)) == REFUTED
    assert best(leads_of([1, 0], 2)) == INCONCLUSIVE  # as high as the one before
    assert best(leads_of([1, 1], 2, sure=False)) == INCONCLUSIVE


def test_the_lowest_value_is_the_best_of_the_negative() -> None:
    lowest = measures.lowest
    assert lowest(negated(leads_of([1, 1], 0))) == HOLDS
    assert lowest(negated(leads_of([1, 1], 1))) == REFUTED
    assert lowest(negated(leads_of([0, 1], 0))) == INCONCLUSIVE


def test_no_lower() -> None:
    no_lower = measures.no_lower
    assert no_lower(leads_of([0, 0, 0], 0, 1), 0.01) == HOLDS
    assert no_lower(leads_of([0, -1, 0], 0, 1), 0.01) == HOLDS
    assert no_lower(leads_of([0, 1, 0], 0, 1), 0.01) == REFUTED
    assert no_lower(leads_of([0, -1, 0], 2, 3), 0.01) == REFUTED
    assert no_lower(leads_of([0, 0, 0], 0, 1, half=0.02), 0.01) == INCONCLUSIVE
    assert no_lower(leads_of([1, 0, 0], 0, 1), 0.01) == REFUTED  # the first is lower
    assert no_lower(leads_of([0, 0.005, 0], 0, 1), 0.01) == HOLDS  # by less than matters


@pytest.mark.parametrize(
    ("half", "verdict"),
    [(0.015, INCONCLUSIVE), (0.006, INCONCLUSIVE), (0.004, REFUTED)],
)
def test_only_what_is_wholly_beyond_the_margin_is_refuted(half: float, verdict: str) -> None:
    """Surely lower, perhaps by less than matters; beyond, but not with all at once; beyond."""
    assert measures.no_lower(leads_of([0, 0.02, 0], 0, 1, half=half), 0.01) == verdict
    assert measures.alike(pairs_of([0, 0.02], half=half), 0.01) == verdict


def test_alike() -> None:
    alike = measures.alike
    assert alike(pairs_of([0, 0.005]), 0.01) == HOLDS
    assert alike(pairs_of([0.005, 0.005]), 0.01) == INCONCLUSIVE  # perhaps a little more
    assert alike(pairs_of([0, 0.05]), 0.01) == REFUTED
    assert alike(pairs_of([0, -0.05]), 0.01) == REFUTED


@pytest.mark.parametrize(
    ("shape", "verdict"),
    [
        (Shape(main_effects.PEAK, (2,)), HOLDS),
        (Shape(main_effects.PEAK, (1,)), REFUTED),
        (Shape(main_effects.RISES, (2, 3)), INCONCLUSIVE),  # nothing is seen to fall
        (Shape(main_effects.LEVELS, (0, 1, 2, 3)), INCONCLUSIVE),
        (Shape(main_effects.VALLEY, ()), REFUTED),
    ],
)
def test_a_peak(shape: Shape, verdict: str) -> None:
    assert measures.peaks(shape, 2) == verdict


def test_a_rise() -> None:
    judge = measures.rises
    assert judge(Shape(main_effects.RISES, (1,))) == HOLDS
    assert judge(Shape(main_effects.LEVELS, (0, 1))) == INCONCLUSIVE
    assert judge(Shape(main_effects.FALLS, (0,))) == REFUTED
    assert judge(Shape(main_effects.PEAK, (1,))) == REFUTED
