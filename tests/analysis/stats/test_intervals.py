"""Intervals of means and shares: by hand, of columns, over strata, and of groups."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from dess import load_scenario
from dess.analysis.metric_ranges import metric_for_length, metric_in_missions, metric_in_space
from dess.analysis.metrics import MOST_SLOTS, OLDEST, PRODUCT, RATIO, REWARD, SUCCESS
from dess.analysis.stats.groups import summary
from dess.analysis.stats.intervals import (
    Moments,
    bounded_interval,
    column_intervals,
    interval_of,
    mean_interval,
    share_interval,
    stratified_interval,
)
from dess.analysis.stats.kinds import skewness_of
from dess.analysis.study.cheapest import horizon_of

SAMPLES = st.lists(st.floats(0, 1), min_size=1, max_size=60)


def test_one_zero_and_one_one_are_added_by_hand():
    # z^2 / 4 = 0.96036 of each: size 11.92073, centre 0.96036 / 11.92073 = 0.08056; the squares
    # are 10 x 0.08056^2 + 0.96036 x (0.08056^2 + 0.91944^2) = 0.88299, t(0.975, 10.92) = 2.20294
    # and 0.08056 + 2.20294 sqrt(0.88299 / 10.92073 / 11.92073) = 0.26199
    assert bounded_interval([0.0] * 10) == pytest.approx((0.0, 0.0, 0.26199), abs=1e-5)
    assert bounded_interval([1.0] * 10) == pytest.approx((1.0, 0.73801, 1.0), abs=1e-5)


@given(SAMPLES, st.sampled_from([0.5, 0.9, 0.95, 0.99, 0.999]))
def test_it_has_a_length_holds_the_mean_and_ends_where_shares_do(values, level):
    mean, low, high = bounded_interval(values, level)
    assert 0 <= low <= mean <= high <= 1
    assert low < high


@pytest.mark.parametrize(
    ("metric", "expected"),
    [(SUCCESS, share_interval(7, 8)), (RATIO, bounded_interval([1.0] * 7 + [0.0]))]
    # Hall's slope is -2.82843 / (3 sqrt(8)) = -1 / 3, t(0.975, 7) = 2.36462: the cube roots are
    # those of 1 - (2.36462 + 1 / 6) and 1 - (-2.36462 + 1 / 6), and s / sqrt(8) is 0.125
    + [("speed", (0.875, 0.875 - 0.125 * 6.45786, 0.875 + 0.125 * 1.41990))]
    # A failure costs 400: 2.26520 sqrt((0.875 + 2 * 0.96036 * 400^2) / 8.92073 / 9.92073)
    + [(REWARD, (0.875, 0.875 - 133.48519, 0.875 + 133.48519))],
)
def test_every_metric_has_the_interval_that_is_fit_for_it(metric, expected):
    values = pd.DataFrame({"a": [1.0] * 7 + [0.0], "b": np.nan})
    assert interval_of(metric, values["a"]) == pytest.approx(expected, abs=1e-5)
    table = column_intervals(values, metric)
    assert table.loc["a", ["mean", "low", "high"]].tolist() == pytest.approx([*expected], abs=1e-5)
    assert table.loc["b", ["mean", "low", "high"]].isna().all() and table.loc["b", "n"] == 0


# --- fixed design points are strata ---


def at_points(generator: np.random.Generator, replications: int, common: float = 0.0) -> np.ndarray:
    """(R, 3) values of points of the means 0.5, 0.7 and 0.9, that differ by little within."""
    own, shared = generator.uniform(-0.05, 0.05, (2, replications, 3))
    shared = np.broadcast_to(shared[:, :1], own.shape)
    return np.array([0.5, 0.7, 0.9]) + (1 - common) * own + common * shared


@pytest.mark.parametrize("metric", [PRODUCT, REWARD, "speed"])
def test_a_single_point_is_a_plain_sample(metric):
    values = np.random.default_rng(3).beta(8, 2, (40, 1))
    assert stratified_interval(values, metric) == interval_of(metric, values[:, 0])


def test_points_that_share_all_chance_count_as_one():
    one = np.random.default_rng(4).beta(8, 2, (40, 1))
    alike = np.repeat(one, 5, axis=1)
    assert stratified_interval(alike, PRODUCT) == pytest.approx(bounded_interval(one[:, 0]))
    for metric in (REWARD, "speed"):
        assert stratified_interval(alike, metric) == pytest.approx(interval_of(metric, one[:, 0]))
    # Failures, none of which is seen, may hit all points at once.
    certain = np.ones((40, 5))
    assert stratified_interval(certain, SUCCESS) == pytest.approx(bounded_interval(np.ones(40)))


def test_points_of_unequal_numbers_have_the_same_weight():
    values = at_points(np.random.default_rng(6), 50)
    values[10:, 2] = np.nan
    mean, low, high = stratified_interval(values, PRODUCT)
    assert mean == pytest.approx(np.nanmean(values, axis=0).mean())
    assert low < mean < high
    assert stratified_interval(values, REWARD).mean == pytest.approx(mean)


def test_a_summary_over_points_is_stratified_and_one_over_a_sample_of_points_is_not():
    values = at_points(np.random.default_rng(7), 30)
    table = pd.DataFrame({"point": np.tile(np.arange(3), 30), "replication": np.arange(90) // 3})
    table = table.assign(policy="tour", success=1, reward=0.0, **{RATIO: 0.5})
    table[PRODUCT] = values.ravel()
    row = summary(table).set_index("metric").loc[PRODUCT]
    assert tuple(row[["mean", "low", "high"]]) == stratified_interval(values, PRODUCT)
    assert row["n"] == 90
    sample = table.assign(point=np.arange(90))
    row = summary(sample).set_index("metric").loc[PRODUCT]
    assert tuple(row[["mean", "low", "high"]]) == bounded_interval(values.ravel())


def test_an_interval_over_strata_is_that_of_the_means_of_the_replications():
    values = at_points(np.random.default_rng(8), 25, common=0.5)
    expected = interval_of("speed", values.mean(axis=1))
    assert tuple(stratified_interval(values, "speed")) == pytest.approx(tuple(expected))


def test_without_skewness_the_interval_is_students():
    values = np.array([1.0, 2.0, 3.0, 5.0, 7.0, 8.0, 9.0])
    assert interval_of("speed", values) == pytest.approx(mean_interval(values), rel=1e-12)
    assert interval_of("cost", 1e6 + 1e-3 * values) == pytest.approx(
        mean_interval(1e6 + 1e-3 * values)
    )


@given(st.lists(st.floats(0, 250), min_size=2, max_size=30), st.sampled_from([0.5, 0.95, 0.999]))
def test_an_interval_of_an_age_holds_the_mean_and_ends_where_ages_do(ages, level):
    missions = pd.DataFrame({"age": ages, MOST_SLOTS: 500})
    mean, low, high = interval_of(metric_in_missions(missions, "age"), ages, level)
    assert 0 <= low <= mean * (1 + 1e-9) and mean <= high * (1 + 1e-9) and high <= 250
    ends = column_intervals(missions, metric_in_missions(missions, "age")).loc[
        "age", ["low", "high"]
    ]
    assert ends.between(0, 250).all()


@pytest.mark.parametrize(("column", "most"), [("age", 20.0), ("oldest", 20.0), ("age_p99", 24.0)])
def test_ages_of_nodes_that_were_idle_end_where_the_idle_time_has_become_older(column, most):
    """Of 16 h before a mission of 8 h the mean is at most 20 h, which a rare mission may have."""
    space = load_scenario("jade-bight", **{"age.measured": True, "data_sheet.idle": "16 h"})
    metric = metric_in_space(f"{column}_h", space)
    assert metric.range == (0.0, pytest.approx(most, abs=0.01))
    missions = pd.DataFrame({f"{column}_h": [13.0], "most_slots_h": 8.0, "idle_h": 16.0})
    assert metric_in_missions(missions, f"{column}_h").range == (0.0, most)
    _, low, high = interval_of(metric, np.full(100, 13.0))
    assert low < 13 < high
    fresh = load_scenario("jade-bight", **{"age.measured": True, "data_sheet.idle": None})
    assert metric_in_space(f"{column}_h", fresh).range[1] == pytest.approx(most - 16, abs=0.01)
    assert horizon_of(space) == pytest.approx(24, abs=0.01)
    assert horizon_of(fresh) == pytest.approx(8, abs=0.01)


def test_the_moments_of_parts_are_those_of_the_whole():
    values = np.random.default_rng(5).exponential(size=40)
    parts = Moments.of(values[:7]).with_others(Moments.of(values[7:]))
    assert parts == pytest.approx(Moments.of(values))
    assert skewness_of(parts.squares, parts.cubes, 40) == pytest.approx(
        stats.skew(values, bias=False)
    )


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        # z = 1.95996: centre (0.9 + z^2/20) / (1 + z^2/10) = 0.78899,
        # half width z sqrt(0.009 + z^2/400) / (1 + z^2/10) = 0.19314
        (share_interval(9, 10), (0.9, 0.59585, 0.98213)),
        # n / (n + z^2) for n of n, and its mirror image for none
        (share_interval(10, 10), (1.0, 0.72247, 1.0)),
        (share_interval(0, 10), (0.0, 0.0, 0.27753)),
        # mean 2, s = 1, t(0.975, 2) = 4.30265: 2 -+ 4.30265 / sqrt(3); t(0.95, 2) = 2.91999
        (mean_interval([1.0, 2.0, 3.0]), (2.0, -0.48414, 4.48414)),
        (mean_interval([1.0, 2.0, 3.0], 0.9), (2.0, 0.31414, 3.68586)),
    ],
)
def test_wilson_and_student_by_hand(found, expected):
    assert found == pytest.approx(expected, abs=1e-5)


def test_values_that_hardly_differ_have_an_interval_without_a_warning():
    with np.errstate(invalid="raise"):
        assert mean_interval([0.0, 5e-324]) == (0.0, 0.0, 0.0)


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
    # As they come, not by alphabet.
    assert list(table["policy"].unique()) == ["tour", "greedy"]
    rows = table.set_index(["policy", "metric"])
    ends = ["mean", "low", "high"]
    assert tuple(rows.loc[("tour", "success"), ends]) == share_interval(2, 3)
    assert tuple(rows.loc[("tour", "reward"), ends]) == interval_of(REWARD, [1.0, 2.0, 3.0])
    assert tuple(rows.loc[("greedy", "collection_ratio"), ends]) == bounded_interval([0.5, 0.5])
    assert rows.loc["tour", "n"].tolist() == [3] * 4


def test_summary_by_several_columns_and_by_none():
    assert len(summary(MISSIONS, by=["policy", "uavs"])) == 4 * 4
    table = summary(MISSIONS, by=[]).set_index("metric")
    assert table.loc["success", "mean"] == pytest.approx(0.8)
    assert table.loc["success", "n"] == 5


def test_an_interval_holds_a_mean_that_rounding_puts_beyond_its_range():
    metric = metric_for_length(OLDEST, 400, None)
    beyond = np.nextafter(metric.most, np.inf)
    found = interval_of(metric, np.full(50, beyond))
    assert found.low <= found.mean <= found.high
