"""Every rule can be met, refuted and left open, by figures made up for it."""

from typing import Any

import pandas as pd
import pytest

from dess.analysis.answers.settings.shapes import LEVELS, PEAK, RISES, VALLEY, Shape
from dess.analysis.answers.training.transfer import Transfer
from dess.analysis.paper import rules, values
from dess.analysis.paper.measures import Pairs, negate_changes
from dess.analysis.paper.scorecard import RULES
from dess.analysis.stats.differences import difference_of_intervals
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.verdict import HOLDS, IN_PART, INCONCLUSIVE, REFUTED
from dess.analysis.study.selection import Choice
from tests.analysis.answers.settings.test_shapes import pairs_of


def around(mean: float, half: float = 0.01) -> Interval:
    return Interval(mean, mean - half, mean + half)


KNOWN: dict[str, dict[str, Any]] = {
    "reached": {"printed": around(0.5, 0)},
    "gained": {"printed": around(0.2, 0)},
    **dict.fromkeys(("kept", "no_lower", "alike"), {"margin": 0.01}),
}


def judged(rule: str, *arguments: object) -> str:
    return RULES[rule].judge(*arguments, **KNOWN.get(rule, {}))


@pytest.mark.parametrize(
    ("rule", "mean", "half", "verdict"),
    [
        ("reached", 0.49, 0.01, HOLDS),  # the upper end is the figure
        ("reached", 0.48, 0.01, IN_PART),  # wholly below, but near
        # Too few missions to say, but far.
        ("reached", 0.40, 0.20, INCONCLUSIVE),
        # Wholly below, and not shown to be near.
        ("reached", 0.45, 0.01, REFUTED),
        ("gained", 0.195, 0.19, IN_PART),  # it rises, but who knows how much
        ("gained", 0.09, 0.01, IN_PART),
        # Perhaps it rises, but surely not that much.
        ("gained", 0.005, 0.01, REFUTED),
        ("gained", 0.14, 0.3, INCONCLUSIVE),
        ("higher", 0.02, 0.01, HOLDS),
        ("lower", -0.02, 0.01, HOLDS),
        ("slightly_lower", -0.02, 0.01, HOLDS),
        # It falls, but who knows how much.
        ("slightly_lower", -0.05, 0.04, IN_PART),
        ("slightly_lower", -0.10, 0.01, REFUTED),  # more than slightly
        ("kept", 0.0, 0.009, HOLDS),
        # Surely lower, but by less than matters.
        ("kept", -0.005, 0.001, HOLDS),
        # It might be lower by more than the margin.
        ("kept", 0.0, 0.02, INCONCLUSIVE),
        ("most", 0.6, 0.05, HOLDS),
        ("most", 0.4, 0.05, REFUTED),
    ],
)
def test_a_rule_about_one_interval(rule, mean, half, verdict):
    assert judged(rule, around(mean, half)) == verdict
    assert judged(rule, Interval(mean, -9.0, 9.0)) == INCONCLUSIVE


def test_the_paper_s_figures_vary_as_well():
    """Newcombe's example: 56 of 70 against 48 of 80, 20 points [5.2, 33.4]."""
    ours, theirs = values.interval_of_share(56 / 70, 70), values.interval_of_share(48 / 80, 80)
    assert tuple(difference_of_intervals(ours, theirs)) == pytest.approx(
        (0.2, 0.0524, 0.3339), abs=5e-5
    )
    assert tuple(difference_of_intervals(around(0.8, 0.02), around(0.7, 0))) == pytest.approx(
        (0.1, 0.08, 0.12)
    )
    below = around(0.89, 0.009)
    assert rules.reached(below, around(0.9, 0)) == IN_PART
    assert rules.reached(below, Interval(0.9, 0.88, 0.92)) == HOLDS


NONE, SOME, EVERY = Interval(0, 0, 0.01), Interval(0.1, 0.05, 0.2), Interval(1, 0.9, 1)


def transfer(
    last: float, verdict: str = HOLDS, throughout: bool = True, length: int = values.CROSSING
) -> Transfer:
    """Trainings that are as long as the paper's, if nothing else is said."""
    return Transfer(verdict, 0, throughout, around(last), length, (3, 3))


def leads_of(
    steps: list[float], *positions: int, sure: bool = True, half: float = 0.001
) -> pd.DataFrame:
    """The differences of some values of a parameter to all others, from the steps in between."""
    changes = pairs_of(steps, sure, half)
    values = {str(n): n for n in range(len(steps) + 1)}
    return Pairs("uavs", changes, values).leads(*map(str, positions))


def chosen(best: int, *left: int) -> Choice:
    return Choice((), (), 0, True, "", best, left, guaranteed=True, stage=0)


@pytest.mark.parametrize(
    ("rule", "arguments", "verdict"),
    [
        ("never_all", [around(0.9), NONE], HOLDS),
        ("never_all", [around(0.9), SOME], IN_PART),
        ("never_all", [around(0.99), SOME], INCONCLUSIVE),
        ("never_all", [around(1.0, 0), EVERY], REFUTED),
        ("ignored", [around(0.8), around(0.5)], HOLDS),
        # More than others, not most.
        ("ignored", [around(0.4), around(0.2)], IN_PART),
        ("ignored", [around(0.5), around(0.0)], INCONCLUSIVE),
        ("divided", [around(0.2), around(0.95)], HOLDS),
        ("divided", [around(0.2), around(0.6)], IN_PART),
        ("divided", [around(0.0), around(0.75)], INCONCLUSIVE),
        ("chosen", [chosen(4, 4, 5), [4, 5]], HOLDS),
        ("chosen", [chosen(4, 4, 1), [4, 5]], INCONCLUSIVE),
        ("chosen", [chosen(1, 1, 2), [4, 5]], REFUTED),
        ("throughout", [transfer(0.1)], HOLDS),
        # Below at first.
        ("throughout", [transfer(0.1, throughout=False)], IN_PART),
        ("throughout", [transfer(0.1, INCONCLUSIVE)], INCONCLUSIVE),
        ("passes", [transfer(0.1)], HOLDS),
        ("levels_off", [0.4, transfer(0.1)], HOLDS),
        # Early, not shown to be low.
        ("levels_off", [0.4, transfer(0.0)], IN_PART),
        ("levels_off", [0.9, transfer(0.0)], INCONCLUSIVE),
        ("levels_off", [0.4, transfer(0.1, length=values.CROSSING - 1)], INCONCLUSIVE),
        ("best", [leads_of([1, 1], 2)], HOLDS),
        ("best", [leads_of([1, 1], 1)], REFUTED),
        # As high as the one before.
        ("best", [leads_of([1, 0], 2)], INCONCLUSIVE),
        ("lowest", [negate_changes(leads_of([1, 1], 0))], HOLDS),
        ("lowest", [negate_changes(leads_of([0, 1], 0))], INCONCLUSIVE),
        ("no_lower", [leads_of([0, 0, 0], 0, 1)], HOLDS),
        ("no_lower", [leads_of([0, 0, 0], 0, 1, half=0.02)], INCONCLUSIVE),
        # By less than matters.
        ("no_lower", [leads_of([0, 0.005, 0], 0, 1)], HOLDS),
        # Surely lower, perhaps by less than matters; beyond, but not with all at once; beyond.
        ("no_lower", [leads_of([0, 0.02, 0], 0, 1, half=0.006)], INCONCLUSIVE),
        ("no_lower", [leads_of([0, 0.02, 0], 0, 1, half=0.004)], REFUTED),
        ("alike", [pairs_of([0, 0.02], half=0.006)], INCONCLUSIVE),
        ("alike", [pairs_of([0, 0.02], half=0.004)], REFUTED),
        # Perhaps a little more.
        ("alike", [pairs_of([0.005, 0.005])], INCONCLUSIVE),
        ("alike", [pairs_of([0, -0.05])], REFUTED),
        ("rises", [Shape(RISES, (1,))], HOLDS),
        ("rises", [Shape(LEVELS, (0, 1))], INCONCLUSIVE),
        ("rises", [Shape(PEAK, (1,))], REFUTED),
        ("peaks", [Shape(PEAK, (2,)), 2], HOLDS),
        ("peaks", [Shape(PEAK, (1,)), 2], REFUTED),
        # Nothing is seen to fall.
        ("peaks", [Shape(RISES, (2, 3)), 2], INCONCLUSIVE),
        ("peaks", [Shape(VALLEY, ()), 2], REFUTED),
    ],
)
def test_a_rule_about_more_than_an_interval(rule, arguments, verdict):
    assert judged(rule, *arguments) == verdict
