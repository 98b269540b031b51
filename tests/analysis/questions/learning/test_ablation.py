"""Variants of a training, compared by what their trainings end with."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.questions.learning.ablation import (
    ablation,
    ablation_table,
    answer,
    difference,
    ladder,
    of_equal_budget,
)


def test_the_difference_of_means_is_welchs():
    a, b = [1.0, 2.0, 4.0], [3.0, 3.5]
    ends, p = difference(a, b)
    test = stats.ttest_ind(a, b, equal_var=False)
    assert ends.mean == pytest.approx(np.mean(a) - np.mean(b))
    assert (ends.low, ends.high) == pytest.approx(tuple(test.confidence_interval(0.95)))
    assert p == pytest.approx(test.pvalue)


def test_a_single_training_is_held_against_the_spread_of_the_others():
    """By hand: the prediction interval of one more, mean +- t s sqrt(1 + 1/n)."""
    others = np.array([1.0, 2.0, 3.0])
    ends, p = difference([5.0], others)
    half = stats.t.ppf(0.975, 2) * 1.0 * np.sqrt(1 + 1 / 3)
    assert (ends.low, ends.high) == pytest.approx((3.0 - half, 3.0 + half))
    assert p == pytest.approx(2 * stats.t.sf(3.0 / np.sqrt(4 / 3), 2))


@pytest.fixture
def last() -> pd.DataFrame:
    """Final metrics of three variants: one is worse than the baseline, one was trained once."""
    products = {"base": [0.7, 0.72, 0.74], "worse": [0.1, 0.11, 0.12], "once": [0.73]}
    rows = [
        (variant, seed, value, 1.0, value + 0.1)
        for variant, values in products.items()
        for seed, value in enumerate(values)
    ]
    metrics = [
        "final_collection_ratio_and_communication",
        "final_success",
        "final_collection_ratio",
    ]
    return pd.DataFrame(rows, columns=["variant", "seed", *metrics])


def test_the_table_of_text_has_a_row_per_variant(last: pd.DataFrame) -> None:
    table = ablation(last, "final_collection_ratio_and_communication", "base")
    rows = ablation_table(table, last, "base").fillna("").set_index("Variant")
    assert rows.index.tolist() == ["once", "base", "worse"]  # by their means
    # by hand: 0.02 t(0.975, 2) / sqrt(3) = 0.0497
    # and 0.02 t(0.975, 2) sqrt(1 + 1/3) = 0.0994 of one new training
    base = [3, "72.0 % [67.0, 77.0]", "[62.1, 81.9]", "", "", "100.0 %", "82.0 %"]
    assert rows.loc["base"].tolist() == base
    assert rows.loc["once", "One new training"] == ""
    assert rows.loc["once", "Product"] == "73.0 %"
    assert rows.loc["worse", "Difference from base [points]"].startswith("−61.0 [")
    assert [cell[-1:] for cell in rows["Difference from base [points]"]] == ["≈", "", "▼"]
    assert rows.loc["worse", "p (Holm)"] == "< 0.001"


def test_intervals_of_shares_end_where_these_do(last: pd.DataFrame) -> None:
    far = last.assign(final_success=last["seed"].map({0: 1.0, 1: 0.9, 2: 0.2}))
    table = ablation(far, "final_success", "base").set_index("variant").loc["base"]
    assert (table["low"], table["high"]) == (0.0, 1.0)
    assert (table["new_low"], table["new_high"]) == (0.0, 1.0)


def test_the_ladder_goes_from_the_paper_to_the_shipped_policy_and_counts_who_learns() -> None:
    rows = [
        ("ddqn", 1, 90, 0.9, 0.99),
        ("quick", 1, 10, 0.7, 0.98),
        ("other", 1, 10, 0.3, 1.0),
        ("none of the three", 1, 10, 0.0, 0.0),
        ("none of the three", 2, 10, 0.2, 0.6),
    ]
    product, success = "final_collection_ratio_and_communication", "final_success"
    last = pd.DataFrame(rows, columns=["variant", "seed", "updates", product, success])
    rungs = ladder(last)
    assert [*rungs["variant"].unique()] == [
        "the paper's methods",
        "and early returns (quick)",
        "ddqn, trained longer",
    ]
    assert answer(rungs) == (
        "The product rises from 10.0 % (the paper's methods) to 90.0 % (ddqn, trained longer); "
        "the largest step: and early returns (quick). Trainings that learn to charge: 1 of 2 "
        "(the paper's methods), 1 of 1 (and early returns (quick)) and 1 of 1 (ddqn, trained "
        "longer)."
    )
    assert {*of_equal_budget(last, "quick")["variant"]} == {"quick", "other", "none of the three"}
