"""Settings are ranked, averaged and compared on the replications that they share."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from dess.analysis import compare, load_study, run_study
from dess.analysis.answers import decided
from dess.analysis.answers.settings import figures
from dess.analysis.answers.settings.baseline import compare_with_baseline
from dess.analysis.answers.settings.effects import (
    BINS,
    average_over_others,
    fields_by_influence,
    main_effects,
)
from dess.analysis.answers.settings.points import (
    points_in_words,
    setting_in_words,
    values_of_points,
    varied_values,
)
from dess.analysis.answers.settings.ranking import (
    best_setting_facts,
    best_setting_headline,
    rank_settings,
)
from dess.analysis.metrics import METRICS, PRODUCT
from dess.analysis.stats.alternatives import BEST, SEEN_BEST, TIED, may_be_best
from dess.analysis.stats.verdict import NOT_RULED_OUT, SEEN_WORSE, WORSE
from dess.reports import cli
from tests.analysis.small import found_of, grid


@pytest.fixture(scope="module")
def results(studied):
    """A grid of two fields, one of ranges, and a third that is the same everywhere."""
    values = {"uavs": [3, 1, 2], "initial_data": [[5, 7.5], [10, 20]], "quota": [60]}
    return studied(design=grid(**values), missions=12)


def planted(results, metric):
    """The results with a metric of our own: ``metric`` of (policy, point, replication) arrays."""
    missions = results.missions
    number = missions["policy"].map({name: k for k, name in enumerate(results.policies)})
    values = metric(number.to_numpy(), missions["point"].to_numpy(), missions["replication"])
    return replace(results, missions=missions.assign(**{PRODUCT: np.asarray(values, float)}))


# --- fields ---


def test_long_and_unset_values_are_short_texts(studied):
    rows = [
        {"pads": 2},
        {"zone": [0, 0, 2, 2]},
        {"nodes": [[1, 1], [2, 2]]},
        {"nodes": [[1, 1], [3, 2]], "forbid_swaps": True},
        {"nodes": [[1, 1], [2, 2]], "initial_data": [4, 4]},
    ]
    table = values_of_points(studied(design={"kind": "table", "rows": rows}, missions=2))
    # Without a number, as many as the zone has.
    assert table["pads"].tolist() == [2, 4, 6, 6, 6]
    assert table["zone"].tolist() == [
        "3 x 2 at (5, 0)",
        "2 x 2 at (0, 0)",
        *["3 x 2 at (5, 0)"] * 3,
    ]
    maps = ["3 cells (map 1)", "2 cells (map 2)", "2 cells (map 3)"]
    assert table["nodes"].tolist() == [maps[0], *maps, maps[1]]
    assert table["forbid_swaps"].tolist() == ["no", "no", "no", "yes", "no"]
    assert table["initial_data"].tolist() == [*["5–20"] * 4, "4"]


# --- ranks ---


def test_a_planted_best_is_found_and_those_that_equal_it_are_tied(results):
    """Policy 1 at point 2 leads, its twin at point 4 equals it, all else is behind by 0.5."""

    def metric(policy, point, replication):
        luck = 0.4 * np.random.default_rng(0).random(100)[replication]
        noise = np.random.default_rng(1).normal(size=len(point)) * 1e-3
        lead = (policy == 1) & np.isin(point, (2, 4))
        return luck + 0.5 * lead + noise * ~lead

    table = rank_settings(planted(results, metric))
    tied = table[table["tied"]]
    assert {*zip(tied["policy"], tied["point"], strict=True)} == {("random", 2), ("random", 4)}
    assert table.head(2)["tied"].all()
    own = rank_settings(planted(results, metric), policy="greedy")
    assert {*own["policy"]} == {"greedy"} and own["tied"].iloc[0]


def test_a_setting_of_few_missions_is_not_tied_when_its_interval_is_below(results):
    """On the 12 common missions nothing is known; over all 300 the first is far above."""
    parts = [
        results.missions.assign(replication=n + results.missions["replication"])
        for n in range(0, 300, 12)
    ]
    many = pd.concat(parts, ignore_index=True)

    def metric(policy, point, replication):
        odd = replication % 2
        first = np.where(replication < 12, 0.8 + 0.2 * odd, 0.98 + 0.01 * odd)
        return np.select([(policy == 1) & (point == 2), policy == 1], [first, 0.3], 1 - 0.3 * odd)

    found = planted(replace(results, missions=many), metric)
    few = (found.missions["policy"] == "greedy") & (found.missions["replication"] >= 12)
    table = rank_settings(replace(found, missions=found.missions[~few]))
    assert may_be_best(np.array([[0.8, 1.0], [1.0, 0.7]] * 6)).all()
    assert table["n"].tolist()[:2] == [300, 12] and table["tied"].tolist() == [True] + [False] * 11


def test_where_all_settings_may_be_as_good_none_is_called_worse(results):
    table = rank_settings(results)
    all_tied = table.assign(tied=True, standing=TIED)
    found = found_of(best_setting_facts(results, all_tied, PRODUCT))
    assert found["may be as good"] == "11 of 11 others" and "worse" not in str([*found])
    standing = np.where(table["rank"] <= 3, TIED, WORSE)
    three = table.assign(tied=table["rank"] <= 3, standing=standing)
    found = found_of(best_setting_facts(results, three, PRODUCT))
    assert found["may be as good"].startswith("2 of 11 others: ")
    assert found["significantly worse"] == "9 of 11 others"
    seen = three.assign(standing=three["standing"].where(three["rank"] != 4, SEEN_WORSE))
    found = found_of(best_setting_facts(results, seen, PRODUCT))
    assert found[f"worse in what was seen, where {NOT_RULED_OUT}"] == "1 of 11 others"
    assert found["significantly worse"] == "8 of 11 others"


def test_cells_that_differ_by_many_standard_errors_are_not_said_to_be_as_good(results):
    """21 standard errors apart, and no failure among the missions."""
    missions = results.missions
    few = missions[(missions["policy"] == "greedy") & (missions["replication"] < 12)]

    def metric(policy, point, replication):
        noise = 0.01 * np.sqrt(11) * np.resize([-1, 1], 12)[replication] * (point > 0)
        return 0.8 - 0.21 * (point > 0) + noise

    made = planted(replace(results, missions=few), metric)
    table = rank_settings(made)
    gaps = made.missions.pivot(index="replication", columns="point", values=PRODUCT)
    gaps = gaps[0] - gaps[1]
    assert gaps.mean() / gaps.sem() == pytest.approx(21)
    assert table["tied"].tolist() == [True] + [False] * 5
    assert table["standing"].tolist() == [SEEN_BEST] + [SEEN_WORSE] * 5


def test_of_costs_the_lowest_is_the_best(results):
    missions = results.missions
    priced = replace(results, missions=missions.assign(cost=100.0 + missions["point"]))
    table = rank_settings(priced, "cost")
    assert table["cost"].is_monotonic_increasing
    assert table[table["tied"]]["point"].tolist() == [0, 0]
    assert average_over_others(priced, ["uavs"], "cost").query("tied")["uavs"].tolist() == [3, 3]


# --- averages ---


def test_the_partial_dependence_of_an_additive_metric_is_exact(results):
    points = values_of_points(results)
    uavs, data = points["uavs"].to_numpy(), (points["initial_data"] == "10–20").to_numpy()

    def metric(policy, point, replication):
        return 0.1 * uavs[point] ** 2 + 0.03 * data[point] + 0.001 * np.asarray(replication)

    effects = main_effects(planted(results, metric), policy="greedy")
    of_uavs, of_data = (part for _, part in effects.groupby("field", sort=False))
    common = 0.001 * np.arange(12).mean()
    expected = 0.1 * np.array([1, 4, 9]) + 0.015 + common
    assert of_uavs.sort_values("position")["mean"].tolist() == pytest.approx(expected)
    assert of_uavs["value"].tolist() == ["1", "2", "3"] and {*of_uavs["points"]} == {2}
    expected = 0.1 * np.mean([1, 4, 9]) + np.array([0, 0.03]) + common
    assert of_data["mean"].tolist() == pytest.approx(expected)
    assert fields_by_influence(effects) == ["uavs", "initial_data"]


def test_cells_count_the_replications_that_all_their_points_have(results):
    missions = results.missions
    shorter = missions[(missions["point"] != 1) | (missions["replication"] < 5)]
    table = average_over_others(replace(results, missions=shorter), ["uavs"])
    assert table[table["uavs"] == 3]["n"].tolist() == [5, 5]
    assert table[table["uavs"] == 1]["n"].tolist() == [12, 12]


def test_many_numbers_are_cut_into_bins(studied):
    design = {"kind": "latin-hypercube", "size": 20, "ranges": {"arrival_rate": [0.0, 0.1]}}
    results = studied(design=design, missions=3)
    effects = main_effects(results, policy="greedy")
    assert effects["position"].tolist() == [*range(BINS)]
    assert effects["points"].tolist() == [4] * BINS
    values = np.sort(values_of_points(results)["arrival_rate"])
    assert effects["value"].iloc[0] == f"{values[0]:.3g}–{values[3]:.3g}"
    assert {*effects["n"]} == {3}


def test_of_a_saltelli_design_the_independent_missions_count(studied):
    design = {"kind": "saltelli", "base": 8, "ranges": {"uavs": [1, 3], "charge_start": [10, 15]}}
    results = studied(design=design, missions=1)
    effects = main_effects(results, policy="greedy")
    first_and_last = results.missions.query("policy == 'greedy' and point % 5 in (0, 4)")
    for row in effects[effects["field"] == "uavs"].itertuples():
        values = first_and_last[first_and_last["uavs"] == int(row.value)][PRODUCT]
        assert (row.mean, row.n) == (pytest.approx(values.mean()), len(values))


# --- a baseline ---


def test_differences_to_a_baseline_are_those_of_compare(results):
    table = compare_with_baseline(results, 2)
    assert len(table) == len(METRICS) * 2 * 5
    assert 2 not in {*table["point"]}
    for policy in results.policies:
        missions = results.missions[results.missions["policy"] == policy]
        expected = compare(missions, 2, [*METRICS], of="point").set_index(["metric", "point"])
        for row in table[table["policy"] == policy].itertuples():
            theirs = expected.loc[(row.metric, row.point), ["difference", "p"]]
            assert [row.difference, row.p] == pytest.approx(theirs.tolist())
    assert (table["p_adjusted"] >= table["p"]).all()


def test_varied_fields_have_their_values_in_order(results, studied):
    assert varied_values(results) == {"uavs": [1, 2, 3], "initial_data": ["5–7.5", "10–20"]}
    assert values_of_points(results).iloc[1].tolist() == [3, "10–20"]
    assert points_in_words(results)[1] == "3 UAVs, initial data per node 10–20"
    single = studied()
    assert varied_values(single) == {} and main_effects(single).empty
    assert points_in_words(single) == [""]
    assert setting_in_words(single, "greedy", 0) == "greedy"


SELECTED = """
scenario = "paper"
policies = ["greedy"]
seed = 7
[set]
uavs = 3
[design]
kind = "grid"
values.charge_start = [10, 30, 50]
values.charge_complete = [60, 100]
[selection]
procedure = "kn"
metric = "reward"
first = 20
indifference = 10
budget = 5000
check = 20
"""


def test_a_study_with_a_selection_has_one_best_setting_its_own(tmp_path, capsys):
    """Settings that are ruled out after 20 missions have higher means than the selected one."""
    (tmp_path / "select.toml").write_text(SELECTED)
    results = run_study(load_study(tmp_path / "select.toml"), tmp_path / "out")
    best = results.choice("greedy").best
    means = results.missions.groupby("point")["reward"].mean()
    assert means.idxmax() != best
    table = rank_settings(results, "reward")
    assert (table["point"].iloc[0], table["tied"].sum()) == (best, 1)
    assert {*table["standing"][1:]} == {WORSE}
    counts = results.missions.groupby("point").size()
    assert counts.nunique() > 1
    wide = results.missions.pivot(index="replication", columns="point", values="reward")
    leads = wide.sub(wide[best], axis=0).mean()  # on common replications
    assert leads[table["point"][1:]].is_monotonic_decreasing
    start = results.store.manifest.points[best].values["charge_start"]
    assert f"C_S {start}" in best_setting_headline(results, table, "reward")
    found = found_of(best_setting_facts(results, table, "reward"))
    assert found["ruled out or significantly worse"] == "5 of 5 others"
    assert (
        average_over_others(results, ["charge_start", "charge_complete"], "reward").loc[
            best, "standing"
        ]
        == BEST
    )
    drawing = figures.draw_heat_map(results, "charge_complete", "charge_start", "reward")
    assert drawing.caption.startswith("The highest mean of what the study selects is")
    assert f"C_S {start}. " in drawing.caption
    selected = decided.selection_table(results)
    assert selected.cells["Reward"].iloc[0].startswith(f"{means[best]:,.0f} [")
    assert selected.caption.endswith("by reward")
    assert cli.main(["study", "show", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert printed.count("Reward") >= 3 and f"{means[best]:,.0f} [" in printed
