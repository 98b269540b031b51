"""The summary of a study: tables of means, comparisons, selections and the worst missions."""

import json
import shlex
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from analysis import compare, run_study
from analysis.names import PRODUCT
from analysis.questions import summary
from policies import load
from policies.ddqn.trained import save_policy
from policies.ddqn.training import Training
from reports import cli
from tests.analysis.small import grid, small_study, write_scenario
from tests.policies.ddqn.tiny import CPU, PHASES, tiny


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    study = small_study(folder, design=grid(uavs=[1, 2], quota=[20, 60]), missions=20)
    return run_study(study, folder / "out")


def stub(**policies):
    """Results of one design point: the products of every policy in the same replications."""
    tables = [
        pd.DataFrame(
            {"policy": name, "point": 0, "replication": range(len(values)), PRODUCT: values}
        )
        for name, values in policies.items()
    ]
    results = SimpleNamespace(missions=pd.concat(tables, ignore_index=True))
    rows = [(name, 0, PRODUCT, np.mean(values), 0.0) for name, values in policies.items()]
    return results, pd.DataFrame(rows, columns=["policy", "point", "metric", "mean", "low"])


def test_policies_are_compared_on_common_replications():
    """A lead in every replication is significant, if rare failures could not make up for it."""
    spread = np.linspace(0.3, 0.8, 30)
    jitter = np.tile([0.19, 0.2], 15)
    results, means = stub(a=spread + jitter, b=spread, c=spread[::-1] - 0.3)
    verdicts = summary.with_verdicts(results, means)["verdict"].tolist()
    assert verdicts == [summary.BEST, summary.WORSE, summary.WORSE]
    results, means = stub(a=spread + 0.01, b=spread)
    assert summary.with_verdicts(results, means)["verdict"].tolist() == [summary.TIED] * 2
    results, means = stub(a=spread, b=spread[::-1])
    assert summary.with_verdicts(results, means)["verdict"].tolist() == [summary.TIED] * 2
    assert summary.with_verdicts(results, means[1:])["verdict"].tolist() == [summary.ONLY]


def test_targets_are_met_by_the_lower_end():
    rows = [("a", 0, 0.9), ("a", 1, 0.89), ("b", 0, 0.95)]
    means = pd.DataFrame(rows, columns=["policy", "point", "low"]).assign(metric=PRODUCT)
    product = means.assign(metric="success", low=[0.5, 0.9, 0.9])
    table = pd.concat([means, product], ignore_index=True)
    left = summary.meeting(table, {PRODUCT: 0.9})
    assert [*zip(left["policy"], left["point"], strict=True)] == [("a", 0), ("b", 0)] * 2
    assert summary.meeting(table, {PRODUCT: 0.9, "success": 0.6})["policy"].tolist() == ["b"] * 2
    assert summary.meeting(table, {}).equals(table)


def test_the_command_of_a_mission_gives_its_row(results, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    worst = summary.worst(results, "random", 1, folder=results.store.folder).iloc[0]
    assert cli.main([*shlex.split(worst["command"])[1:], "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["collection_ratio"] == worst["collection_ratio"]


def test_policies_are_ranked_by_the_mean_over_design_points():
    rows = [
        ("a", 0, 0.9),
        ("a", 0, 0.9),
        ("a", 1, 0.1),
        ("b", 0, 0.6),
        ("b", 1, 0.6),
        ("c", 0, 0.6),
    ]
    missions = pd.DataFrame(rows, columns=["policy", "point", PRODUCT])
    assert summary.ranked_policies(missions) == ["b", "c", "a"]  # a: (0.9 + 0.1) / 2
    assert summary.best_policy(missions) == "b"
    assert summary.best_policy(missions, among=["a", "c"]) == "c"


def test_the_best_policy_is_compared_with_the_others(results):
    best = summary.best_policy(results.missions)
    table = summary.comparisons(results).set_index("metric")
    assert set(table["baseline"]) == {best} == {"greedy"}
    assert (table["policy"] == "random").all()
    missions = results.missions.groupby("policy")[PRODUCT].mean()
    expected = missions["random"] - missions["greedy"]
    assert table.loc[PRODUCT, "difference"] == pytest.approx(expected)
    assert table.loc[PRODUCT, "n"] == 20  # replications: points share their realisation
    alone = compare(results.missions, "greedy", table.index.tolist())
    either = np.minimum(1, 2 * alone["p_adjusted"])  # random might have been the best
    assert table["p_adjusted"].tolist() == pytest.approx(either.tolist())


@pytest.fixture
def trained_twice(tmp_path):
    """Folders of two trainings that differ in their seed, and of one that does not learn alike."""
    scenario, folders = str(write_scenario(tmp_path)), []
    for seed, discount in ((1, 0.99), (2, 0.99), (1, 0.9)):
        phases = [PHASES[1] | {"ticks": 3}]
        config = tiny(
            scenario=scenario, seed=seed, discount=discount, learning_starts=5, phases=phases
        )
        training = Training(config, CPU)
        training.run(2)
        folders.append(str(tmp_path / f"{seed}-{discount}"))
        weights = training.learner.online.state_dict()
        save_policy(Path(folders[-1]), weights, config, training.space)
    return folders


def test_checkpoints_of_one_learner_are_one_learner(tmp_path, trained_twice):
    first, second, other = trained_twice
    assert load(first).learner == load(second).learner != load(other).learner
    policies = ["greedy", "random", first, second]
    results = run_study(small_study(tmp_path, policies=policies), tmp_path / "out")
    assert summary.learners(results) == {"tiny": [first, second]}
    policies = ["greedy", first, other, f"{first},greedy"]
    mixed = run_study(small_study(tmp_path, policies=policies), tmp_path / "mixed")
    assert sorted(summary.learners(mixed).values()) == sorted([[first], [other]])
    table = summary.learned_against_heuristic(results)
    assert set(table["about"]) == {"the learner"}
    assert set(table["trainings"]) == {2}
    alone = run_study(small_study(tmp_path, policies=["greedy", first]), tmp_path / "alone")
    assert set(summary.learned_against_heuristic(alone)["about"]) == {"this checkpoint"}


def test_the_selected_point_and_its_check(tmp_path):
    rule = {
        "procedure": "kn",
        "metric": "collection_ratio",
        "first": 8,
        "indifference": 0.02,
        "budget": 2000,
        "check": 9,
    }
    study = small_study(tmp_path, selection=rule, design=grid(quota=[20, 40, 80]))
    results = run_study(study, tmp_path / "out")
    table = summary.selections(results)
    assert table["policy"].tolist() == ["greedy", "random"]
    for row in table.itertuples():
        assert row.setting == f"quota {study.points[row.point].values['quota']}"
        counts = results.missions.query("policy == @row.policy").groupby("point").size()
        assert row.missions == counts.sum()
    checks = summary.checks(results).set_index(["policy", "metric"])
    assert set(checks["n"]) == {9}
    rewards = results.checks.query("policy == 'greedy'")["reward"]
    assert checks.loc[("greedy", "reward"), "mean"] == pytest.approx(np.mean(rewards))
    assert summary.comparisons(results).empty  # each policy has missions of its own


def test_estimates_stand_beside_the_papers_numbers():
    rows = [
        ("tour", 1, "success", 0.95, 0.94, 0.96),
        ("tour", 1, "collection_ratio", 0.7, 0.65, 0.75),
        ("greedy", 1, "success", 0.9, 0.85, 0.92),
        ("greedy", 1, "collection_ratio", 0.8, 0.79, 0.81),
    ]
    table = pd.DataFrame(rows, columns=["policy", "uavs", "metric", "mean", "low", "high"])
    printed = {"success": 0.93, "collection_ratio": 0.7}
    assert summary.beside_paper(table, {None: printed}).to_numpy().tolist() == [
        ["paper", "93.0 %", "70.0 %"],
        ["tour", "95.0 % [94.0, 96.0] +2.0 ▲", "70.0 % [65.0, 75.0] 0.0 ≈"],
        ["greedy", "90.0 % [85.0, 92.0] −3.0 ▼", "80.0 % [79.0, 81.0] +10.0 ▲"],
    ]
    both = pd.concat([table, table.assign(uavs=2, mean=table["mean"] + 0.01)])
    fleets = summary.beside_paper(both, {1: printed, 2: {"success": 0.5, "collection_ratio": 1}})
    assert [fleet for _, fleet in fleets.columns[1:]] == ["I = 1", "I = 2"] * 2
    assert fleets.iloc[1, 2] == "96.0 % [94.0, 96.0] +46.0 ▲"


def test_with_one_policy_there_is_no_comparison(tmp_path):
    design = grid(initial_data=[5, [5, 7.5]])
    study = small_study(tmp_path, policies=["greedy"], missions=1, design=design)
    results = run_study(study, tmp_path / "out")
    assert summary.comparisons(results).empty
    assert summary.learned_against_heuristic(results).empty
    assert summary.selections(results).empty
    assert summary.settings(results) == ["initial_data 5", "initial_data 5..7.5"]
