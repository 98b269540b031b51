"""Two results folders are compared mission by mission; what differs is named exactly."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dess import InputError
from dess.analysis import load_results, load_study, run_study
from dess.analysis.answers.diff import (
    _field_differs,
    at_hand,
    diff_results,
    differing_origins,
    estimate_differences,
    most_changed,
)
from dess.analysis.metrics import PRODUCT
from dess.analysis.results import provenance
from dess.analysis.results.store import Store
from dess.analysis.results.tables import Results
from tests.analysis.small import grid, small_study, write_scenario


def results_of(folder: Path, name: str, **changes) -> Results:
    """The results of the small study."""
    run_study(small_study(folder, **changes), folder / name)
    return load_results(folder / name)


@pytest.fixture
def results(tmp_path):
    """Two policies at two design points."""
    return results_of(tmp_path, "out", design=grid(quota=[20, 60]))


def test_the_effects_are_paired_differences_b_minus_a(results):
    better = results.missions.copy()
    chosen = (better["policy"] == "random") & (better["point"] == 1)
    better.loc[chosen, "collection_ratio"] -= 0.25
    found = diff_results(results, replace(results, missions=better))
    assert {*found.changed["fields"]} == {"collection_ratio"}
    table = estimate_differences(found, ["policy_a", "point_a"])
    first = table.iloc[0]
    assert (first["policy_a"], first["point_a"], first["differ"]) == ("random", 1, 10)
    ratios = table[table["metric"] == "collection_ratio"]
    assert ratios["difference"].tolist() == pytest.approx([-0.25, 0, 0, 0])
    # a mission in which B alone does well is added, and one in which A alone does
    a = results.missions.loc[chosen, "collection_ratio"].mean()
    rare = [max(a - 0.25, 1 - a), -max(a, 1.25 - a)]
    p = stats.ttest_1samp([-0.25] * 10 + rare, 0).pvalue
    assert ratios["p"].tolist() == pytest.approx([p, 1, 1, 1])
    assert ratios["p_adjusted"].tolist() == pytest.approx([min(12 * p, 1), 1, 1, 1])


def test_the_most_changed_missions_come_first(results):
    missions = results.missions.copy()
    for row, change in {3: 0.1, 17: -0.4, 30: 0.2}.items():
        missions.loc[row, "collection_ratio_and_communication"] += change
    missions.loc[8, "reward"] += 1000
    found = diff_results(results, replace(results, missions=missions))
    rows = most_changed(found, 3)
    named = [(r.policy_a, r.point_a, r.replication) for r in rows.itertuples()]
    assert named == [("greedy", 1, 7), ("random", 1, 0), ("greedy", 0, 3)]
    assert found.changed.iloc[3][["fields", "replication"]].tolist() == ["reward", 8]


@pytest.mark.parametrize("field, value", [("slots_waiting", 99), ("reward", -0.0), ("end", "x")])
def test_a_record_of_a_uav_that_differs_is_found(field, value, results):
    uavs = results.uavs.copy()
    row = uavs.index[(uavs["policy"] == "random") & (uavs["replication"] == 6)][-1]
    uavs.loc[row, "reward"] = 0.0
    changed = uavs.copy()
    changed.loc[row, field] = value
    found = diff_results(replace(results, uavs=uavs), replace(results, uavs=changed))
    (mission,) = found.changed.itertuples()
    assert (mission.policy_a, mission.point_a, mission.replication) == ("random", 1, 6)
    assert mission.fields == f"uav {field}"


def test_a_field_that_one_side_has_not_measured_differs():
    pairs = pd.DataFrame({"age_a": [1.0, np.nan, 1.0], "age_b": [np.nan, np.nan, 1.0]})
    assert _field_differs(pairs, "age").tolist() == [True, False, False]


def test_design_points_are_matched_by_their_scenarios(results, tmp_path):
    """Whatever their numbers, and which of their fields the design sets."""
    other = results_of(tmp_path, "other", design=grid(quota=[60, 40]), missions=6)
    found = diff_results(results, other)
    assert {*zip(found.missions["point_a"], found.missions["point_b"], strict=True)} == {(1, 0)}
    assert len(found.missions) == 12
    assert found.changed.empty
    assert not found.identical
    assert [*found.alone.itertuples(index=False, name=None)] == [
        ("A", "communication quota 20", 20),
        ("A", "policy greedy at communication quota 60, replications 6 to 9", 4),
        ("A", "policy random at communication quota 60, replications 6 to 9", 4),
        ("B", "communication quota 40", 12),
    ]


def test_equal_design_points_count_once(results, tmp_path):
    """Those of a Latin hypercube may fall together."""
    design = {"kind": "latin-hypercube", "size": 8, "seed": 1, "ranges": {"quota": [20, 22]}}
    twice = results_of(tmp_path, "twice", design=design)
    found = diff_results(twice, twice)
    assert found.identical
    assert len(found.missions) == 2 * 10 * len({p.quota for p in twice.store.manifest.scenarios})
    assert len(found.missions) < len(twice.missions)


def test_with_other_seeds_all_missions_are_compared_without_pairs(results, tmp_path):
    other = results_of(tmp_path, "other", seed=8, design=grid(quota=[20, 60]))
    found = diff_results(results, other)
    assert not found.identical and found.missions.empty and found.alone.empty
    assert differing_origins(found) == [
        "seeds: 7 and 8, so that missions are compared without pairs"
    ]
    table = estimate_differences(found, ["policy_a", "point_a"])
    row = table[table["metric"] == PRODUCT].iloc[1]
    assert (row["policy_a"], row["point_a"], row["n"]) == ("greedy", 1, 10)
    of = [r.missions.query("policy == 'greedy' and point == 1")[PRODUCT] for r in (other, results)]
    # with a 0 and a 1 added to both, so that 10 of 10 against 10 of 10 has an interval
    expected = stats.ttest_ind(*([*values, 0, 1] for values in of), equal_var=False)
    assert row["p"] == pytest.approx(expected.pvalue)
    assert [row["low"], row["high"]] == pytest.approx([*expected.confidence_interval()])


def test_across_constants_the_points_of_the_same_values_are_compared(results, tmp_path):
    write_scenario(tmp_path, altitude=20.0)
    study = load_study(tmp_path / "trial.toml", design=grid(quota=[20, 60]))
    run_study(study, tmp_path / "high")
    found = diff_results(results, load_results(tmp_path / "high"))
    assert (len(found.missions), found.alone.empty) == (40, True)
    assert differing_origins(found) == ["scenario: altitude 10.0 and 20.0"]


def test_folders_without_a_common_mission_are_refused(results, tmp_path):
    late = results.missions["replication"] >= 5
    early, others = (replace(results, missions=results.missions[rows]) for rows in (~late, late))
    with pytest.raises(
        InputError, match="no mission is in both: only A has policy greedy at communication quota"
    ):
        diff_results(early, others)
    other = results_of(tmp_path, "other", policies=["nearest", "tour"])
    with pytest.raises(InputError, match="only A has policy greedy, only B has policy nearest"):
        diff_results(results, other)


def test_code_libraries_and_accepted_changes_that_differ_are_told(results):
    manifest = results.store.manifest
    accepted = [
        provenance.Acceptance(modules={"dess.model.rules": ("a" * 64, "b" * 64)}, missions=7)
    ]
    changes = {"libraries": manifest.libraries | {"numpy": "1.0"}, "accepted": accepted}
    changes["code"] = manifest.code | {"dess.model.guard.moves": "0" * 64}
    store = Store(results.store.folder, manifest.model_copy(update=changes))
    other = replace(results, store=store)
    assert differing_origins(diff_results(results, other)) == [
        "code: dess.model.guard.moves",
        f"libraries: numpy {manifest.libraries['numpy']} and 1.0",
        "accepted in B: other code of dess.model.rules after 7 missions",
    ]
    assert at_hand(results) == "made by the code, weights and libraries that are here"
    made = "made by other code of dess.model.guard.moves; made with other versions of numpy"
    assert at_hand(other) == made
