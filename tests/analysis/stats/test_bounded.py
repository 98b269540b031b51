"""The interval of a mean of values from 0 to 1: by hand, its properties, and means of strata."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from analysis.names import PRODUCT, RATIO, REWARD, SUCCESS
from analysis.stats.intervals import (
    bounded_interval,
    column_intervals,
    interval_of,
    mean_interval,
    stratified,
    summary,
    wilson,
)

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


@given(SAMPLES)
def test_the_other_end_of_the_scale_is_the_mirror_image(values):
    mean, low, high = bounded_interval(values)
    turned = bounded_interval(1 - np.array(values))
    assert turned == pytest.approx((1 - mean, 1 - high, 1 - low), abs=1e-9)


@pytest.mark.parametrize(
    ("metric", "expected"),
    [(SUCCESS, wilson(7, 8)), (RATIO, bounded_interval([1.0] * 7 + [0.0]))]
    + [(REWARD, mean_interval([1.0] * 7 + [0.0]))],
)
def test_every_metric_has_the_interval_that_is_fit_for_it(metric, expected):
    values = pd.DataFrame({"a": [1.0] * 7 + [0.0], "b": np.nan})
    assert interval_of(metric, values["a"]) == expected
    table = column_intervals(values, metric)
    assert table.loc["a", ["mean", "low", "high"]].tolist() == pytest.approx([*expected])
    assert table.loc["b", ["mean", "low", "high"]].isna().all() and table.loc["b", "n"] == 0


# --- fixed design points are strata ---


def at_points(generator: np.random.Generator, replications: int, common: float = 0.0) -> np.ndarray:
    """(R, 3) values of points of the means 0.5, 0.7 and 0.9, that differ by little within."""
    own, shared = generator.uniform(-0.05, 0.05, (2, replications, 3))
    shared = np.broadcast_to(shared[:, :1], own.shape)
    return np.array([0.5, 0.7, 0.9]) + (1 - common) * own + common * shared


@pytest.mark.parametrize("metric", [PRODUCT, REWARD])
def test_a_single_point_is_a_plain_sample(metric):
    values = np.random.default_rng(3).beta(8, 2, (40, 1))
    assert stratified(values, metric) == interval_of(metric, values[:, 0])


def test_points_that_share_all_chance_count_as_one():
    one = np.random.default_rng(4).beta(8, 2, (40, 1))
    alike = np.repeat(one, 5, axis=1)
    assert stratified(alike, PRODUCT) == pytest.approx(bounded_interval(one[:, 0]))
    assert stratified(alike, REWARD) == pytest.approx(mean_interval(one[:, 0]))
    certain = np.ones((40, 5))  # failures, none of which is seen, may hit all points at once
    assert stratified(certain, SUCCESS) == pytest.approx(bounded_interval(np.ones(40)))


def test_points_of_unequal_numbers_have_the_same_weight():
    values = at_points(np.random.default_rng(6), 50)
    values[10:, 2] = np.nan
    mean, low, high = stratified(values, PRODUCT)
    assert mean == pytest.approx(np.nanmean(values, axis=0).mean())
    assert low < mean < high
    assert stratified(values, REWARD).mean == pytest.approx(mean)


def test_a_summary_over_points_is_stratified_and_one_over_a_sample_of_points_is_not():
    values = at_points(np.random.default_rng(7), 30)
    table = pd.DataFrame({"point": np.tile(np.arange(3), 30), "replication": np.arange(90) // 3})
    table = table.assign(policy="tour", success=1, reward=0.0, **{RATIO: 0.5})
    table[PRODUCT] = values.ravel()
    row = summary(table).set_index("metric").loc[PRODUCT]
    assert tuple(row[["mean", "low", "high"]]) == stratified(values, PRODUCT)
    assert row["n"] == 90
    sample = table.assign(point=np.arange(90))
    row = summary(sample).set_index("metric").loc[PRODUCT]
    assert tuple(row[["mean", "low", "high"]]) == bounded_interval(values.ravel())


def test_student_of_strata_is_that_of_the_means_of_the_replications():
    values = at_points(np.random.default_rng(8), 25, common=0.5)
    units = values.mean(axis=1)
    low, high = stats.t.interval(0.95, 24, units.mean(), stats.sem(units))
    assert stratified(values, REWARD) == pytest.approx((units.mean(), low, high))
