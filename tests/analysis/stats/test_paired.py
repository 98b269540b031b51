import numpy as np
import pandas as pd
import pytest
from pandas.testing import assert_frame_equal
from scipy import stats

from analysis.stats.intervals import bootstrap_interval, expanded_level, mean_interval
from analysis.stats.paired import adjust, compare, compare_learners, crossed, paired
from dess.errors import InputError

pytestmark = pytest.mark.filterwarnings("error")

METRIC = "collection_ratio"


def rng(seed=1):
    return np.random.default_rng(seed)


def small(a, b, **arguments):
    return paired(np.array(a), np.array(b), rng(), resamples=99, **arguments)


# Pairs


def test_pairs_by_hand():
    # differences 2, 1, 3, 1: mean 1.75, s = 0.957427, t(0.975, 3) = 3.182446
    result = small([3, 5, 7, 9], [1, 4, 4, 8])
    assert result[:3] == pytest.approx((1.75, 0.22652, 3.27348), abs=1e-5)
    # variances 5, 6.1875 and, of the differences, 0.6875
    assert result.variance_reduction == pytest.approx(1 - 0.6875 / 11.1875)
    assert result.correlation == pytest.approx(np.corrcoef([3, 5, 7, 9], [1, 4, 4, 8])[0, 1])
    assert result.p == pytest.approx(stats.ttest_rel([3, 5, 7, 9], [1, 4, 4, 8]).pvalue)
    assert result.n == 4


def test_shares_by_hand():
    a, b = [1] * 5 + [0] + [1] * 4, [0] * 5 + [1] + [1] * 4
    result = small(a, b, share=True)
    # 5 gains, 1 loss: 2 (1 + 6) / 2^6; one more of each: mean 1 / 3, squares 8 - 12 / 9,
    # t(0.975, 11) = 2.200985: 1 / 3 -+ 2.200985 sqrt(6.66667 / 11 / 12)
    assert result.p == pytest.approx(14 / 64)
    assert result[:3] == pytest.approx((0.4, -0.16130, 0.82797), abs=1e-5)
    assert small(b, a, share=True)[:3] == pytest.approx((-0.4, -0.82797, 0.16130), abs=1e-5)


def test_means_of_outcomes_are_shares():
    halves = small([1.0, 0.5, 1.0], [0.5, 0.5, 1.0], share=True)
    smooth = small([1.0, 0.5, 1.0, 1.0, 0.0], [0.5, 0.5, 1.0, 0.0, 1.0])
    assert (halves.low, halves.high, halves.p) == (smooth.low, min(smooth.high, 1), smooth.p)
    assert halves.difference == pytest.approx(1 / 6)


def test_the_bootstrap_is_over_pairs():
    sea = rng(2).normal(0, 10, 400)
    a = sea + rng(3).normal(1, 1, 400)
    result = paired(a, sea, rng())
    assert result[3:5] == pytest.approx(result[1:3], abs=0.02)  # of pairs: a tenth of the sea's
    few = paired(a[:5], sea[:5], rng())
    expanded = bootstrap_interval(a[:5] - sea[:5], np.mean, rng(), expanded_level(0.95, 5))
    assert few[3:5] == expanded[1:]


def test_what_is_shared_needs_no_missions():
    # equal variances: the reduction is the correlation, here 9 / (9 + 1)
    sea, own = rng(2).normal(0, 3, 4000), rng(3).normal(0, 1, (2, 4000))
    result = paired(sea + own[0], sea + own[1], rng(), resamples=9)
    assert result.variance_reduction == pytest.approx(0.9, abs=0.01)
    assert result.correlation == pytest.approx(0.9, abs=0.01)
    assert paired(sea, -sea, rng(), resamples=9).variance_reduction == pytest.approx(-1.0)


@pytest.mark.parametrize(
    ("a", "b", "difference", "p"),
    [
        ([0.1, 0.2, 0.4], [0.1, 0.2, 0.4], 0.0, 1.0),
        ([0.1 + 0.2] * 3, [0.3] * 3, 0.0, 1.0),  # rounding is no difference
        ([1.1, 1.2, 1.4], [1.0, 1.1, 1.3], 0.1, 2 / 8),
        ([1.0, 1.1, 1.3], [1.1, 1.2, 1.4], -0.1, 2 / 8),
        ([5.0] * 4, [3.0] * 4, 2.0, 2 / 16),
        ([5.0], [3.0], 2.0, 1.0),
        ([5.0], [5.0], 0.0, 1.0),
    ],
)
def test_equal_differences_have_a_degenerate_interval_and_the_p_of_the_signs(a, b, difference, p):
    result = small(a, b)
    assert result[:5] == pytest.approx((difference,) * 5)
    assert result.low == result.high == result.bootstrap_low == result.bootstrap_high
    assert result.p == p


def test_a_constant_goes_along_with_nothing():
    assert small([1.0, 2.0, 4.0], [1.0] * 3)[6:8] == pytest.approx((0.0, 0.0))
    assert small([0.1] * 3, [0.7] * 3)[6:8] == pytest.approx((0.0, 0.0))
    assert small([0.1, 0.2, 0.4], [0.1, 0.2, 0.4])[6:8] == pytest.approx((1.0, 1.0))


@pytest.mark.parametrize(("a", "b"), [([1, 1], [1, 1]), ([1], [0]), ([1, 1, 1], [0, 0, 0])])
def test_shares_without_spread_are_not_certain(a, b):
    result = small(a, b, share=True)
    assert -1 <= result.low < result.difference <= result.high <= 1
    assert result.high - result.low > 0.5
    assert result.p == min(1, 2 * 0.5 ** sum(np.not_equal(a, b)))


@pytest.mark.parametrize(
    ("a", "b", "share"), [([], [], False), ([1.0, 2.0], [1.0], False), ([2, 1], [0, 1], True)]
)
def test_what_is_no_pair_is_refused(a, b, share):
    with pytest.raises(ValueError, match="paired: "):
        small(a, b, share=share)


# Multiplicity


def test_adjusted_by_hand():
    p = np.array([0.01, 0.04, 0.03, 0.005])
    # Holm: 0.005 x 4, 0.01 x 3, 0.03 x 2, 0.04 x 1, never falling
    assert adjust(p, "holm") == pytest.approx([0.03, 0.06, 0.06, 0.02])
    # Benjamini and Hochberg: 0.005 x 4 / 1, 0.01 x 4 / 2, 0.03 x 4 / 3, 0.04
    assert adjust(p, "fdr") == pytest.approx([0.02, 0.04, 0.04, 0.02])
    assert adjust(p, None) == pytest.approx(p)
    assert adjust(np.array([0.4, 0.9]), "holm") == pytest.approx([0.8, 0.9])
    assert adjust(np.array([0.7, 0.9]), "holm") == pytest.approx([1.0, 1.0])


# Tables


def study(policies=("tour", "greedy", "ddqn", "ddqn-2"), points=2, n=12):
    """Missions whose collection ratio is a common sea, the policy's level, and noise of its own."""
    frames = []
    for level, policy in enumerate(policies):
        for point in range(points):
            sea, own = rng(9).normal(0.5, 0.1, n), rng((level, point)).normal(0, 0.01, n)
            ratio = sea + own + 0.01 * level + 0.2 * point
            labels = {"policy": policy, "point": point, "quota": 100 * point, "seed": 7}
            values = {"replication": range(n), "uavs": np.arange(n) % 3 + 1, METRIC: ratio}
            success = (rng((level, 5)).random(n) < 0.8).astype(int)
            frames.append(pd.DataFrame(labels | values | {"success": success, "reward": -ratio}))
    return pd.concat(frames, ignore_index=True)


STUDY = study()


def compared(missions=STUDY, baseline="tour", metrics=(METRIC,), **arguments):
    return compare(missions, baseline, rng(), metrics, resamples=99, **arguments)


def ratios(policy, point=0):
    chosen = (STUDY["policy"] == policy) & (STUDY["point"] == point)
    return STUDY[chosen].sort_values("replication")[METRIC].to_numpy()


def test_a_row_per_policy_group_and_metric():
    table = compared(metrics=["success", METRIC], by=["point", "uavs"])
    assert list(table.columns[:6]) == [
        "policy",
        "baseline",
        "point",
        "uavs",
        "metric",
        "difference",
    ]
    assert {"low", "high", "bootstrap_low", "bootstrap_high"} < set(table)
    assert {"p", "p_adjusted", "correlation", "variance_reduction", "n"} < set(table)
    assert table["policy"].unique().tolist() == ["greedy", "ddqn", "ddqn-2"]
    assert set(table["baseline"]) == {"tour"}
    assert len(table) == 3 * 2 * 3 * 2
    assert table["n"].tolist() == [4] * 36
    assert not table.isna().any(axis=None)


def test_pairs_are_the_missions_of_a_replication():
    row = compared(by=["point"]).set_index(["policy", "point"]).loc[("ddqn", 1)]
    expected = paired(ratios("ddqn", 1), ratios("tour", 1), rng(), resamples=99)
    fields = ["difference", "low", "high", "p", "variance_reduction", "n"]
    assert row[fields].tolist() == pytest.approx([getattr(expected, f) for f in fields])
    assert row["difference"] == pytest.approx(0.02, abs=0.01)
    assert row["variance_reduction"] > 0.9  # the sea is common


def test_success_is_compared_as_a_share():
    rows = compared(metrics=["success"], by=["point"])
    successes = [STUDY[(STUDY.policy == p) & (STUDY.point == 0)].success for p in ("ddqn", "tour")]
    expected = paired(*map(np.asarray, successes), rng(), share=True)
    row = rows[(rows["policy"] == "ddqn") & (rows["point"] == 0)].iloc[0]
    assert (row["low"], row["high"], row["p"]) == (expected.low, expected.high, expected.p)


def test_points_of_one_sea_are_no_more_missions():
    alone = STUDY[STUDY["point"] == 0]
    pooled = compared(pd.concat([alone, alone.assign(point=1)]))
    assert_frame_equal(pooled, compared(alone))
    assert set(pooled["n"]) == {12}


def test_points_are_compared_as_policies_are():
    table = compared(baseline=0, of="point", by=["policy"]).set_index("policy")
    assert list(table.columns[:2]) == ["point", "baseline"]
    assert set(table["point"]) == {1}
    expected = paired(ratios("ddqn", 1), ratios("ddqn", 0), rng(), resamples=99)
    assert table.loc["ddqn", ["low", "high"]].tolist() == pytest.approx(expected[1:3])
    assert table["difference"].tolist() == pytest.approx([0.2] * 4, abs=0.02)


def test_the_order_of_the_missions_says_nothing():
    first = STUDY.drop_duplicates("policy")  # the order of the policies is that of the rows
    shuffled = STUDY.drop(first.index).sample(frac=1, random_state=3)
    assert_frame_equal(compared(pd.concat([first, shuffled])), compared())


def test_all_rows_count_for_the_correction():
    for correction in ("holm", "fdr", None):
        table = compared(metrics=[METRIC, "reward"], by=["point"], correction=correction)
        assert table["p_adjusted"].tolist() == adjust(table["p"].to_numpy(), correction).tolist()


def test_missions_without_point_and_seed_are_paired_by_replication():
    alone = STUDY[STUDY["point"] == 0]
    assert_frame_equal(compared(alone.drop(columns=["point", "seed"])), compared(alone))


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            lambda: compared(STUDY.drop(index=[3, 13])),
            "tour: lacks 2 of the missions of greedy, the first at point 0, seed 7, replication 3; "
            "allowed: the same missions for both",
        ),
        (
            lambda: compared(STUDY.drop(index=STUDY.index[STUDY.policy == "ddqn"][4:6])),
            "ddqn: lacks 2 of the missions of tour, the first at point 0, seed 7, replication 4; "
            "allowed: the same missions for both",
        ),
        (
            lambda: compared(pd.concat([STUDY, STUDY.iloc[[2]]])),
            "missions: policy tour, point 0, seed 7, replication 2 is there twice; allowed: every "
            "mission once",
        ),
        (
            lambda: compared(baseline="random"),
            "policy: random has no missions; allowed: tour, greedy, ddqn, ddqn-2",
        ),
        (
            lambda: compared(STUDY[STUDY.policy == "tour"]),
            "policy: nothing to compare with tour; allowed: two or more",
        ),
        (
            lambda: compared(STUDY[[*STUDY.columns[:7]]], metrics=["speed"]),
            "speed: no such column; allowed: policy, point, quota, seed, replication, uavs, "
            "collection_ratio",
        ),
        (
            lambda: compared(STUDY.assign(collection_ratio=[np.nan] * 3 + [1.0] * 93)),
            "collection_ratio: no number in 3 missions; allowed: finite numbers",
        ),
        (
            lambda: compared(by=["policy"]),
            "by: policy is what is compared; allowed: other columns",
        ),
        (lambda: compared(of="seed"), "of: 'seed'; allowed: policy, point"),
        (lambda: compared(level=95), "level: 95; allowed: between 0 and 1"),
        (
            lambda: compared(correction="bonferroni"),
            "correction: 'bonferroni'; allowed: holm, fdr, or none",
        ),
    ],
)
def test_what_does_not_pair_is_refused_in_a_line(change, line):
    with pytest.raises(InputError) as error:
        change()
    assert str(error.value) == line


# Learners


def test_crossed_by_hand():
    # Means 2 and 5 of the trainings, 2, 3 and 5.5 of the missions, 3.5 in all; the rest is -+ 0.5
    # and -+ 1: mean square 3 / 2. Components 4.5 - 1.5 / 3 = 4, 3.25 - 1.5 / 2 = 2.5 and 1.5.
    result = crossed(np.array([[1, 2, 3], [3, 4, 8]]))
    assert result[-3:] == pytest.approx(np.sqrt([4, 2.5, 1.5]))
    # t(0.975, 1) = 12.706205, t(0.975, 2) = 4.302653
    half = np.hypot(12.706205 * np.sqrt(4.5 / 2), 4.302653 * np.sqrt(2.5 / 3))
    assert result[:3] == pytest.approx((3.5, 3.5 - half, 3.5 + half), rel=1e-6)
    half = np.hypot(12.706205 * np.sqrt(4.5 / 2 + 4.5), 4.302653 * np.sqrt(2.5 / 3))
    assert result[3:5] == pytest.approx((3.5 - half, 3.5 + half), rel=1e-6)


def layout(seed, trainings=3, missions=50, training=0.02, mission=0.1, rest=0.05, mean=0.05):
    draw = rng(seed).normal
    of_mission = draw(0, mission, missions)
    return (
        mean + draw(0, training, (trainings, 1)) + of_mission + draw(0, rest, (trainings, missions))
    )


@pytest.mark.parametrize("seed", range(5))
def test_p_is_where_the_interval_meets_nothing(seed):
    d = layout(seed)
    assert crossed(d, 1 - crossed(d).p).low == pytest.approx(0, abs=1e-9)
    assert crossed(-d).p == crossed(d).p


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("training", [0.0, 0.02])
def test_trainings_make_no_interval_narrower(seed, training):
    d = layout(seed, training=training)
    result, these = crossed(d), mean_interval(d.mean(axis=0))
    assert result.high - result.low >= these.high - these.low
    assert result.new_high >= result.high


def test_negative_components_are_none():
    result = crossed(np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0]]))  # as many, elsewhere
    assert (result.training_sd, result.mission_sd) == (0.0, 0.0)
    assert result.low < 0 < result.high
    assert 0.05 < result.p < 1


def test_equal_differences_of_trainings():
    assert crossed(np.zeros((3, 4))) == (0, 0, 0, 0, 0, 1, 0, 0, 0)
    result = crossed(np.full((3, 4), 0.1))
    assert result[:5] == pytest.approx((0.1,) * 5)
    assert result[5:] == (2 / 8, 0, 0, 0)


def test_trainings_alike_leave_the_missions():
    values = np.array([1.0, 2.0, 4.0, 8.0])
    alike = crossed(np.stack([values] * 3))
    assert alike[:3] == pytest.approx(mean_interval(values))
    assert alike.p == pytest.approx(stats.ttest_1samp(values, 0).pvalue)


def test_what_one_training_or_one_mission_leaves_unknown():
    one = crossed(np.array([[1.0, 2.0, 3.0]]))
    assert one[:3] == mean_interval([1.0, 2.0, 3.0])
    assert one[3:5] == (-np.inf, np.inf)
    assert np.isnan([one.training_sd, one.rest_sd]).all()
    assert one.mission_sd == 1
    assert crossed(np.array([[1.0], [2.0]]))[:6] == (1.5, 1.5, 1.5, -np.inf, np.inf, 1.0)
    with pytest.raises(ValueError, match="no values"):
        crossed(np.empty((0, 3)))


def test_learners_are_known_by_their_trainings():
    learners = {"ddqn": ["ddqn", "ddqn-2"], "plain": ["greedy"]}
    table = compare_learners(STUDY, learners, "tour", [METRIC], by=["point"])
    assert list(table.columns[:5]) == ["learner", "baseline", "point", "metric", "about"]
    rows = table.set_index(["learner", "point"])
    assert rows["about"].tolist() == ["the learner"] * 2 + ["this checkpoint"] * 2
    assert rows["trainings"].tolist() == [2, 2, 1, 1]
    assert rows["n"].tolist() == [12] * 4
    expected = crossed(np.stack([ratios(c) - ratios("tour") for c in ("ddqn", "ddqn-2")]))
    fields = list(expected._fields)
    assert rows.loc[("ddqn", 0), fields].tolist() == pytest.approx(list(expected))
    assert table["p_adjusted"].tolist() == adjust(table["p"].to_numpy(), "holm").tolist()


@pytest.mark.parametrize("metric", ["success", METRIC])
def test_one_checkpoint_is_compared_as_a_policy_is(metric):
    ends = ["difference", "low", "high", "p", "n"]
    learner = compare_learners(STUDY, {"greedy": ["greedy"]}, "tour", [metric], by=["point"])
    policy = compared(metrics=[metric], by=["point"])[lambda rows: rows["policy"] == "greedy"]
    assert_frame_equal(learner[ends], policy[ends])


def test_learners_that_never_fail_are_not_certain_not_to():
    never = STUDY.assign(success=1)
    ends = ["low", "high", "new_low", "new_high"]
    row = compare_learners(never, {"ddqn": ["ddqn", "ddqn-2"]}, "tour", ["success"]).iloc[0]
    # two trainings alike: t of 12 pairs, a gain and a loss, t(0.975, 13) = 2.160369
    half = 2.160369 * np.sqrt(2 / 13 / 14)
    assert row[ends].tolist() == pytest.approx([-half, half] * 2, rel=1e-6)
    assert row[["difference", "p", "mission_sd"]].tolist() == [0, 1, 0]


def test_points_of_one_sea_are_no_more_missions_of_a_learner():
    alone = STUDY[STUDY["point"] == 0]
    twice = pd.concat([alone, alone.assign(point=1)])
    learners = {"ddqn": ["ddqn", "ddqn-2"]}
    assert_frame_equal(*(compare_learners(m, learners, "tour", [METRIC]) for m in (alone, twice)))


@pytest.mark.parametrize(
    ("learners", "line"),
    [
        ({"ddqn": []}, "learner ddqn: checkpoints none; "),
        ({"ddqn": ["ddqn", "ddqn"]}, "learner ddqn: checkpoints ddqn, ddqn; "),
        ({"ddqn": ["tour", "ddqn"]}, "without the baseline tour"),
        ({"ddqn": ["ddqn", "ddqn-9"]}, "policy: ddqn-9 has no missions; allowed: tour, "),
    ],
)
def test_checkpoints_are_distinct_and_there(learners, line):
    with pytest.raises(InputError, match=line):
        compare_learners(STUDY, learners, "tour", [METRIC])


def test_checkpoints_meet_the_missions_of_the_baseline():
    with pytest.raises(InputError, match="ddqn-2: lacks 1 of the missions of tour, "):
        compare_learners(STUDY.iloc[:-1], {"ddqn": ["ddqn", "ddqn-2"]}, "tour", [METRIC])
