"""Classes of a fit hold all observations and all of the distribution."""

import numpy as np
import pytest
from scipy import stats

from analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED
from analysis.verification.checks import (
    ALPHA,
    Check,
    as_text,
    judge,
    on_topics,
    overall,
    poisson_fit,
    uniform_fit,
)


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


def test_an_estimate_of_a_normal_variable_by_hand() -> None:
    made = Check.normal("topic", "test", 1, 3.0, 1.0, 10, digits=2)
    assert (made.known, made.seen) == ("1", "3.00 [1.04, 4.96]")
    assert made.p == pytest.approx(0.0455, abs=1e-4)  # two standard errors


def test_an_exact_check_without_cases_is_inconclusive() -> None:
    assert Check.counted("topic", "test", "known", 0, 0).error is None
    assert Check.counted("topic", "test", "known", 0, 7).seen == "always"
    assert Check.counted("topic", "test", "known", 2, 7)[3:7] == ("otherwise 2 times", 7, None, 2)


def named(name: str, topic: str = "one", **values: float) -> Check:
    return Check(topic, name, "known", "seen", 1000, **values)


def test_the_words_name_checks_that_do_not_hold_or_are_inconclusive() -> None:
    table = judge([named("a", error=0.0), named("b", error=1.0), named("c", "two"), named("d")])
    few = " Too few observations for: c and d."
    assert overall(table).startswith(f"**1 of 4 checks do not hold**: b.{few} 2 are exact. 0 are")
    without = overall(table[table["test"] != "b"])
    assert without.startswith(f"**1 of 3 checks hold**; the others are inconclusive.{few} 1 are")
    assert on_topics(table, "one") == ("**1 of 3 checks hold**; does not hold: b; inconclusive: d.")


def test_a_row_of_the_table_gives_the_reason_of_its_verdict() -> None:
    checks = [named("a", error=0.0), named("b", error=2e-16, bound=1e-9), named("c", p=0.0004)]
    table = as_text(judge([*checks, named("d")]))
    assert table["p-value or error"].tolist() == [
        "error 0",
        "error 2e-16, allowed 1e-09",
        "p < 0.001, Holm < 0.001",
        "",
    ]
    assert table["n"].tolist() == ["1,000"] * 4


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
