"""Classes of a fit hold all observations and all of the distribution."""

import numpy as np
import pytest
from scipy import stats

from dess.analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED
from dess.analysis.verification.checks import ALPHA, Check, judge, poisson_fit, uniform_fit


def check(**values: float) -> Check:
    return Check("topic", "test", "known", "seen", 10, **values)


def test_p_values_are_corrected_for_their_number() -> None:
    p = 0.6 * ALPHA
    assert judge([check(p=p)])["verdict"].tolist() == [REFUTED]
    assert judge([check(p=p), check(p=0.5)])["verdict"].tolist() == [HOLDS, HOLDS]
    assert judge([check(p=p / 2), check(p=0.5)])["verdict"].tolist() == [REFUTED, HOLDS]


def test_exact_checks_and_open_ones_do_not_count_for_the_correction() -> None:
    table = judge([check(p=0.6 * ALPHA), check(error=0.0), check(), check()])
    assert table["verdict"].tolist() == [REFUTED, HOLDS, INCONCLUSIVE, INCONCLUSIVE]


def test_an_estimate_of_a_normal_variable_by_hand() -> None:
    made = Check.normal("topic", "test", 1, 3.0, 1.0, 10, digits=2)
    assert (made.known, made.seen) == ("1", "3.00 [1.04, 4.96]")
    assert made.p == pytest.approx(0.0455, abs=1e-4)  # two standard errors


@pytest.mark.parametrize("mean", [0.02, 1.0, 40.0])
def test_classes_of_a_fit_have_all_of_the_distribution(mean: float) -> None:
    counts = np.random.default_rng(2).poisson(mean, 5000)
    fit = poisson_fit(counts, mean)
    assert fit.n == 5000
    assert fit.table["expected"].sum() == pytest.approx(5000)
    assert fit.table["expected"].min() >= 5
    first, last = fit.table["label"].iloc[[0, -1]]
    low, high = (int(label.split()[0]) for label in (first, last))
    assert fit.table["observed"].iloc[0] == (counts <= low).sum()
    assert fit.table["observed"].iloc[-1] == (counts >= high).sum()
    assert last.endswith(" or more") and first.endswith(" or less") == (low > 0)


def test_the_p_value_of_a_fit_is_that_of_pearsons_test() -> None:
    values = np.random.default_rng(3).integers(1, 7, 600)
    fit = uniform_fit(values, 1, 6)
    assert fit.p == pytest.approx(stats.chisquare(np.bincount(values, minlength=7)[1:]).pvalue)
    assert fit.range == f"each {min(fit.table['observed'])} to {max(fit.table['observed'])} times"
