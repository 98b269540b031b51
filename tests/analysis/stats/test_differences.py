"""Paired comparisons: worked by hand, equal differences, and tables of matched missions."""

import numpy as np
import pandas as pd
import pytest
from pandas.testing import assert_frame_equal
from scipy import stats

from dess import InputError
from dess.analysis.metric_ranges import metric_in_missions
from dess.analysis.metrics import (
    LEAST_COST,
    MOST_COST,
    MOST_SLOTS,
    MOST_WAITING,
    PRODUCT,
    REWARD,
    SUCCESS,
)
from dess.analysis.stats.corrections import adjust_p_values
from dess.analysis.stats.differences import (
    Paired,
    column_tests,
    compare,
    compare_pairs,
    compare_unpaired,
    relative_change,
)

METRIC = "collection_ratio"


def rng(seed=1):
    return np.random.default_rng(seed)


def study(policies=("tour", "greedy", "ddqn", "ddqn-2"), points=2, n=12):
    """Missions whose collection ratio is common noise, the policy's level, and noise of its own."""
    frames = []
    for level, policy in enumerate(policies):
        for point in range(points):
            common, noise = rng(9).normal(0.5, 0.1, n), rng((level, point)).normal(0, 0.01, n)
            ratio = common + noise + 0.01 * level + 0.2 * point
            labels = {"policy": policy, "point": point, "quota": 100 * point, "seed": 7}
            values = {"replication": range(n), "uavs": np.arange(n) % 3 + 1, METRIC: ratio}
            success = (rng((level, 5)).random(n) < 0.8).astype(int)
            frames.append(pd.DataFrame(labels | values | {"success": success, "reward": -ratio}))
    return pd.concat(frames, ignore_index=True)


STUDY = study()


def ratios(policy, point=0):
    chosen = (STUDY["policy"] == policy) & (STUDY["point"] == point)
    return STUDY[chosen].sort_values("replication")[METRIC].to_numpy()


def of_lists(a, b, **arguments):
    return compare_pairs(np.array(a), np.array(b), **arguments)


def test_pairs_by_hand():
    # differences 2, 1, 3, 1: mean 1.75, s = 0.957427, t(0.975, 3) = 3.182446
    result = of_lists([3, 5, 7, 9], [1, 4, 4, 8])
    assert result[:3] == pytest.approx((1.75, 0.22652, 3.27348), abs=1e-5)
    # variances 5, 6.1875 and, of the differences, 0.6875
    assert result.variance_reduction == pytest.approx(1 - 0.6875 / 11.1875)
    assert result.correlation == pytest.approx(np.corrcoef([3, 5, 7, 9], [1, 4, 4, 8])[0, 1])
    assert result.p == pytest.approx(stats.ttest_rel([3, 5, 7, 9], [1, 4, 4, 8]).pvalue)
    assert result.n == 4


def test_shares_by_hand():
    a, b = [1] * 5 + [0] + [1] * 4, [0] * 5 + [1] + [1] * 4
    result = of_lists(a, b, metric=SUCCESS)
    # 5 gains, 1 loss: 2 (1 + 6) / 2^6; one more of each: mean 1 / 3, squares 8 - 12 / 9,
    # t(0.975, 11) = 2.200985: 1 / 3 -+ 2.200985 sqrt(6.66667 / 11 / 12)
    assert result.p == pytest.approx(14 / 64)
    assert result[:3] == pytest.approx((0.4, -0.16130, 0.82797), abs=1e-5)
    assert of_lists(b, a, metric=SUCCESS)[:3] == pytest.approx((-0.4, -0.82797, 0.16130), abs=1e-5)


def test_means_of_outcomes_are_shares():
    halves = of_lists([1.0, 0.5, 1.0], [0.5, 0.5, 1.0], metric=SUCCESS)
    smooth = of_lists([1.0, 0.5, 1.0, 1.0, 0.0], [0.5, 0.5, 1.0, 0.0, 1.0])
    assert (halves.low, halves.high, halves.p) == (smooth.low, min(smooth.high, 1), smooth.p)
    assert halves.difference == pytest.approx(1 / 6)


@pytest.mark.parametrize(
    ("a", "b", "difference", "p"),
    [
        ([0.1 + 0.2] * 3, [0.3] * 3, 0.0, 1.0),  # rounding is no difference
        ([1.1, 1.2, 1.4], [1.0, 1.1, 1.3], 0.1, 2 / 8),
        ([1.0, 1.1, 1.3], [1.1, 1.2, 1.4], -0.1, 2 / 8),
    ],
)
def test_equal_differences_have_a_degenerate_interval_and_the_p_of_the_signs(a, b, difference, p):
    result = of_lists(a, b)
    assert result[:3] == pytest.approx((difference,) * 3)
    assert (result.low, result.p) == (result.high, p)


@pytest.mark.parametrize("metric", ["", REWARD, "age"])
def test_a_single_pair_without_bounds_has_no_interval(metric):
    result = of_lists([5.0], [3.0], metric=metric)
    assert (result.difference, result.p, result.n) == (2.0, 1.0, 1)
    assert np.isnan([result.low, result.high]).all()


def test_a_constant_has_no_correlation():
    assert of_lists([1.0, 2.0, 4.0], [1.0] * 3)[4:6] == pytest.approx((0.0, 0.0))
    assert of_lists([0.1] * 3, [0.7] * 3)[4:6] == pytest.approx((0.0, 0.0))
    assert of_lists([0.1, 0.2, 0.4], [0.1, 0.2, 0.4])[4:6] == pytest.approx((1.0, 1.0))


@pytest.mark.parametrize(("a", "b"), [([1, 1], [1, 1]), ([1], [0]), ([1, 1, 1], [0, 0, 0])])
def test_shares_without_spread_have_an_interval(a, b):
    result = of_lists(a, b, metric=SUCCESS)
    assert -1 <= result.low < result.difference <= result.high <= 1
    assert result.high - result.low > 0.5
    assert result.p == min(1, 2 * 0.5 ** sum(np.not_equal(a, b)))


def compared(missions=STUDY, baseline="tour", metrics=(METRIC,), **arguments):
    return compare(missions, baseline, metrics, **arguments)


def test_a_row_per_policy_group_and_metric():
    table = compared(metrics=["success", METRIC], by=["point", "uavs"])
    columns = ["policy", "baseline", "point", "uavs", "metric", "difference"]
    assert list(table.columns[:6]) == columns
    assert table["policy"].unique().tolist() == ["greedy", "ddqn", "ddqn-2"]
    assert table["n"].tolist() == [4] * (3 * 2 * 3 * 2)
    assert not table.isna().any(axis=None)


def test_pairs_are_the_missions_of_a_replication():
    row = compared(by=["point"]).set_index(["policy", "point"]).loc[("ddqn", 1)]
    fields = [*Paired._fields]
    assert tuple(row[fields]) == compare_pairs(ratios("ddqn", 1), ratios("tour", 1), metric=METRIC)
    assert row["difference"] == pytest.approx(0.02, abs=0.01)
    assert row["variance_reduction"] > 0.9  # the noise is common


def test_points_of_one_replication_are_averaged():
    alone = STUDY[STUDY["point"] == 0]
    pooled = compared(pd.concat([alone, alone.assign(point=1)]))
    assert_frame_equal(pooled, compared(alone))
    assert set(pooled["n"]) == {12}


def test_points_are_compared_as_policies_are():
    table = compared(baseline=0, of="point", by=["policy"]).set_index("policy")
    assert list(table.columns[:2]) == ["point", "baseline"]
    assert set(table["point"]) == {1}
    ends = compare_pairs(ratios("ddqn", 1), ratios("ddqn", 0), metric=METRIC)[1:3]
    assert table.loc["ddqn", ["low", "high"]].tolist() == pytest.approx([*ends])
    assert table["difference"].tolist() == pytest.approx([0.2] * 4, abs=0.02)


def test_p_values_are_corrected_over_all_rows():
    for correction in ("holm", "fdr"):
        table = compared(metrics=[METRIC, "reward"], by=["point"], correction=correction)
        assert (
            table["p_adjusted"].tolist()
            == adjust_p_values(table["p"].to_numpy(), correction).tolist()
        )
    # What is called adjusted is adjusted.
    assert "p_adjusted" not in compared(correction=None)


def test_missions_without_point_and_seed_are_paired_by_replication():
    alone = STUDY[STUDY["point"] == 0]
    assert_frame_equal(compared(alone.drop(columns=["point", "seed"])), compared(alone))


@pytest.mark.parametrize(
    ("missions", "arguments", "line"),
    [
        (STUDY.drop(index=[3, 13]), {}, "tour: lacks 2 of the missions of greedy, the first at "),
        (pd.concat([STUDY, STUDY.iloc[[2]]]), {}, "missions: policy tour, .* 2 is there twice"),
        (STUDY[STUDY.policy == "tour"], {}, "policy: nothing to compare with tour"),
        (STUDY.assign(collection_ratio=np.nan), {}, "collection_ratio: no number in 96 missions"),
        (STUDY, {"by": ["policy"]}, "by: policy is what is compared"),
        (STUDY, {"level": 95}, "level: 95; allowed: between 0 and 1"),
    ],
)
def test_missions_that_do_not_match_are_refused_in_a_line(missions, arguments, line):
    with pytest.raises(InputError, match=f"^{line}"):
        compared(missions, **arguments)


def test_differences_of_shares_end_where_these_do():
    far = of_lists([1.0, 0.0], [0.0, 1.0], metric=PRODUCT)
    assert (far.low, far.high) == (-1.0, 1.0)  # Student's t goes beyond
    free = of_lists([1.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    assert free.low < -1 and free.high > 1


@pytest.mark.parametrize("difference", [0.0, 0.25])
def test_equal_differences_of_bounded_values_have_an_interval_and_its_p_value(difference):
    a = np.full(20, 0.5 + difference)
    result = compare_pairs(a, np.full(20, 0.5), metric=PRODUCT)
    # A falls to 0, or B does, while the other one is as it was: that is the least it may be.
    expected = stats.ttest_1samp([difference] * 20 + [0.5 + difference, -0.5], 0)
    assert result.low < result.difference == difference < result.high
    assert result[1:3] == pytest.approx([*expected.confidence_interval()])
    assert result.p == pytest.approx(expected.pvalue)


@pytest.mark.parametrize(
    ("metric", "value", "column", "largest", "change"),
    # The way of an age to half of the horizon is the longest, that of a length to all of it.
    [("age", 40.0, MOST_SLOTS, 500, 210.0), ("slots", 40.0, MOST_SLOTS, 500, 460.0)]
    + [("age_h", 4.0, "most_slots_h", 50, 21.0), ("waiting_min", 60.0, "most_slots_h", 50, 2940.0)]
    + [("cost", 40.0, MOST_COST, 9000, 8960.0)],
)
def test_equal_values_do_not_rule_out_a_failure(metric, value, column, largest, change):
    """Both policies have the same value in all of 100 missions, and the interval has a length."""
    missions = pd.DataFrame(
        {"policy": np.repeat(["tour", "greedy"], 100), "replication": np.tile(range(100), 2)}
    ).assign(**{metric: value, LEAST_COST: 30.0, column: largest})
    expected = stats.ttest_1samp([0.0] * 100 + [change, -change], 0).confidence_interval()
    row = compare(missions, "tour", [metric]).iloc[0]
    assert row[["difference", "p"]].tolist() == [0.0, 1.0]
    assert row[["low", "high"]].tolist() == pytest.approx([*expected])
    alike = pd.Series(np.full(100, value))
    table = column_tests(alike.to_frame("a"), alike, metric_in_missions(missions, metric))
    assert table.loc["a", ["low", "high"]].tolist() == pytest.approx([*expected])


def waits():
    """Missions with pads for all UAVs at points 0 and 2, and with too few at point 1."""
    rows = pd.DataFrame({"point": np.repeat(range(3), 20), "replication": np.tile(range(20), 3)})
    waited = np.where(rows["point"] == 1, np.tile([0.0, 0.0, 0.0, 3.0], 15), 0.0)
    rows = rows.assign(waiting=waited, queue=waited / 50)
    return rows.assign(**{MOST_WAITING: np.where(rows["point"] == 1, 400, 0), MOST_SLOTS: 400})


@pytest.mark.parametrize("metric", ["waiting", "queue"])
def test_where_nobody_can_wait_the_others_do_not_wait_less(metric):
    alone = compare(waits(), 0, [metric], of="point").set_index("point")
    assert alone["low"].min() >= 0 and alone.loc[2, ["low", "high"]].tolist() == [0, 0]
    assert 0 < alone.loc[1, "difference"] < alone.loc[1, "high"]
    back = compare(waits(), 1, [metric], of="point")
    assert (back["high"] <= 0).all() and (back["low"] < back["difference"]).all()


def test_policies_that_cannot_wait_do_not_differ_in_their_waits():
    both = pd.concat([waits().assign(policy=policy) for policy in ("tour", "greedy")])
    rows = compare(both, "tour", ["waiting"], by=["point"])
    assert rows[["low", "high"]].to_numpy()[[0, 2]].tolist() == [[0, 0], [0, 0]]
    assert rows.loc[1, "low"] < 0 < rows.loc[1, "high"]


def test_columns_and_ratios_have_the_ranges_of_both_sides():
    none = metric_in_missions(waits().query("point == 0"), "waiting")
    some = metric_in_missions(waits().query("point == 1"), "waiting")
    waited = waits()["waiting"].to_numpy()[20:40]
    table = column_tests(
        pd.DataFrame({"a": waited}), pd.Series(0 * waited), some, metric_of_baseline=none
    )
    assert table.loc["a", "low"] == 0 < table.loc["a", "high"]
    changed = relative_change(0 * waited, waited, none, some)
    assert changed == (-1, -1, -1)


def test_intervals_of_unpaired_shares_end_where_these_do():
    far = compare_unpaired([1.0, 1.0], [0.0, 0.0], PRODUCT)
    assert far.low > -1 and far.high == 1.0
