"""Requirements by hand: margins, verdicts and words."""

import pytest

from dess.analysis.metrics import AGE, RATIO, metric_of
from dess.analysis.stats.requirement import Requirement
from dess.analysis.stats.verdict import Verdict

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
    assert requirement.judge(*interval) == verdict


def test_words_have_the_bound_and_its_side():
    assert RATIO_OF_80.in_words == "collection ratio of at least 80 %"
    assert AGE_OF_90.in_words == "age of information of at most 90 mission slots"
    assert RATIO_OF_80.shifted(0.005, 500).bound_in_words == "at least 79.5 %"
    assert AGE_OF_90.shifted(0.005, 500).bound_in_words == "at most 92.5 mission slots"
