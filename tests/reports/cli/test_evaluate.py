"""``dess evaluate``: its JSON, and its tables."""

import pytest

EVALUATE_KEYS = [
    "policy",
    "missions",
    "seed",
    "engine",
    "uav_slots",
    "seconds",
    "success",
    "collection_ratio",
    "collection_ratio_and_communication",
    "reward",
]


def test_evaluate_prints_the_contract(dess_json):
    arguments = ("--scenario", "small.toml", "--missions", 40, "--seed", 7)
    policies = ("--policy", "greedy", "--policy", "greedy,random")
    rows = dess_json("evaluate", *arguments, *policies)
    assert [row["policy"] for row in rows] == ["greedy", "greedy,random"]
    for row in rows:
        assert list(row) == EVALUATE_KEYS
        assert (row["missions"], row["seed"], row["engine"]) == (40, 7, "batch")
        assert row["uav_slots"] > 0
        assert row["seconds"] > 0
        for metric in EVALUATE_KEYS[6:]:
            assert list(row[metric]) == ["mean", "low", "high"]
            assert row[metric]["low"] <= row[metric]["mean"] <= row[metric]["high"]
    (events,) = dess_json("evaluate", *arguments, "--policy", "greedy", "--engine", "events")
    assert events["engine"] == "events"
    for metric in ["uav_slots", *EVALUATE_KEYS[6:]]:
        assert events[metric] == rows[0][metric]


def test_evaluate_is_the_mean_of_its_missions(dess_json):
    scenario = ("--scenario", "small.toml", "--seed", 7)
    (row,) = dess_json("evaluate", *scenario, "--policy", "random", "--missions", 3)
    missions = [
        dess_json("simulate", *scenario, "--policy", "random", "--replication", r) for r in range(3)
    ]
    for metric in ("success", "collection_ratio", "collection_ratio_and_communication"):
        mean = sum(mission[metric] for mission in missions) / 3
        assert row[metric]["mean"] == pytest.approx(mean)


def test_a_reader_gets_tables(dess):
    code, out, _ = dess("simulate", "--scenario", "small.toml")
    assert code == 0
    assert "collection_ratio_and_communication" in out
    code, out, _ = dess("evaluate", "--scenario", "small.toml", "--policy", "greedy")
    assert code == 0
    assert "collection_ratio_and_communication" in out
    assert "UAV-slots/s" in out
