"""How far policies are from the upper bound."""

import numpy as np
import pandas as pd
import pytest

from dess.analysis.answers import optimality
from dess.analysis.metrics import BOUND, GAP, PRODUCT


class Made:
    """Results of made-up missions."""

    bounds = {(0, 0): None}

    def __init__(self, missions):
        self.missions = missions


@pytest.fixture
def made():
    """Three missions of one UAV and two of two UAVs, by two policies; the gaps are by hand."""
    gaps = {"low": [0.10, 0.20, 0.30, 0.2, 0.2], "high": [0.05, 0.15, 0.25, 0.0, 0.1]}
    bound = np.array([0.7, 0.8, 0.9, 1.0, 1.0])
    rows = [
        {"policy": p, "point": 0, "replication": r, "uavs": u, BOUND: b, GAP: g, PRODUCT: b - g}
        | {"success": 1, "collection_ratio": b - g, "reward": 0.0}
        for p, of_policy in gaps.items()
        for r, (u, b, g) in enumerate(zip([1, 1, 1, 2, 2], bound, of_policy, strict=True))
    ]
    return Made(pd.DataFrame(rows))


def test_the_interval_is_that_of_paired_differences(made):
    table = optimality.by_fleet(made).set_index(["uavs", "policy"])
    row = table.loc[1, "low"]
    # Gaps 0.1, 0.2 and 0.3, with 0.96036 of 0 and of 1: mean 0.31710, squared deviations 0.60557,
    # t of 3.92073 degrees of freedom 2.79872.
    high = 0.31710 + 2.79872 * np.sqrt(0.60557 / 3.92073 / 4.92073)
    assert row[GAP] == pytest.approx(0.2)
    assert row[f"{GAP}_low"] == 0
    assert row[f"{GAP}_high"] == pytest.approx(high, abs=1e-4)
    assert (row["n"], row[BOUND]) == (3, pytest.approx(0.8))
    assert row[PRODUCT] == pytest.approx(row[BOUND] - row[GAP])
    # No failure moves the bound: 0.7, 0.8 and 0.9, t of 2 degrees of freedom 4.3027.
    assert row[f"{BOUND}_low"] == pytest.approx(0.8 - 4.3027 * 0.1 / np.sqrt(3), abs=1e-4)


def test_no_interval_has_what_cannot_be(made):
    """A mean product is not above the mean bound, and no gap is below 0."""
    table = optimality.by_fleet(made)
    assert (table[f"{PRODUCT}_high"] <= table[f"{BOUND}_high"]).all()
    assert (table[f"{GAP}_low"] >= 0).all()


def test_rows_are_by_number_of_uavs_then_over_all(made):
    table = optimality.by_fleet(made)
    assert [*zip(table["uavs"], table["policy"], table["n"], strict=True)] == [
        *((1, "low", 3), (1, "high", 3), (2, "low", 2), (2, "high", 2)),
        *((optimality.ALL, "low", 5), (optimality.ALL, "high", 5)),
    ]
    assert table[GAP].tolist() == pytest.approx([0.2, 0.15, 0.2, 0.05, 0.2, 0.11])


def test_the_distance_to_the_bound_has_its_n_and_few_missions_tell_nothing(made, monkeypatch):
    few = "The bounds of n = 3 missions with 1 UAV are too few to tell."
    assert optimality.in_words(made, "low").startswith(few)
    assert optimality.fleets_with_useful_bound(optimality.by_fleet(made)).empty
    monkeypatch.setattr(optimality, "LEAST", 3)
    said = optimality.in_words(made, "low")
    assert said.startswith("`low` is at most 81.3 points with 1 UAV (mean gap 20.0 [0.0, 81.3], n")
    assert "n = 3 missions) from the best possible. The upper bound is 100 % for 2 UAVs" in said
