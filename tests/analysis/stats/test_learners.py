"""Learners of several trainings: crossed random factors by hand, and tables of them."""

import numpy as np
import pytest
from pandas.testing import assert_frame_equal

from dess import InputError
from dess.analysis.stats.corrections import adjust_p_values
from dess.analysis.stats.differences import compare
from dess.analysis.stats.intervals import mean_interval
from dess.analysis.stats.learners import compare_crossed, compare_learners
from tests.analysis.stats.test_differences import METRIC, STUDY, ratios, rng

pytestmark = pytest.mark.filterwarnings("error")


def test_crossed_by_hand():
    # Means 2 and 5 of the trainings, 2, 3 and 5.5 of the missions, 3.5 in all; the rest is -+ 0.5
    # and -+ 1: mean square 3 / 2. Components 4.5 - 1.5 / 3 = 4, 3.25 - 1.5 / 2 = 2.5 and 1.5.
    result = compare_crossed(np.array([[1, 2, 3], [3, 4, 8]]))
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
def test_p_is_where_the_interval_reaches_0(seed):
    d = layout(seed)
    assert compare_crossed(d, 1 - compare_crossed(d).p).low == pytest.approx(0, abs=1e-9)
    assert compare_crossed(-d).p == compare_crossed(d).p


def test_negative_variance_components_are_zero():
    # As many, elsewhere.
    result = compare_crossed(np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0]]))
    assert (result.training_sd, result.mission_sd) == (0.0, 0.0)
    assert result.low < 0 < result.high
    assert 0.05 < result.p < 1


def test_equal_differences_of_trainings():
    assert compare_crossed(np.zeros((3, 4))) == (0, 0, 0, 0, 0, 1, 1, 0, 0, 0)
    result = compare_crossed(np.full((3, 4), 0.1))
    assert result[:5] == pytest.approx((0.1,) * 5)
    assert result[5:] == (2 / 8, 2 / 8, 0, 0, 0)


def test_one_training_or_one_mission_leaves_deviations_unknown():
    one = compare_crossed(np.array([[1.0, 2.0, 3.0]]))
    assert one[:3] == mean_interval([1.0, 2.0, 3.0])
    assert np.isnan(one[3:5]).all()
    assert np.isnan([one.training_sd, one.rest_sd]).all()
    assert one.mission_sd == 1
    alone = compare_crossed(np.array([[1.0], [2.0]]))
    assert (alone.difference, alone.p) == (1.5, 1.0) and np.isnan(alone[1:5]).all()


def test_learners_are_known_by_their_trainings():
    learners = {"ddqn": ["ddqn", "ddqn-2"], "plain": ["greedy"]}
    table = compare_learners(STUDY, learners, "tour", [METRIC], by=["point"])
    assert list(table.columns[:5]) == ["learner", "baseline", "point", "metric", "about"]
    rows = table.set_index(["learner", "point"])
    assert rows["about"].tolist() == ["the learner"] * 2 + ["this checkpoint"] * 2
    assert rows["trainings"].tolist() == [2, 2, 1, 1]
    assert rows["n"].tolist() == [12] * 4
    trained, tour = np.stack([ratios(c) for c in ("ddqn", "ddqn-2")]), ratios("tour")
    expected, row = compare_crossed(trained - tour), rows.loc[("ddqn", 0)]
    assert row["difference"] == pytest.approx(expected.difference)
    assert row[["training_sd", "rest_sd"]].tolist() == pytest.approx(expected[-3::2])
    # One trained policy falls to 0 while the baseline is at its mean, or the other way round.
    a, b = trained.mean(), tour.mean()
    smooth = compare_crossed(np.hstack([trained - tour, [[max(a, 1 - b), -max(b, 1 - a)]] * 2]))
    assert row[["low", "new_low", "p"]].tolist() == pytest.approx(
        [smooth.low, smooth.new_low, smooth.p]
    )
    assert table["p_adjusted"].tolist() == adjust_p_values(table["p"].to_numpy(), "holm").tolist()


@pytest.mark.parametrize("metric", ["success", METRIC])
def test_one_checkpoint_is_compared_as_a_policy_is(metric):
    ends = ["difference", "low", "high", "p", "n"]
    learner = compare_learners(STUDY, {"greedy": ["greedy"]}, "tour", [metric], by=["point"])
    policy = compare(STUDY, "tour", [metric], by=["point"])[lambda rows: rows["policy"] == "greedy"]
    assert_frame_equal(learner[ends], policy[ends])


def test_learners_without_failures_have_an_interval():
    never = STUDY.assign(success=1)
    ends = ["low", "high", "new_low", "new_high"]
    row = compare_learners(never, {"ddqn": ["ddqn", "ddqn-2"]}, "tour", ["success"]).iloc[0]
    # two trainings alike: t of 12 pairs, a gain and a loss, t(0.975, 13) = 2.160369
    half = 2.160369 * np.sqrt(2 / 13 / 14)
    assert row[ends].tolist() == pytest.approx([-half, half] * 2, rel=1e-6)
    assert row[["difference", "p", "mission_sd"]].tolist() == [0, 1, 0]


@pytest.mark.parametrize(
    ("learners", "line"),
    [
        ({"ddqn": []}, "learner ddqn: checkpoints none; "),
        ({"ddqn": ["ddqn", "ddqn"]}, "learner ddqn: checkpoints ddqn, ddqn; "),
        ({"ddqn": ["tour", "ddqn"]}, "without the baseline tour"),
        ({"ddqn": ["ddqn", "ddqn-9"]}, "policy: ddqn-9 has no missions"),
    ],
)
def test_checkpoints_are_distinct_and_have_missions(learners, line):
    with pytest.raises(InputError, match=line):
        compare_learners(STUDY, learners, "tour", [METRIC])


def test_checkpoints_meet_the_missions_of_the_baseline():
    with pytest.raises(InputError, match="ddqn-2: lacks 1 of the missions of tour, "):
        compare_learners(STUDY.iloc[:-1], {"ddqn": ["ddqn", "ddqn-2"]}, "tour", [METRIC])
