"""The answer to a question follows from its missions, and its words say what came out."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.ask import what_if
from analysis.ask.what_if import BASELINE, VARIATION
from analysis.names import METRICS, PRODUCT
from analysis.stats.differences import paired
from analysis.stats.intervals import LEVEL, by_replication
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE
from tests.analysis.small import asked

POLICIES = ["random", "greedy"]
MISSIONS = 12


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return asked(tmp_path_factory.mktemp("what-if"), MISSIONS)


def row(difference, low, high, p=0.01, n=100):
    """A row of an answer."""
    return pd.Series({"difference": difference, "low": low, "high": high, "p": p, "n": n})


def test_measures_are_those_of_the_uavs(results):
    missions = what_if.missions_of(results)
    assert len(missions) == len(results.missions) == 2 * 2 * MISSIONS
    for mission in missions.itertuples():
        uavs = results.uavs.query(
            "policy == @mission.policy and point == @mission.point "
            "and replication == @mission.replication"
        )
        assert mission.depleted == 100 * list(uavs["end"]).count("battery")
        assert mission.waiting_per_uav == pytest.approx(uavs["slots_waiting"].mean())
        assert mission.charging_per_uav == pytest.approx(uavs["slots_charging"].mean())
        assert mission.collected_per_uav == pytest.approx(uavs["collected"].mean())
    assert missions["waiting_per_uav"].max() > 0 and missions["depleted"].max() > 0


def test_answers_are_paired_comparisons(results):
    answers = what_if.answers(results)
    missions = what_if.missions_of(results)
    assert len(answers) == len(POLICIES) * (len(METRICS) + len(what_if.MEASURES))
    for answer in answers.itertuples():
        rows = missions[missions["policy"] == answer.policy]
        sides = by_replication(rows, answer.metric, "point")
        assert answer.before == pytest.approx(sides[BASELINE].mean())
        assert answer.after == pytest.approx(sides[VARIATION].mean())
        change = sides[VARIATION] - sides[BASELINE]
        assert (answer.difference, answer.n) == (pytest.approx(change.mean()), MISSIONS)
        pair = paired(*(sides[n].to_numpy() for n in (VARIATION, BASELINE)), metric=answer.metric)
        assert (answer.low, answer.high) == pytest.approx(pair[1:3])


def test_means_are_of_the_papers_metrics(results):
    table = what_if.means(results).set_index(["policy", "point", "metric"])
    assert len(table) == len(POLICIES) * 2 * len(METRICS)
    for answer in what_if.answers(results).itertuples():
        if answer.metric in METRICS:
            key = (answer.policy, VARIATION, answer.metric)
            assert table.loc[key, "mean"] == pytest.approx(answer.after)


def test_measures_of_sections_are_compared_and_nothing_fails_where_nothing_can(tmp_path):
    changes = {"age.reward": -1.0, "failures.uav_rate": 0.2}
    results = asked(tmp_path, 6, settings=changes, policies=["greedy"])
    assert {"age", "failures"} <= {*what_if.measured(results)}
    answers = what_if.answers(results).set_index("metric")
    sides = results.missions.pivot(index="replication", columns="point", values="age")
    change = (sides[VARIATION] - sides[BASELINE]).mean()
    assert answers.loc["age", "difference"] == pytest.approx(change)
    assert (answers.loc["failures", "before"], answers.loc["failures", "n"]) == (0, 6)
    failed = results.missions.query("point == @VARIATION")["failures"].mean()
    assert answers.loc["failures", "difference"] == pytest.approx(failed) and failed > 0
    assert what_if.means(results).query("metric == 'age'")["mean"].tolist() == (
        pytest.approx(answers.loc["age", ["before", "after"]].tolist())
    )


def test_what_one_side_measures_has_no_difference(tmp_path):
    results = asked(tmp_path, 4, settings={"age.measured": True}, policies=["greedy"])
    table = what_if.answers(results)
    answers = table.set_index("metric")
    assert np.isnan(answers.loc["age", ["before", "difference"]].astype(float)).all()
    assert (answers.loc["age", "n"], answers.loc["success", "n"]) == (0, 4)
    lines = what_if.answer_table(table, "greedy").set_index("Mean per mission")
    line = lines.loc["Age of information [mission slots]"]
    mean = results.missions["age"].mean()
    assert line.tolist() == ["–", f"{mean:.2f}", ""]


@pytest.mark.parametrize(
    ("answer", "side"),
    [
        (row(0.2, 0.1, 0.3), ABOVE),
        (row(-0.2, -0.3, -0.1), BELOW),
        (row(0.1, -0.1, 0.3), INCONCLUSIVE),
        (row(0.0, 0.0, 0.0, p=1.0), INCONCLUSIVE),
        (row(0.5, 0.5, 0.5, p=0.5, n=2), INCONCLUSIVE),  # two equal differences prove nothing
        (row(0.5, 0.5, 0.5, p=0.002, n=10), ABOVE),
    ],
)
def test_the_whole_interval_decides(answer, side):
    assert what_if.verdict(answer) == side


def test_so_many_missions_show_the_difference_that_was_seen():
    """So many normal differences of that mean and spread are significant with that power."""
    n, gap, spread = 400, 0.05, 0.8
    half = stats.t.isf((1 - LEVEL) / 2, n - 1) * spread / np.sqrt(n)
    needed = what_if.missions_needed(row(gap, gap - half, gap + half, n=n))
    edge = stats.t.isf((1 - LEVEL) / 2, needed - 1)
    power = stats.nct.sf(edge, needed - 1, gap / spread * np.sqrt(needed))
    assert power == pytest.approx(what_if.POWER, abs=0.02)
    assert what_if.missions_needed(row(-gap, -gap - half, -gap + half, n=n)) == needed
    for nothing in (row(0.0, -half, half), row(0.0, 0.0, 0.0), row(gap, gap, gap)):
        assert what_if.missions_needed(nothing) == np.inf


def with_missions(results, before, after, ratios):
    """The results with other missions of a single policy."""
    columns = {"replication": range(len(before)), "policy": "greedy"}
    sides = [
        pd.DataFrame({**columns, "point": p, PRODUCT: values, "collection_ratio": ratios})
        for p, values in ((BASELINE, before), (VARIATION, after))
    ]
    return replace(results, missions=pd.concat(sides, ignore_index=True))


def test_the_typical_mission_has_the_median_difference_and_the_worst_the_least_left(results):
    before, after = [0.5, 0.5, 0.9, 0.1, 0.9], [0.6, 0.4, 0.0, 0.3, 0.0]
    made = with_missions(results, before, after, [0.6, 0.4, 0.8, 0.3, 0.7])
    # Differences: +0.1, -0.1, -0.9, +0.2, -0.9.
    assert what_if.typical(made, "greedy") == 1
    assert what_if.worst(made, "greedy") == 4
    assert what_if.differences(made, "greedy").tolist() == pytest.approx(
        [0.1, -0.1, -0.9, 0.2, -0.9]
    )
    even = with_missions(results, [0.0] * 4, [0.4, 0.1, 0.2, 0.2], [0.5] * 4)
    assert what_if.typical(even, "greedy") == 2  # the lower middle, of those alike the first
    assert what_if.worst(even, "greedy") == 1


def test_the_best_policy_of_each_side_is_found(results):
    table = what_if.means(results)
    for point in (BASELINE, VARIATION):
        side = table[(table["point"] == point) & (table["metric"] == PRODUCT)]
        best = side.loc[side["mean"].idxmax(), "policy"]
        assert what_if.best_policy(results, point) == best


def answer_of(metric, difference, low, high, **more):
    """A table of answers with a single row."""
    values = {"policy": "greedy", "metric": metric, "before": 0.9, "after": 0.9 + difference}
    values |= {"difference": difference, "low": low, "high": high, "p": 0.2, "n": 100}
    return pd.DataFrame([values | more])


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ((0.05, 0.04, 0.06), "is **higher** in the variation, by +5.0 [+4.0, +6.0] points"),
        ((-0.05, -0.06, -0.04), "is **lower** in the variation, by −5.0 [−6.0, −4.0] points"),
        ((0.0, -0.01, 0.01), "is **inconclusive**, by 0.0 [−1.0, +1.0] points"),
    ],
)
def test_a_conclusion_names_the_side_of_the_whole_interval(ends, words):
    text = what_if.conclusions(answer_of(PRODUCT, *ends))
    assert text.startswith(f"- **greedy**: product {words}: from 90.0 %")


def test_an_inconclusive_answer_says_how_many_missions_it_takes():
    few = what_if.conclusions(answer_of(PRODUCT, 0.01, -0.01, 0.03))
    assert "about 820 missions (instead of 100) show it with a probability of 80 %" in few
    none = what_if.conclusions(answer_of(PRODUCT, 0.0, 0.0, 0.0))
    assert "These missions do not tell how many would show a difference." in none


@pytest.mark.parametrize(
    ("table", "line"),
    [
        (
            answer_of("success", 0.02, 0.01, 0.03),
            ["Success", "90.0 %", "92.0 %", "▲ +2.0 [+1.0, +3.0] points"],
        ),
        (
            answer_of(PRODUCT, -0.002, -0.0045, 0.0005),
            ["Their product", "90.0 %", "89.8 %", "≈ −0.20 [−0.45, +0.05] points"],
        ),
        (
            answer_of("slots", -3.0, -3.5, -2.5, before=120.0, after=117.0),
            ["Mission slots", "120.00", "117.00", "▼ −3.00 [−3.50, −2.50]"],
        ),
    ],
)
def test_a_line_has_both_sides_and_the_marked_difference(table, line):
    assert what_if.answer_table(table, "greedy").to_numpy().tolist() == [line]


def test_pairs_are_worth_more_missions_the_less_variance_is_left():
    table = answer_of("success", 0.0, 0.0, 0.0, correlation=0.75, variance_reduction=0.75)
    assert what_if.pairing(table).to_numpy().tolist() == [
        ["greedy", "Success", "0.75", "25.0 %", "50.0 %", "400"]
    ]
    harmful = answer_of("success", 0.0, 0.0, 0.0, correlation=-0.1, variance_reduction=-0.25)
    line = what_if.pairing(harmful).iloc[0].tolist()
    assert line[2:] == ["−0.10", "125.0 %", "none", "80"]


def test_the_outcome_of_a_mission_names_the_uavs_that_failed(results):
    for mission in results.missions.query("point == @VARIATION").itertuples():
        ends = results.uavs.query(
            "policy == @mission.policy and point == @VARIATION "
            "and replication == @mission.replication"
        )["end"].tolist()
        text = what_if.outcome(results, mission.policy, VARIATION, mission.replication)
        assert text.startswith("Variation (uavs 6, pads 1): collection ratio ")
        assert ("all quotas filled" in text) == bool(mission.success)
        depleted = f"{ends.count('battery')} of 6 UAVs deplete their battery"
        assert (depleted in text) == ("battery" in ends)


def test_shares_of_missions_with_more_and_less_are_counted():
    text = what_if.winners({"greedy": pd.Series([0.1, 0.0, -0.1, 0.4])})
    assert text == "greedy is better in 50.0 % and worse in 25.0 %"
