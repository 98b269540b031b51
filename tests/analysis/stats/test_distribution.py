"""Quantiles between order statistics, and means of the worst missions."""

import numpy as np
import pandas as pd
import pytest

from dess import InputError
from dess.analysis.stats.bootstrap import bootstrap_interval
from dess.analysis.stats.distribution import distribution, quantile_interval, tail_mean
from dess.analysis.stats.intervals import bounded_interval
from tests.analysis.stats.test_intervals import MISSIONS


def test_the_median_lies_between_order_statistics():
    # of 100 values: P(N < 40) = 0.0176 and P(N > 60) = 0.0176 for N ~ Bin(100, 1/2)
    assert quantile_interval(np.arange(1, 101), 0.5) == (50.5, 40, 61)
    # monotone: whatever the distribution
    assert quantile_interval(np.exp(np.arange(1, 101)), 0.5)[1:] == (np.exp(40), np.exp(61))


def test_what_no_value_bounds_is_infinite():
    # N ~ Bin(5, 0.05): P(N > 1) = 0.0226
    assert quantile_interval([5.0, 3.0, 1.0, 4.0, 2.0], 0.05) == (1.2, -np.inf, 2.0)
    assert quantile_interval([5.0, 3.0, 1.0, 4.0, 2.0], 0.95) == (4.8, 4.0, np.inf)
    assert quantile_interval([3.0], 0.5) == (3.0, -np.inf, np.inf)


def test_tail_mean_by_hand():
    values = np.random.default_rng(1).permutation(np.arange(1.0, 41.0))
    assert tail_mean(values, 0.05) == pytest.approx(1.5)  # of 1 and 2
    assert tail_mean(values, 0.0625) == pytest.approx((1 + 2 + 3 / 2) / 2.5)
    assert tail_mean(values, 0.01) == pytest.approx(1)
    assert tail_mean(values, 1) == pytest.approx(20.5)
    assert tail_mean(np.stack([values, -values]), 0.05) == pytest.approx([1.5, -39.5])
    assert tail_mean(np.stack([values, -values], axis=1), 0.05, axis=0) == pytest.approx(
        [1.5, -39.5]
    )


def spread(missions=MISSIONS, metric="reward", **arguments):
    return distribution(missions, metric, np.random.default_rng(1), resamples=99, **arguments)


def test_distribution_has_a_row_per_group_and_view():
    table = spread(quantiles=(0.25, 0.5))
    columns = ["policy", "metric", "view", "share", "value", "low", "high", "n"]
    assert list(table.columns) == columns
    assert table["policy"].tolist() == ["tour"] * 3 + ["greedy"] * 3
    assert table["view"].tolist() == ["quantile", "quantile", "worst mean"] * 2
    assert table["share"].tolist() == [0.25, 0.5, 0.05] * 2
    assert table["value"].tolist() == [1.5, 2.0, 1.0, -0.5, 0.0, -1.0]
    assert table["n"].tolist() == [3] * 3 + [2] * 3
    assert set(table["metric"]) == {"reward"}
    assert spread(by=[])["n"].tolist() == [5] * 6


def test_the_worst_are_at_the_end_that_is_asked_for():
    missions = pd.DataFrame({"slots": np.random.default_rng(3).exponential(size=500)})
    mirrored = missions.assign(slots=-missions)
    lowest = spread(mirrored, "slots", by=[], worst="lowest").iloc[-1]
    highest = spread(missions, "slots", by=[], worst="highest").iloc[-1]
    assert highest["value"] > missions["slots"].quantile(0.95)
    ends = [-lowest["value"], -lowest["high"], -lowest["low"]]
    # quantiles of 99 resamples are mirrored up to the rounding of BCa's levels
    assert highest[["value", "low", "high"]].tolist() == pytest.approx(ends)
    assert spread(missions, "slots", by=[]).iloc[-1].equals(highest)  # more slots are worse


def test_missions_that_have_measured_nothing_are_left_out():
    """No UAV has asked for a pad in them, so they are no missions without a wait."""
    waits = pd.DataFrame(
        {"policy": ["tour"] * 5 + ["greedy"], "waiting": [3.0, 1, 5, *[np.nan] * 3]}
    )
    table = spread(waits, "waiting", quantiles=[0.5])
    assert table["policy"].tolist() == ["tour"] * 2
    assert table["value"].tolist() == [3.0, 5.0] and set(table["n"]) == {3}


def test_the_interval_of_the_worst_is_wider_than_that_of_its_bootstrap():
    missions = pd.DataFrame({"reward": np.random.default_rng(3).normal(size=200)})
    risk = spread(missions, by=[]).iloc[-1]
    plain = bootstrap_interval(
        missions["reward"].to_numpy(), tail_mean, np.random.default_rng(1), resamples=99
    )
    assert risk["value"] == plain.mean
    assert risk["low"] <= plain.low <= plain.high <= risk["high"]
    assert risk["high"] - risk["low"] > plain.high - plain.low


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"metric": "speed"}, "speed: no such column; allowed: policy, uavs, "),
        ({"tail": 0}, "tail: 0; allowed: between 0 and 1"),
        ({"worst": "low"}, "worst: 'low'; allowed: lowest, highest"),
    ],
)
def test_what_is_no_distribution_is_refused_in_a_line(arguments, line):
    with pytest.raises(InputError, match=line):
        spread(**arguments)


def test_the_worst_mean_of_missions_that_all_fail_has_an_interval():
    missions = pd.DataFrame({"policy": "tour", "collection_ratio": np.zeros(600)})
    worst = spread(missions, "collection_ratio").iloc[-1]
    expected = bounded_interval(np.zeros(30))
    assert (worst["value"], worst["low"], worst["high"]) == expected
    assert expected.high > 0
