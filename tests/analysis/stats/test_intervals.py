"""Intervals of shares and means, worked by hand, and tables of them."""

import pandas as pd
import pytest

from analysis.stats.distribution import quantile_interval
from analysis.stats.intervals import bounded_interval, mean_interval, summary, wilson


def test_wilson_of_nine_in_ten():
    # z = 1.95996: centre (0.9 + z^2/20) / (1 + z^2/10) = 0.78899,
    # half width z sqrt(0.009 + z^2/400) / (1 + z^2/10) = 0.19314
    assert wilson(9, 10) == pytest.approx((0.9, 0.59585, 0.98213), abs=1e-5)


def test_wilson_at_the_ends():
    # n / (n + z^2) for n of n, and its mirror image for none
    assert wilson(10, 10) == pytest.approx((1.0, 0.72247, 1.0), abs=1e-5)
    assert wilson(0, 10) == pytest.approx((0.0, 0.0, 0.27753), abs=1e-5)


def test_student_of_three_values():
    # mean 2, s = 1, t(0.975, 2) = 4.30265: 2 -+ 4.30265 / sqrt(3)
    assert mean_interval([1.0, 2.0, 3.0]) == pytest.approx((2.0, -0.48414, 4.48414), abs=1e-5)
    # t(0.95, 2) = 2.91999
    assert mean_interval([1.0, 2.0, 3.0], 0.9) == pytest.approx((2.0, 0.31414, 3.68586), abs=1e-5)


@pytest.mark.parametrize(
    "estimate",
    [lambda: wilson(0, 0), lambda: mean_interval([]), lambda: quantile_interval([], 0.5)],
)
def test_without_values_there_is_no_estimate(estimate):
    with pytest.raises(ValueError, match="no "):
        estimate()


MISSIONS = pd.DataFrame(
    {
        "policy": ["tour"] * 3 + ["greedy"] * 2,
        "uavs": [1, 1, 2, 1, 2],
        "success": [1, 1, 0, 1, 1],
        "collection_ratio": [0.2, 0.4, 0.6, 0.5, 0.5],
        "collection_ratio_and_communication": [0.2, 0.4, 0.0, 0.5, 0.5],
        "reward": [1.0, 2.0, 3.0, -1.0, 1.0],
    }
)


def test_summary_has_a_row_per_group_and_metric():
    table = summary(MISSIONS)
    assert list(table.columns) == ["policy", "metric", "mean", "low", "high", "n"]
    assert list(table["policy"].unique()) == ["tour", "greedy"]  # as they come, not by alphabet
    rows = table.set_index(["policy", "metric"])
    ends = ["mean", "low", "high"]
    assert tuple(rows.loc[("tour", "success"), ends]) == wilson(2, 3)
    assert tuple(rows.loc[("tour", "reward"), ends]) == mean_interval([1.0, 2.0, 3.0])
    assert tuple(rows.loc[("greedy", "collection_ratio"), ends]) == bounded_interval([0.5, 0.5])
    assert rows.loc["tour", "n"].tolist() == [3] * 4


def test_summary_by_several_columns_and_by_none():
    assert len(summary(MISSIONS, by=["policy", "uavs"])) == 4 * 4
    table = summary(MISSIONS, by=[]).set_index("metric")
    assert table.loc["success", "mean"] == pytest.approx(0.8)
    assert table.loc["success", "n"] == 5
