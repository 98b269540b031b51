"""Classes of a fit hold all observations and all of the distribution."""

import numpy as np
import pytest
from scipy import stats

from analysis.verification.checks import poisson_fit, uniform_fit


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


def test_a_value_outside_refutes_a_uniform_fit() -> None:
    values = np.repeat(np.arange(1, 7), 100)
    assert uniform_fit(values, 1, 6).p == pytest.approx(1)
    assert uniform_fit(np.append(values, 7), 1, 6).p == 0


def test_shares_of_the_first_classes_are_in_percent() -> None:
    fit = uniform_fit(np.repeat([0, 1], [30, 70]), 0, 1)
    assert fit.shares == "0: 30.00 %, 1: 70.00 %; expected 50.00 / 50.00 %"
