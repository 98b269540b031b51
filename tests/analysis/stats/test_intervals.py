import numpy as np
import pandas as pd
import pytest

from analysis.stats import intervals
from analysis.stats.intervals import (
    bootstrap_interval,
    distribution,
    expanded_level,
    mean_interval,
    quantile_interval,
    summary,
    tail_mean,
    wilson,
)
from dess.errors import InputError


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


@pytest.mark.parametrize("values", [[0.5], [0.5, 0.5, 0.5]])
def test_without_spread_the_interval_is_degenerate(values):
    assert mean_interval(values) == (0.5, 0.5, 0.5)
    sample = np.array(values)
    assert bootstrap_interval(sample, np.median, np.random.default_rng(1)) == (0.5, 0.5, 0.5)


@pytest.mark.parametrize(
    "estimate",
    [
        lambda: wilson(0, 0),
        lambda: mean_interval([]),
        lambda: bootstrap_interval(np.array([]), np.mean, np.random.default_rng(1)),
        lambda: quantile_interval([], 0.5),
    ],
)
def test_nothing_has_no_mean(estimate):
    with pytest.raises(ValueError, match="no "):
        estimate()


def test_bootstrap_of_a_mean_is_near_student():
    sample = np.random.default_rng(3).normal(10.0, 2.0, 400)
    ours = bootstrap_interval(sample, np.mean, np.random.default_rng(1))
    assert ours == pytest.approx(mean_interval(sample), abs=0.02)


def test_bootstrap_depends_on_its_generator_alone():
    sample = np.random.default_rng(3).exponential(size=50)
    one, again, other = (
        bootstrap_interval(sample, np.median, np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert one == again
    assert one != other


def test_bootstrap_keeps_pairs_together():
    x = np.random.default_rng(3).exponential(size=30)
    ratio = bootstrap_interval((2 * x, x), lambda a, b: a.sum() / b.sum(), np.random.default_rng(1))
    assert ratio == pytest.approx((2.0, 2.0, 2.0))


@pytest.mark.parametrize("method", ["BCa", "percentile", "basic"])
def test_bootstrap_of_many_resamples_at_once_is_that_of_one_by_one(method, monkeypatch):
    sample, sizes = np.random.default_rng(3).exponential(size=300), []

    def mean(values, axis=-1):
        sizes.append(values.size)
        return np.mean(values, axis=axis)

    def interval(statistic):
        generator = np.random.default_rng(1)
        return bootstrap_interval(sample, statistic, generator, method=method, resamples=99)

    one_by_one = interval(lambda values: np.mean(values))
    assert interval(mean) == pytest.approx(one_by_one, rel=1e-12)
    assert len(sizes) < 10
    monkeypatch.setattr(intervals, "_BATCH", 1000)  # what is in memory: three resamples
    sizes.clear()
    assert interval(mean) == pytest.approx(one_by_one, rel=1e-12)
    assert max(sizes) <= 1000


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("sample", "statistic"),
    [
        (np.arange(20.0), lambda values: len(np.unique(values))),  # more than in any resample
        (np.array([1.0, 2.0, 2.0, 2.0, 3.0]), np.median),  # whichever is left out
        (np.array([0.0, 1.0]), np.mean),
        (np.array([1.0, 2.0, 5.0]), max),  # shows no signature
    ],
)
def test_bootstrap_where_bca_is_not_defined_has_ends(sample, statistic):
    _, low, high = bootstrap_interval(sample, statistic, np.random.default_rng(1))
    assert sample.min() <= low <= high <= max(sample.max(), 20)


def test_bootstrap_at_a_level_beyond_bca_holds_the_estimate():
    # one outlier: the acceleration is near its largest, 1 / 6, and BCa turns over
    sample = np.array([1.0] + [0.0] * 29)
    mean, low, high = bootstrap_interval(sample, np.mean, np.random.default_rng(1), 1 - 1e-10)
    assert low <= mean < high


def test_few_values_need_a_higher_level():
    # t(0.975, 4) sqrt(5 / 4) = 2.776445 x 1.118034 = 3.104160, of which normal: 0.998092
    assert expanded_level(0.95, 5) == pytest.approx(0.998092, abs=1e-6)
    assert expanded_level(0.95, 10**6) == pytest.approx(0.95, abs=1e-6)
    assert expanded_level(0.95, 0.5) == expanded_level(0.95, 2) <= 1


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
    assert tuple(rows.loc[("greedy", "collection_ratio"), ends]) == (0.5, 0.5, 0.5)
    assert rows.loc["tour", "n"].tolist() == [3] * 4


def test_summary_by_several_columns_and_by_none():
    assert len(summary(MISSIONS, by=["policy", "uavs"])) == 4 * 4
    table = summary(MISSIONS, by=[]).set_index("metric")
    assert table.loc["success", "mean"] == pytest.approx(0.8)
    assert table.loc["success", "n"] == 5


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
    lowest = spread(missions.assign(slots=-missions), "slots", by=[]).iloc[-1]
    highest = spread(missions, "slots", by=[], worst="highest").iloc[-1]
    assert highest["value"] > missions["slots"].quantile(0.95)
    ends = [-lowest["value"], -lowest["high"], -lowest["low"]]
    # quantiles of 99 resamples are mirrored up to the rounding of BCa's levels
    assert highest[["value", "low", "high"]].tolist() == pytest.approx(ends)


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
        ({"metric": "speed"}, "speed: no such column; allowed: policy, uavs, success, "),
        ({"by": ["point"]}, "point: no such column; allowed: policy, "),
        ({"quantiles": [0.5, 95]}, "quantiles: 95; allowed: between 0 and 1"),
        ({"tail": 0}, "tail: 0; allowed: between 0 and 1"),
        ({"level": 1.0}, "level: 1.0; allowed: between 0 and 1"),
        ({"worst": "low"}, "worst: 'low'; allowed: lowest, highest"),
    ],
)
def test_what_is_no_distribution_is_refused_in_a_line(arguments, line):
    with pytest.raises(InputError, match=line):
        spread(**arguments)


def test_missions_without_a_value_of_the_group_are_a_group():
    table = summary(MISSIONS.assign(policy=["tour", "tour", None, "greedy", None]))
    assert table["n"].tolist() == [2] * 4 + [2] * 4 + [1] * 4
