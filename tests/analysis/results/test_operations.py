"""What extended scenarios measure is stored, loaded, compared and simulated again."""

import math
import shlex
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from dess import simulate_batch
from dess.analysis import run_study, summary
from dess.analysis.execution.evaluation import evaluate as evaluate_alone
from dess.analysis.execution.evaluation import of_results
from dess.analysis.measured import measured_in
from dess.analysis.metric_ranges import metric_in_missions
from dess.analysis.metrics import LEAST, NODE_AGES, NODE_RATIOS
from dess.analysis.results.resimulate import difference_in_words, resimulate, stored_record
from dess.analysis.stats.differences import compare
from dess.analysis.stats.intervals import interval_of
from dess.policies import load
from dess.reports.cli.options import load_space
from tests.analysis.small import SHEET, grid, small_study

MEASURED = {"charging.measured": True, "age.measured": True}


@pytest.fixture(scope="module")
def results(studied):
    """Missions of one and of two pads; with a failure rate of 0 too."""
    design = grid(**{"pads": [1, 2], "failures.uav_rate": [0.0, 0.01]})
    return studied(set=MEASURED, design=design)


def test_stored_values_are_those_of_the_engine(results):
    for point in range(4):
        rows = results.missions.query("policy == 'greedy' and point == @point")
        records = simulate_batch(results.scenario(point), load("greedy"), 7, rows["replication"])
        for name in measured_in(results.missions):
            np.testing.assert_array_equal(rows[name], records.operations[name])
    assert {"age", "queue", "utilisation", "failures"} <= {*measured_in(results.missions)}


def test_a_plain_study_stores_no_column_of_them(studied):
    plain = studied()
    assert measured_in(plain.missions) == []
    paths = (plain.store.folder / "missions").rglob("*.parquet")
    assert {len(pq.read_schema(path)) for path in paths} == {18}


def test_a_resumed_study_and_one_that_takes_over_missions_have_them(tmp_path, results):
    design = grid(**{"pads": [1, 2], "failures.uav_rate": [0.0, 0.01]})
    more = small_study(tmp_path, set=MEASURED, design=design, missions=13, name="more")
    taken = run_study(more, tmp_path / "taken", reuse=[results.store.folder])
    fresh = run_study(more, tmp_path / "fresh")
    assert taken.missions.equals(fresh.missions)


def test_a_mission_is_simulated_again_with_what_it_measured(results):
    mission = resimulate(results, "greedy", 1, 3)
    fields = stored_record(results, "greedy", 1, 3)
    assert fields["age"] == mission.record.age
    assert not any(isinstance(v, float) and math.isnan(v) for v in fields.values())
    assert "age is 1.0 and" in difference_in_words(mission.record, fields | {"age": 1.0})
    without = {name: value for name, value in fields.items() if name != "age"}
    assert "age is None and" in difference_in_words(mission.record, without)


def test_missions_without_a_value_are_left_out_of_means_and_comparisons(results):
    missions = results.missions.copy()
    missions.loc[missions["replication"] == 2, "queue"] = np.nan
    rows = summary(missions, by=["policy", "point"]).set_index(["policy", "point", "metric"])
    mine = missions.query("policy == 'random' and point == 1")["queue"].dropna()
    row = rows.loc["random", 1, "queue"]
    assert row["n"] == len(mine) == 9
    assert tuple(row[["mean", "low", "high"]]) == tuple(interval_of("queue", mine))
    # Nothing can fail there.
    assert ("greedy", 0, "failures") not in rows.index
    table = compare(missions[missions["point"] == 1], "greedy", ["queue"])
    assert table["n"].tolist() == [9]


def test_tables_of_sections_are_fields_of_a_study(tmp_path):
    nested = small_study(tmp_path, set={"charging": {"measured": True}},
                         design=grid(failures={"uav_rate": [0.0, 0.01]}))  # fmt: skip
    assert [space.failures.uav_rate for space in nested.scenarios] == [0.0, 0.01]
    assert all(space.charging.measured for space in nested.scenarios)


def test_the_command_of_a_mission_sets_sections_and_fleets(studied):
    rows = [
        {"fleet": [{"slots_per_cell": 2}, {"quota": 5}], "charging": {"order": "lowest-battery"}}
    ]
    results = studied(set=MEASURED, design={"kind": "table", "rows": rows}, missions=2)
    words = shlex.split(results.command("greedy", 0, 1))
    fields = [words[n + 1] for n, word in enumerate(words) if word == "--set"]
    assert load_space("paper", fields) == results.scenario(0)


# --- the nodes of missions with a data sheet ---


@pytest.fixture(scope="module")
def of_sheet(studied):
    return studied(set=SHEET, design=grid(uavs=[1, 2]), missions=30)


def test_the_worst_node_of_a_setting_is_that_of_the_least_mean(of_sheet):
    for point in (0, 1):
        rows = of_sheet.missions.query("policy == 'random' and point == @point")
        nodes = simulate_batch(
            of_sheet.scenario(point), load("random"), 7, rows["replication"]
        ).nodes
        ratios = nodes["collected"] / (nodes["initial"] + nodes["arrived"])
        np.testing.assert_allclose(np.stack(rows[NODE_RATIOS].to_numpy()), ratios, rtol=1e-12)
        np.testing.assert_array_equal(np.stack(rows[NODE_AGES].to_numpy()), nodes["age"])
        assert rows[LEAST].mean() == pytest.approx(ratios.mean(axis=0).min())
        assert rows[LEAST].mean() > ratios.min(axis=1).mean()  # of another node in each mission
        hours = of_sheet.scenario(point).units.slot / 3600
        assert rows["oldest_h"].mean() == pytest.approx(nodes["age"].mean(axis=0).max() * hours)


def test_tables_and_evaluations_have_the_same_interval_of_the_worst_node(of_sheet):
    means = summary(of_sheet.missions, by=["policy", "point"])
    for metric in (LEAST, "oldest_h"):
        row = means.query("policy == 'random' and point == 1 and metric == @metric").iloc[0]
        alone = evaluate_alone(of_sheet.scenario(1), "random", 30, 7)
        measure = metric_in_missions(of_sheet.missions, metric)
        assert measure.among == 3
        found = alone.moments[metric].interval(measure)
        assert found == pytest.approx((row["mean"], row["low"], row["high"]))
    table = compare(of_sheet.missions, "greedy", [LEAST, "oldest_h"], by=["point"])
    assert len(table) == 4 and table["difference"].notna().all()


def test_a_study_of_one_scenario_is_an_evaluation_with_its_worst_node(tmp_path):
    study = small_study(tmp_path, set=SHEET, policies=["random"], missions=12)
    kept = of_results(run_study(study, tmp_path / "kept"))[0]
    alone = evaluate_alone(study.scenarios[0], "random", 12, 7)
    assert kept.moments[LEAST] == pytest.approx(alone.moments[LEAST])
    assert {*kept.moments} == {*alone.moments}


def test_altered_values_of_nodes_are_found_by_simulating_again(of_sheet):
    record = resimulate(of_sheet, "greedy", 1, 3).record
    fields = stored_record(of_sheet, "greedy", 1, 3)
    assert difference_in_words(record, fields) == ""
    missions = of_sheet.missions.copy()
    ratios = missions[NODE_RATIOS].to_numpy(copy=True)
    ratios[:] = [np.nextafter(values, 0.5) for values in ratios]
    altered = replace(of_sheet, missions=missions.assign(**{NODE_RATIOS: ratios}))
    fields = stored_record(altered, "greedy", 1, 3)
    assert "nodes is" in difference_in_words(record, fields)
