"""Main effects compare values of a parameter on the same missions."""

import numpy as np
import pandas as pd
import pytest

from analysis import run_study
from analysis.names import PRODUCT
from analysis.questions import main_effects
from analysis.questions.main_effects import FALLS, IRREGULAR, LEVELS, PEAK, RISES, VALLEY
from analysis.stats.correction import adjust
from analysis.stats.intervals import mean_interval
from analysis.stats.paired import paired
from dess import InputError
from tests.analysis.small import grid, small_study


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    values = {"uavs": [1, 2], "initial_data": [[5, 7.5], 10, [2, 20]]}
    design = {"kind": "one-at-a-time", "values": values}
    return run_study(small_study(folder, design=design, missions=20), folder / "out")


@pytest.fixture(scope="module")
def table(results):
    return main_effects.effects(results)


def pairs_of(steps, sure=True, half=0.001, widened=2):
    """All pairs of values with these steps between neighbours, all of them sure, or none."""
    level = np.concatenate([[0.0], np.cumsum(steps)])
    rows = [
        (i, j, level[j] - level[i]) for i in range(len(level)) for j in range(i + 1, len(level))
    ]
    table = pd.DataFrame(rows, columns=["first", "second", "difference"])
    p = np.where(sure & (table["difference"].abs() > half), 0.001, 1.0)
    gap = table["difference"]
    wide = widened * half
    ends = {"low": gap - half, "high": gap + half, "wide_low": gap - wide, "wide_high": gap + wide}
    return table.assign(**ends, p_adjusted=p)


def test_effects_are_the_means_by_value(results, table):
    named = table.drop_duplicates(["field", "position"])[["field", "position", "value"]]
    assert named.to_numpy().tolist() == [
        ["uavs", 0, "1"],
        ["uavs", 1, "2"],
        ["initial_data", 0, "5–7.5"],
        ["initial_data", 1, "10"],
        ["initial_data", 2, "2–20"],
    ]
    row = table.query("field == 'initial_data' and position == 2 and policy == 'random'")
    missions = results.missions.query("point == 4 and policy == 'random'")
    ends = row.set_index("metric").loc["reward", ["mean", "low", "high"]]
    assert tuple(ends) == mean_interval(missions["reward"])


def test_a_design_of_several_fields_is_refused(tmp_path):
    study = small_study(tmp_path, design=grid(uavs=[1, 2], quota=[20, 30]), missions=2)
    with pytest.raises(InputError, match="point 0: sets uavs, quota; allowed: one field"):
        main_effects.effects(run_study(study, tmp_path / "out"))


def test_changes_are_paired_by_replication(results, table):
    pairs = main_effects.changes(results, table, "greedy", "initial_data", "collection_ratio")
    assert pairs[["first", "second"]].to_numpy().tolist() == [[0, 1], [0, 2], [1, 2]]
    missions = results.missions.query("policy == 'greedy'").set_index(["point", "replication"])
    gaps = missions.loc[4, "collection_ratio"] - missions.loc[3, "collection_ratio"]
    ends = mean_interval(gaps)
    assert pairs.loc[2, ["difference", "low", "high"]].tolist() == pytest.approx(list(ends))
    assert pairs["p_adjusted"].tolist() == adjust(pairs["p"].to_numpy(), "holm").tolist()
    assert set(pairs["n"]) == {20}


def test_intervals_that_hold_at_once_are_wider(results, table):
    """By Bonferroni: three pairs, each at 1 - 0.05 / 3."""
    pairs = main_effects.changes(results, table, "greedy", "initial_data", "collection_ratio")
    missions = results.missions.query("policy == 'greedy'").set_index(["point", "replication"])
    gaps = missions.loc[4, "collection_ratio"] - missions.loc[3, "collection_ratio"]
    _, low, high = mean_interval(gaps, 1 - 0.05 / 3)
    assert pairs.loc[2, ["wide_low", "wide_high"]].tolist() == pytest.approx([low, high])
    assert (pairs["wide_low"] < pairs["low"]).all() and (pairs["high"] < pairs["wide_high"]).all()


def test_successes_are_compared_as_shares(results, table):
    """So that equal outcomes still have an interval."""
    pairs = main_effects.changes(results, table, "greedy", "uavs", "success")
    missions = results.missions.query("policy == 'greedy'").set_index(["point", "replication"])
    of = (missions.loc[point, "success"].to_numpy(float) for point in (1, 0))
    expected = paired(*of, metric="success")
    assert pairs.loc[0, ["low", "high"]].tolist() == pytest.approx([expected.low, expected.high])
    assert expected.low < pairs.loc[0, "difference"] < expected.high


@pytest.mark.parametrize(
    ("steps", "words", "peaks"),
    [
        ([0, 0, 0], LEVELS, (0, 1, 2, 3)),
        ([1, 0, 1], RISES, (3,)),
        ([1, 0, 0], RISES, (1, 2, 3)),
        ([0, -1, -1], FALLS, (0, 1)),
        ([1, 1, -1], PEAK, (2,)),
        ([1, 0, -1], PEAK, (1, 2)),
        ([-1, -1, 1], VALLEY, ()),
        ([1, -1, 1], IRREGULAR, ()),
    ],
)
def test_shapes(steps, words, peaks):
    assert main_effects.shape(pairs_of(steps)) == main_effects.Shape(words, peaks)
    assert main_effects.shape(pairs_of(steps, sure=False)).words == LEVELS


def test_many_small_steps_make_a_rise():
    """No two neighbours differ, but the ends do."""
    pairs = pairs_of([0.4, 0.4, 0.4], half=1.0)
    assert pairs.loc[pairs["second"] - pairs["first"] == 1, "p_adjusted"].eq(1).all()
    assert main_effects.shape(pairs).words == RISES


def effects_of(means, field="uavs", policy="mine"):
    """Effects with these means of collection ratio and communication at the values 1, 2, ..."""
    rows = [(field, str(n + 1), n, policy, PRODUCT, mean, 300) for n, mean in enumerate(means)]
    columns = ["field", "value", "position", "policy", "metric", "mean", "n"]
    return pd.DataFrame(rows, columns=columns)


def test_the_table_has_a_row_per_parameter_and_policy():
    policies = {"mine": [0.1, 0.2, 0.1], "other": [0.1, 0.3, 0.4]}
    effects = pd.concat(effects_of(means, policy=policy) for policy, means in policies.items())
    changes = {"uavs": {policy: pairs_of(np.diff(means)) for policy, means in policies.items()}}
    ratios = {"uavs": {"mine": pairs_of([0.2, 0.1]), "other": pairs_of([0.1, 0.1])}}
    table = main_effects.listed(effects, changes, ratios).set_index("Policy")
    assert table.loc["other"].tolist() == [
        "Number of UAVs",
        RISES,
        "10.0 % at 1",
        "40.0 % at 3",
        "+30.0 [+29.9, +30.1]",
        "+20.0 [+19.9, +20.1]",
        "",
    ]
    assert table.loc["mine", "Highest at"] == "2"
    assert table.loc["mine", "Last − first"] == "0.0 [−0.1, +0.1]"


@pytest.mark.parametrize(("steps", "top"), [((0.2, -0.1), "2"), ((0.2, 0, -0.1), "2 or 3")])
def test_the_table_says_where_a_peak_may_be(steps, top):
    means = np.cumsum([0.1, *steps])
    changes = {"uavs": {"mine": pairs_of([*steps])}}
    table = main_effects.listed(effects_of(means), changes, changes)
    assert table.loc[0, ["Along the values", "Highest at"]].tolist() == [PEAK, top]


def test_a_parameter_with_one_value_has_no_changes(tmp_path):
    values = {"uavs": [1, 2], "quota": [20]}
    study = small_study(tmp_path, design={"kind": "one-at-a-time", "values": values}, missions=2)
    results = run_study(study, tmp_path / "out")
    changes = main_effects.changes_by_field(results, main_effects.effects(results))
    assert {field: [*pairs] for field, pairs in changes.items()} == {"uavs": ["greedy", "random"]}


def test_the_best_policies_are_shown_unless_others_are_asked_for(results):
    means = results.missions.groupby("policy")[PRODUCT].mean()
    assert main_effects.leading_policies(results) == [means.idxmax()]
    named = main_effects.leading_policies(results, "learned", means.idxmin())
    assert named == ["learned", means.idxmin()]
