"""What intervals and tests show, refute and leave open."""

import numpy as np
import pandas as pd
import pytest

from dess.analysis.metrics import AGE, PRODUCT
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.verdict import (
    ABOVE,
    BELOW,
    HOLDS,
    IN_PART,
    INCONCLUSIVE,
    REFUTED,
    Verdict,
    better_or_worse,
    judge_facts,
    judge_margins,
    judge_parts,
    position_by_test,
    position_of,
    position_with_allowance,
    rule_for_pages,
    verdict_above,
)


@pytest.mark.parametrize(
    ("low", "high", "side", "part"),
    [
        (0.1, 0.3, ABOVE, True),
        (-0.3, -0.1, BELOW, False),
        (0.0, 0.0, INCONCLUSIVE, None),
        (np.nan, np.nan, INCONCLUSIVE, None),
    ],
)
def test_a_whole_interval_lies_on_one_side(low, high, side, part):
    assert position_of(Interval((low + high) / 2, low, high)) == side
    assert position_of(Interval((low + high) / 2 + 1, low + 1, high + 1), 1) == side
    assert position_of(pd.Series({"low": low, "high": high})) == side
    assert verdict_above(Interval((low + high) / 2, low, high)) is part


@pytest.mark.parametrize(
    ("difference", "p", "side"),
    [
        (0.1, 0.05, ABOVE),
        (-0.1, 0.01, BELOW),
        (0.1, 0.06, INCONCLUSIVE),
        (0.0, 0.01, INCONCLUSIVE),
        (np.nan, np.nan, INCONCLUSIVE),
    ],
)
def test_a_significant_difference_lies_on_one_side(difference, p, side):
    assert position_by_test(difference, p) == side


def test_verdicts_on_parts():
    assert judge_parts(True) == judge_parts(True, True) == HOLDS
    assert judge_parts(True, False) == judge_parts(True, None) == IN_PART
    assert judge_parts(False) == judge_parts(False, None) == judge_parts(False, False) == REFUTED
    assert judge_parts(None) == judge_parts(None, None) == INCONCLUSIVE


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (0.0, 0.1, Verdict.MET),
        (-0.1, 0.1, Verdict.OPEN),
        (0.1, -0.1, Verdict.OPEN),  # of a metric of which less is better
        (-0.2, -0.1, Verdict.MISSED),
        (np.nan, np.nan, Verdict.OPEN),
    ],
)
def test_a_requirement_is_met_if_no_end_is_on_the_wrong_side(low, high, verdict):
    assert judge_margins(low, high) == verdict


def test_within_the_tolerance_the_mean_decides():
    assert judge_facts(True, True, 0.0) == Verdict.MET
    assert judge_facts(True, True, -1e-9) == Verdict.MISSED
    assert judge_facts(True, False, -1.0) == Verdict.MET


def test_pages_have_the_same_rule():
    rule = rule_for_pages()
    table = [[judge_facts(kept, broken, -1) for broken in (0, 1)] for kept in (0, 1)]
    assert rule["table"][1][1] is None  # where the mean decides
    assert [[*rule["table"][0]], rule["table"][1][0]] == [table[0], table[1][0]]
    assert rule["mostSeriousFirst"] == ["missed", "open", "met"]


def test_the_most_serious_verdict_is_that_of_all():
    assert Verdict.of_all(["met", "open", "missed"]) == Verdict.MISSED
    assert Verdict.of_all(["met", "open"]) == Verdict.OPEN
    assert Verdict.of_all(["met"]) == Verdict.MET


@pytest.mark.parametrize(
    ("whole", "seen", "verdict", "of_age"),
    [
        (ABOVE, ABOVE, "better", "worse"),
        (INCONCLUSIVE, ABOVE, "better in what was seen", "worse in what was seen"),
        (INCONCLUSIVE, INCONCLUSIVE, INCONCLUSIVE, INCONCLUSIVE),
        (INCONCLUSIVE, BELOW, "worse in what was seen", "better in what was seen"),
        (BELOW, BELOW, "worse", "better"),
    ],
)
def test_a_difference_is_better_or_worse_by_its_metric(whole, seen, verdict, of_age):
    side = position_with_allowance(whole, seen)
    assert better_or_worse(side, PRODUCT) == verdict
    assert better_or_worse(side, AGE) == of_age
