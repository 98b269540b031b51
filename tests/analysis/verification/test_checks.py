"""Verdicts follow from p-values, corrected together, and from errors and their bounds."""

from analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED
from analysis.verification.checks import ALPHA, Check, judge


def check(**values: float) -> Check:
    return Check("topic", "test", "known", "seen", 10, **values)


def test_an_exact_check_fails_above_its_bound_only() -> None:
    table = judge([check(error=0.0), check(error=1.0), check(error=1.0, bound=1.0)])
    assert table["verdict"].tolist() == [HOLDS, REFUTED, HOLDS]


def test_p_values_are_corrected_for_their_number() -> None:
    p = 0.6 * ALPHA
    assert judge([check(p=p)])["verdict"].tolist() == [REFUTED]
    assert judge([check(p=p), check(p=0.5)])["verdict"].tolist() == [HOLDS, HOLDS]
    assert judge([check(p=p / 2), check(p=0.5)])["verdict"].tolist() == [REFUTED, HOLDS]


def test_exact_checks_and_open_ones_do_not_count_for_the_correction() -> None:
    table = judge([check(p=0.6 * ALPHA), check(error=0.0), check(), check()])
    assert table["verdict"].tolist() == [REFUTED, HOLDS, INCONCLUSIVE, INCONCLUSIVE]


def test_a_page_without_chance_is_judged_too() -> None:
    assert judge([check(error=0.0), check()])["verdict"].tolist() == [HOLDS, INCONCLUSIVE]
    assert judge([check()])["verdict"].tolist() == [INCONCLUSIVE]
