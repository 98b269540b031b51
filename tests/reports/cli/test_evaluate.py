"""``dess evaluate``: its JSON, its tables, and the missions that it keeps."""

import pytest

from dess.analysis import compare, load_results
from dess.analysis.metrics import METRICS


def test_a_reader_gets_tables(dess):
    code, out, _ = dess("evaluate", "--scenario", "small.toml", "--policy", "greedy")
    assert code == 0
    assert "collection_ratio_and_communication" in out
    assert "UAV-slots/s" in out


def test_a_trained_policy_says_when_it_acts_outside_of_its_training(dess):
    assert "note" not in dess("evaluate", "--policy", "ddqn", "--missions", 1)[2]
    beyond = ("--set", "quota=600", "--set", "uavs=6", "--policy", "ddqn,greedy")
    for command in (("evaluate", "--missions", 1), ("simulate",)):
        code, _, err = dess(*command, *beyond)
        words = "quota 600 (trained on 440), uavs 6 (trained on 1 to 3)"
        assert code == 0 and f"note: ddqn acts outside of its training: {words}\n" in err


def test_a_former_name_of_a_policy_is_taken_and_told(dess):
    command = ("evaluate", "--scenario", "small.toml", "--missions", 1, "--policy", "greedy")
    code, _, err = dess(*command, "--policy", "any")
    told = "dess: the policy any is now generalist"
    assert code == 0 and err.splitlines().count(told) == 1
    assert told not in dess(*command, "--policy", "generalist")[2]


def test_a_policy_that_cannot_act_is_refused_without_a_note(dess):
    beyond = ("--scenario", "bay", "--set", "quota=600", "--policy", "ddqn")
    for command in (("evaluate", "--missions", 1), ("simulate",)):
        code, _, err = dess(*command, *beyond)
        assert code == 2
        assert "note" not in err
        assert "dess: error:" in err.splitlines()[-1]


def test_missions_can_be_kept_as_results(dess, dess_json, tmp_path):
    """With the means of an evaluation that keeps none; with more missions, they are added."""
    asked = ("--policy", "greedy", "--policy", "greedy,random", "--set", "failures.uav_rate=0.001")
    asked += ("--missions", 30, "--seed", 3)
    kept = dess_json("evaluate", *asked, "--out", "my results")
    others = dess_json("evaluate", *asked)
    assert [row.pop("seconds") for row in kept] == [None, None]
    assert [row.pop("seconds") > 0 for row in others] == [True, True]
    assert kept == others
    code, out, err = dess("evaluate", *asked, "--missions", 40, "--out", "my results")
    assert code == 0 and "80 missions, 60 of them present" in err
    assert out.splitlines()[-1] == "more: dess study show 'my results'"
    results = load_results(tmp_path / "my results")
    assert len(results.missions) == 80 and results.store.manifest.study.name == "my-results"
    assert dess("study", "show", "my results")[0] == 0
    assert dess("evaluate", "--policy", "greedy", "--seed", 4, "--out", "my results")[0] == 2


def test_policies_are_compared_mission_by_mission(dess, dess_json, tmp_path):
    """With the first one, as the missions of the study are that keeps them."""
    asked = ("--scenario", "small.toml", "--policy", "random", "--policy", "greedy")
    asked += ("--set", "uavs=2")
    asked += ("--missions", 40, "--seed", 3)
    first, second = dess_json("evaluate", *asked, "--out", "kept")
    assert "against" not in first and second["against"] == "random"
    missions = load_results(tmp_path / "kept").missions
    rows = compare(missions, "random", [*METRICS]).set_index("metric")
    for metric, found in second["differences"].items():
        assert found == pytest.approx(rows.loc[metric, [*found]].to_dict())
    ratios = missions.pivot(index="replication", columns="policy", values="collection_ratio")
    difference = (ratios["greedy"] - ratios["random"]).mean()
    assert second["differences"]["collection_ratio"]["difference"] == pytest.approx(difference)
    assert dess_json("evaluate", *asked)[1]["differences"] == second["differences"]
    assert "against random [points]" in dess("evaluate", *asked)[1]
    assert "against" not in dess("evaluate", *asked[:4], "--missions", 2)[1]
