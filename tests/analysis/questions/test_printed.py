"""Estimates beside printed figures: marks by the whole interval, one row per policy."""

import pandas as pd
import pytest

from analysis.questions import printed

ROWS = [
    ("tour", 1, "success", 0.95, 0.94, 0.96),
    ("tour", 1, "collection_ratio", 0.7, 0.65, 0.75),
    ("greedy", 1, "success", 0.9, 0.85, 0.92),
    ("greedy", 1, "collection_ratio", 0.8, 0.79, 0.81),
]
PRINTED = {"success": 0.93, "collection_ratio": 0.7}


@pytest.fixture
def estimates() -> pd.DataFrame:
    return pd.DataFrame(ROWS, columns=["policy", "uavs", "metric", "mean", "low", "high"])


def test_a_row_of_printed_figures_and_one_per_policy(estimates: pd.DataFrame) -> None:
    table = printed.beside(estimates, PRINTED)
    assert table.to_numpy().tolist() == [
        ["paper", "93.0 %", "", "70.0 %", ""],
        ["tour", "95.0 % [94.0, 96.0]", "+2.0 ▲", "70.0 % [65.0, 75.0]", "0.0 ≈"],
        ["greedy", "90.0 % [85.0, 92.0]", "−3.0 ▼", "80.0 % [79.0, 81.0]", "+10.0 ▲"],
    ]


def test_a_column_per_metric_and_number_of_uavs(estimates: pd.DataFrame) -> None:
    both = pd.concat([estimates, estimates.assign(uavs=2)])
    table = printed.beside_by_fleet(both, {1: PRINTED, 2: {"success": 0.5, "collection_ratio": 1}})
    assert [fleet for _, fleet in table.columns[1:]] == ["I = 1", "I = 2"] * 2
    assert table.iloc[:, 2].tolist() == ["50.0 %", "95.0 % [94.0, 96.0] ▲", "90.0 % [85.0, 92.0] ▲"]
