"""Every rule can be met, half met and failed, by figures made up for it."""

import pytest

from analysis import claims, effects
from analysis.claims import FAILS, HOLDS, IN_PART
from analysis.selection import Choice
from analysis.statistics import Interval


def around(mean: float, half: float = 0.01) -> Interval:
    return Interval(mean, mean - half, mean + half)


@pytest.mark.parametrize(
    ("mean", "half", "verdict"),
    [
        (0.90, 0.01, HOLDS),  # wholly above
        (0.795, 0.01, HOLDS),  # around it
        (0.79, 0.01, HOLDS),  # the upper end is the figure
        (0.78, 0.01, IN_PART),  # wholly below, but near
        (0.70, 0.20, IN_PART),  # too few missions to say, but far
        (0.74, 0.01, FAILS),
    ],
)
def test_a_figure_is_reached(mean: float, half: float, verdict: str) -> None:
    assert claims.reached(around(mean, half), 0.80) == verdict


@pytest.mark.parametrize(
    ("mean", "verdict"),
    [(0.30, HOLDS), (0.255, HOLDS), (0.15, IN_PART), (0.005, FAILS), (-0.3, FAILS)],
)
def test_a_gain_is_as_large_as_printed(mean: float, verdict: str) -> None:
    assert claims.gained(around(mean), 0.26) == verdict


@pytest.mark.parametrize(
    ("mean", "verdict"), [(0.02, HOLDS), (0.005, IN_PART), (0.0, FAILS), (-0.02, FAILS)]
)
def test_higher_and_lower_mirror_each_other(mean: float, verdict: str) -> None:
    assert claims.higher(around(mean)) == claims.lower(around(-mean)) == verdict


@pytest.mark.parametrize(
    ("mean", "verdict"),
    [
        (-0.02, HOLDS),
        (-0.005, IN_PART),  # not sure
        (-0.10, FAILS),  # sure, but more than slightly
        (0.0, IN_PART),  # neither seen nor excluded
        (0.02, FAILS),
    ],
)
def test_slightly_lower(mean: float, verdict: str) -> None:
    assert claims.slightly_lower(around(mean)) == verdict


@pytest.mark.parametrize(
    ("mean", "half", "verdict"),
    [
        (0.0, 0.009, HOLDS),
        (0.05, 0.01, HOLDS),
        (0.0, 0.02, IN_PART),  # it might be lower by more than the margin
        (-0.005, 0.001, FAILS),  # surely lower, if only by little
        (-0.05, 0.01, FAILS),
    ],
)
def test_kept_up_to_a_margin(mean: float, half: float, verdict: str) -> None:
    assert claims.kept(around(mean, half), 0.01) == verdict


@pytest.mark.parametrize(
    ("mean", "half", "verdict"),
    [(0.0, 0.005, HOLDS), (0.0, 0.02, IN_PART), (0.02, 0.001, FAILS), (-0.02, 0.001, FAILS)],
)
def test_the_same_up_to_a_margin(mean: float, half: float, verdict: str) -> None:
    assert claims.same(around(mean, half), 0.01) == verdict


def test_shares_of_missions() -> None:
    assert claims.most(around(0.6, 0.05)) == HOLDS
    assert claims.most(around(0.6, 0.2)) == IN_PART
    assert claims.most(around(0.4, 0.2)) == FAILS
    assert [claims.always(share) for share in (1.0, 0.9, 0.5)] == [HOLDS, IN_PART, FAILS]
    assert claims.never_all(0.0, around(0.99, 0.02)) == HOLDS
    assert claims.never_all(0.1, around(0.9)) == IN_PART
    assert claims.never_all(0.9, around(1.0)) == FAILS


def test_ignored_nodes() -> None:
    assert claims.ignored(around(0.8), around(0.5)) == HOLDS
    assert claims.ignored(around(0.4), around(0.2)) == IN_PART  # more than others, not most
    assert claims.ignored(around(0.9), around(-0.1)) == IN_PART  # most, but the others too
    assert claims.ignored(around(0.2), around(-0.1)) == FAILS


def test_divided_nodes() -> None:
    assert claims.divided(around(0.2), around(0.95)) == HOLDS
    assert claims.divided(around(0.0), around(0.95)) == IN_PART  # nodes of their own, no sectors
    assert claims.divided(around(0.2), around(0.6)) == IN_PART
    assert claims.divided(around(0.0), around(0.6)) == FAILS


def test_verdicts_on_parameters_are_those_of_their_page() -> None:
    assert claims.OF_EFFECTS[effects.HOLDS] == effects.HOLDS
    assert claims.OF_EFFECTS[effects.REFUTED] == effects.REFUTED
    assert claims.OF_EFFECTS[effects.OPEN] == IN_PART


@pytest.mark.parametrize(
    ("best", "left", "verdict"),
    [(4, (4, 5), HOLDS), (4, (4, 1), IN_PART), (1, (1, 4), IN_PART), (1, (1, 2), FAILS)],
)
def test_a_chosen_setting(best: int, left: tuple[int, ...], verdict: str) -> None:
    choice = Choice(best, left, (), (), "kn", "", True, True, 0, 0, 0)
    assert claims.chosen(choice, [4, 5]) == verdict


def test_learning_curves() -> None:
    assert claims.throughout(HOLDS, True) == HOLDS
    assert claims.throughout(HOLDS, False) == IN_PART  # it ends above, but was below
    assert claims.throughout(IN_PART, True) == IN_PART
    assert claims.throughout(FAILS, False) == FAILS
    assert claims.levels_off(0.4, around(0.1)) == HOLDS
    assert claims.levels_off(0.4, around(0.0)) == IN_PART  # early, not low
    assert claims.levels_off(0.9, around(0.1)) == IN_PART  # low, not early
    assert claims.levels_off(0.9, around(0.0)) == FAILS


def test_the_margin_is_in_the_words() -> None:
    for words in (claims.kept_words, claims.same_words, claims.alike_words):
        assert "1 point" in words(0.01) and "2.5 points" in words(0.025)
