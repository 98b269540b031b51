"""Requirements by hand: margins, verdicts and what is tight."""

import pandas as pd
import pytest

from dess.analysis.answers.fleet.requirements import (
    Requirement,
    Verdict,
    least_spare,
    relative_spare,
)
from dess.analysis.metrics import AGE, RATIO, SUCCESS, metric_of

RATIO_OF_80 = Requirement(metric_of(RATIO), 0.8)
AGE_OF_90 = Requirement(metric_of(AGE), 90)


def test_a_margin_is_positive_on_the_right_side():
    assert RATIO_OF_80.margin(0.9) == pytest.approx(0.1)
    assert AGE_OF_90.margin(100) == -10


@pytest.mark.parametrize(
    ("requirement", "interval", "verdict"),
    [
        (RATIO_OF_80, (0.8, 0.9), Verdict.MET),
        (RATIO_OF_80, (0.7, 0.9), Verdict.OPEN),
        (RATIO_OF_80, (0.7, 0.79), Verdict.MISSED),
        (AGE_OF_90, (80, 90), Verdict.MET),
        (AGE_OF_90, (80, 91), Verdict.OPEN),
        (AGE_OF_90, (91, 99), Verdict.MISSED),
    ],
)
def test_the_whole_interval_decides(requirement, interval, verdict):
    assert requirement.verdict(*interval) == verdict


def test_the_most_serious_verdict_is_that_of_all():
    assert Verdict.of_all(["met", "open", "missed"]) == Verdict.MISSED
    assert Verdict.of_all(["met", "open"]) == Verdict.OPEN
    assert Verdict.of_all(["met"]) == Verdict.MET


def test_words_have_the_bound_and_its_side():
    assert RATIO_OF_80.in_words == "collection ratio of at least 80 %"
    assert AGE_OF_90.in_words == "age of information of at most 90 mission slots"
    assert RATIO_OF_80.shifted(0.005, 500).bound_in_words == "at least 79.5 %"
    assert AGE_OF_90.shifted(0.005, 500).bound_in_words == "at most 92.5 mission slots"


def test_a_success_that_all_fleets_have_is_not_tight():
    """It is nearer to its bound than the ratio, but no fleet comes closer."""
    success = Requirement(metric_of(SUCCESS), 0.99)
    fleets = pd.DataFrame({SUCCESS: [1.0, 1.0, 1.0], RATIO: [0.68, 0.82, 0.88]})
    assert relative_spare(fleets, success).tolist() == [float("inf")] * 3
    assert relative_spare(fleets, RATIO_OF_80).tolist() == pytest.approx([-0.6, 0.1, 0.4])
    assert least_spare(fleets, [success, RATIO_OF_80]).tolist() == pytest.approx([-0.6, 0.1, 0.4])
