"""Every rule can be met, refuted and left open, by figures made up for it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from analysis.replication import paper, rules
from analysis.replication.rules import NO_RESULTS, VERDICTS
from analysis.stats.intervals import Interval
from analysis.stats.verdict import HOLDS, IN_PART, INCONCLUSIVE, REFUTED
from analysis.study.selection import Choice
from tests.analysis.questions.test_main_effects import pairs_of

RULES = (
    rules.reached,
    lambda difference: rules.gained(difference, 0.2),
    rules.higher,
    rules.lower,
    rules.slightly_lower,
    lambda difference: rules.kept(difference, 0.01),
    rules.most,
)


def around(mean: float, half: float = 0.01) -> Interval:
    return Interval(mean, mean - half, mean + half)


@given(st.floats(-1, 1), st.integers(0, len(RULES) - 1))
def test_what_is_not_known_at_all_is_never_told(mean: float, rule: int) -> None:
    assert RULES[rule](Interval(mean, -9.0, 9.0)) == INCONCLUSIVE


@pytest.mark.parametrize(
    ("mean", "half", "verdict"),
    [
        (0.10, 0.01, HOLDS),  # wholly above
        (-0.005, 0.01, HOLDS),  # around it
        (-0.01, 0.01, HOLDS),  # the upper end is the figure
        (-0.02, 0.01, IN_PART),  # wholly below, but near
        (-0.10, 0.20, INCONCLUSIVE),  # too few missions to say, but far
        (0.01, 0.20, INCONCLUSIVE),  # too few missions to say, if near
        (-0.06, 0.005, REFUTED),
        (-0.05, 0.01, REFUTED),  # wholly below, and not shown to be near
    ],
)
def test_a_figure_is_reached(mean: float, half: float, verdict: str) -> None:
    assert rules.reached(around(mean, half)) == verdict


def test_the_paper_s_figures_vary_as_well() -> None:
    """Newcombe's example: 56 of 70 against 48 of 80, 20 points [5.2, 33.4]."""
    ours, theirs = paper.spread(56 / 70, 70), paper.spread(48 / 80, 80)
    assert tuple(rules.gap(ours, theirs)) == pytest.approx((0.2, 0.0524, 0.3339), abs=5e-5)
    exact = rules.gap(around(0.8, 0.02), Interval(0.7, 0.7, 0.7))
    assert tuple(exact) == pytest.approx((0.1, 0.08, 0.12))
    assert rules.reached(rules.gap(around(0.89, 0.01), Interval(0.9, 0.9, 0.9))) == HOLDS
    below = around(0.89, 0.009)
    assert rules.reached(rules.gap(below, Interval(0.9, 0.9, 0.9))) == IN_PART
    assert rules.reached(rules.gap(below, Interval(0.9, 0.88, 0.92))) == HOLDS


def test_the_interval_of_a_printed_share_is_wilsons() -> None:
    ends = stats.binomtest(901, 1000).proportion_ci(method="wilson")
    assert tuple(paper.spread(0.901, 1000)) == (0.901, ends.low, ends.high)


@pytest.mark.parametrize(
    ("mean", "half", "verdict"),
    [
        (0.30, 0.01, HOLDS),
        (0.255, 0.01, HOLDS),
        (0.255, 0.2, IN_PART),  # it rises, but who knows how much
        (0.15, 0.01, IN_PART),
        (0.005, 0.01, REFUTED),  # perhaps it rises, but surely not that much
        (-0.3, 0.01, REFUTED),
        (0.2, 0.3, INCONCLUSIVE),
    ],
)
def test_a_gain_is_as_large_as_printed(mean: float, half: float, verdict: str) -> None:
    assert rules.gained(around(mean, half), 0.26) == verdict


@pytest.mark.parametrize(
    ("mean", "verdict"),
    [(0.02, HOLDS), (0.005, INCONCLUSIVE), (-0.001, INCONCLUSIVE), (-0.02, REFUTED)],
)
def test_higher_and_lower_mirror_each_other(mean: float, verdict: str) -> None:
    assert rules.higher(around(mean)) == rules.lower(around(-mean)) == verdict


@pytest.mark.parametrize(
    ("mean", "half", "verdict"),
    [
        (-0.02, 0.01, HOLDS),
        (-0.005, 0.01, INCONCLUSIVE),
        (0.0, 0.01, INCONCLUSIVE),
        (-0.05, 0.04, IN_PART),  # it falls, but who knows how much
        (-0.10, 0.01, REFUTED),  # more than slightly
        (0.02, 0.01, REFUTED),
    ],
)
def test_slightly_lower(mean: float, half: float, verdict: str) -> None:
    assert rules.slightly_lower(around(mean, half)) == verdict


@pytest.mark.parametrize(
    ("mean", "half", "verdict"),
    [
        (0.0, 0.009, HOLDS),
        (0.05, 0.01, HOLDS),
        (-0.005, 0.001, HOLDS),  # surely lower, but by less than matters
        (0.0, 0.02, INCONCLUSIVE),  # it might be lower by more than the margin
        (-0.02, 0.015, INCONCLUSIVE),
        (-0.05, 0.01, REFUTED),
    ],
)
def test_kept_up_to_a_margin(mean: float, half: float, verdict: str) -> None:
    assert rules.kept(around(mean, half), 0.01) == verdict


def test_shares_of_missions() -> None:
    assert rules.most(around(0.6, 0.05)) == HOLDS
    assert rules.most(around(0.6, 0.2)) == rules.most(around(0.4, 0.2)) == INCONCLUSIVE
    assert rules.most(around(0.4, 0.05)) == REFUTED


def test_missions_that_collect_everything() -> None:
    none, some, every = Interval(0, 0, 0.01), Interval(0.1, 0.05, 0.2), Interval(1, 0.9, 1)
    assert rules.never_all(none, around(0.9)) == HOLDS
    assert rules.never_all(some, around(0.9)) == IN_PART
    assert rules.never_all(Interval(0, 0, 0.2), around(0.9)) == IN_PART  # few missions
    assert rules.never_all(some, around(0.99)) == INCONCLUSIVE
    assert rules.never_all(every, around(1.0, 0)) == REFUTED


def test_ignored_nodes() -> None:
    assert rules.ignored(around(0.8), around(0.5)) == HOLDS
    assert rules.ignored(around(0.4), around(0.2)) == IN_PART  # more than others, not most
    assert rules.ignored(around(0.9), around(-0.1)) == IN_PART  # most, but the others too
    assert rules.ignored(around(0.2), around(-0.1)) == REFUTED
    assert rules.ignored(around(0.5), around(0.0)) == INCONCLUSIVE


def test_divided_nodes() -> None:
    assert rules.divided(around(0.2), around(0.95)) == HOLDS
    assert rules.divided(around(0.0), around(0.95)) == IN_PART  # nodes of their own, no sectors
    assert rules.divided(around(0.2), around(0.6)) == IN_PART
    assert rules.divided(around(0.0), around(0.6)) == REFUTED
    assert rules.divided(around(0.0), around(0.75)) == INCONCLUSIVE


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
    choice = Choice(best, left, (), (), "kn", "", True, True, 0, 0, 0)
    assert rules.chosen(choice, [4, 5]) == verdict


def test_learning_curves() -> None:
    assert rules.throughout(HOLDS, True) == HOLDS
    assert rules.throughout(HOLDS, False) == IN_PART  # it ends above, but was below
    assert rules.throughout(INCONCLUSIVE, True) == INCONCLUSIVE
    assert rules.throughout(REFUTED, False) == REFUTED
    assert rules.levels_off(0.4, around(0.1)) == HOLDS
    assert rules.levels_off(0.4, around(0.0)) == IN_PART  # early, not shown to be low
    assert rules.levels_off(0.9, around(0.1)) == IN_PART  # low, not early
    assert rules.levels_off(0.9, around(0.0)) == INCONCLUSIVE
    assert rules.levels_off(0.9, around(-0.1)) == REFUTED


def test_single_trainings_leave_it_open() -> None:
    assert rules.levels_off(0.9, Interval(0.1, np.nan, np.nan)) == INCONCLUSIVE


def test_the_margin_is_in_the_words() -> None:
    for words in (rules.kept_words, rules.no_lower_words, rules.alike_words):
        assert "1 point" in words(0.01) and "2.5 points" in words(0.025)


def test_the_verdicts_are_five_words() -> None:
    assert {*VERDICTS} == {HOLDS, IN_PART, INCONCLUSIVE, REFUTED, NO_RESULTS}


def test_best_at() -> None:
    assert rules.best_at(pairs_of([1, 1]), 2) == HOLDS
    assert rules.best_at(pairs_of([1, -2]), 1) == HOLDS
    assert rules.best_at(pairs_of([1, 1]), 1) == REFUTED
    assert rules.best_at(pairs_of([1, 0]), 2) == INCONCLUSIVE  # as high as the one before
    assert rules.best_at(pairs_of([1, 1], sure=False), 2) == INCONCLUSIVE


def test_no_lower() -> None:
    assert rules.no_lower(pairs_of([0, 0, 0]), [0, 1], 0.01) == HOLDS
    assert rules.no_lower(pairs_of([0, -1, 0]), [0, 1], 0.01) == HOLDS
    assert rules.no_lower(pairs_of([0, 1, 0]), [0, 1], 0.01) == REFUTED
    assert rules.no_lower(pairs_of([0, -1, 0]), [2, 3], 0.01) == REFUTED
    assert rules.no_lower(pairs_of([0, 0, 0], half=0.02), [0, 1], 0.01) == INCONCLUSIVE
    assert rules.no_lower(pairs_of([1, 0, 0]), [0, 1], 0.01) == REFUTED  # the first is lower
    assert rules.no_lower(pairs_of([0, 0.005, 0]), [0, 1], 0.01) == HOLDS  # by less than matters


def test_no_lower_is_refuted_beyond_the_margin_alone() -> None:
    """Surely lower, but perhaps by less than matters; or beyond, but not with all at once."""
    assert rules.no_lower(pairs_of([0, 0.02, 0], half=0.015), [0, 1], 0.01) == INCONCLUSIVE
    assert rules.no_lower(pairs_of([0, 0.02, 0], half=0.006), [0, 1], 0.01) == INCONCLUSIVE
    assert rules.no_lower(pairs_of([0, 0.02, 0], half=0.004), [0, 1], 0.01) == REFUTED


def test_alike() -> None:
    assert rules.alike(pairs_of([0, 0.005]), 0.01) == HOLDS
    assert rules.alike(pairs_of([0.005, 0.005]), 0.01) == INCONCLUSIVE  # it might be a little more
    assert rules.alike(pairs_of([0, 0.05]), 0.01) == REFUTED
    assert rules.alike(pairs_of([0, -0.05]), 0.01) == REFUTED


def test_alike_is_refuted_beyond_the_margin_alone() -> None:
    """The differences are sure, and by their means beyond the margin: that is not enough."""
    assert rules.alike(pairs_of([0, 0.02], half=0.015), 0.01) == INCONCLUSIVE
    assert rules.alike(pairs_of([0, 0.02], half=0.006), 0.01) == INCONCLUSIVE  # not all at once
    assert rules.alike(pairs_of([0, 0.02], half=0.004), 0.01) == REFUTED


def test_peaks_at() -> None:
    assert rules.peaks_at(pairs_of([1, 1, -1]), 2) == HOLDS
    assert rules.peaks_at(pairs_of([1, 1, -1]), 1) == REFUTED
    assert rules.peaks_at(pairs_of([1, 1, 0]), 2) == INCONCLUSIVE  # nothing is seen to fall
    assert rules.peaks_at(pairs_of([0, 0, 0]), 2) == INCONCLUSIVE


def test_rises() -> None:
    assert rules.rises(pairs_of([0, 1])) == HOLDS
    assert rules.rises(pairs_of([0, 0])) == INCONCLUSIVE
    assert rules.rises(pairs_of([0, -1])) == rules.rises(pairs_of([1, -1])) == REFUTED
