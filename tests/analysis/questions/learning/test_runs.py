"""The scores of runs for rliable and marl-eval: they are means over blocks of missions."""

import json

import numpy as np
import pytest

from analysis import load_results, marl_eval_data, rliable_scores, run_study
from analysis.questions.learning import runs
from analysis.results.tables import Results
from dess import InputError
from tests.analysis.small import grid, small_study

POLICIES, METRIC = ["greedy", "random", "tour"], "collection_ratio"


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Three policies at two design points, 21 missions each."""
    folder = tmp_path_factory.mktemp("runs")
    design = grid(quota=[30, 60])
    run_study(small_study(folder, policies=POLICIES, missions=21, design=design), folder / "out")
    return load_results(folder / "out")


def block(results: Results, policy: str, point: int, missions: range) -> float:
    """The mean of a metric over some missions."""
    rows = results.missions.query("policy == @policy and point == @point")
    return float(rows[rows["replication"].isin([*missions])][METRIC].mean())


def test_a_run_of_a_policy_without_trainings_is_a_block_of_missions(results: Results) -> None:
    scores = rliable_scores(results, METRIC)
    assert [*scores] == POLICIES
    for policy, rows in scores.items():
        assert rows.shape == (10, 2)
        for point in range(2):
            blocks = [block(results, policy, point, range(2 * r, 2 * r + 2)) for r in range(10)]
            np.testing.assert_allclose(rows[:, point], blocks)


def test_a_run_of_a_learner_is_a_training_on_its_own_missions(results, monkeypatch) -> None:
    monkeypatch.setattr(runs, "learners", lambda _: {"learner": ["random", "tour"]})
    scores = rliable_scores(results, METRIC)
    assert [*scores] == ["learner", "greedy"]
    halves = range(10), range(10, 20)
    for name, flown in {"learner": ["random", "tour"], "greedy": ["greedy"] * 2}.items():
        expected = [
            [block(results, policy, point, half) for point in range(2)]
            for policy, half in zip(flown, halves, strict=True)
        ]
        np.testing.assert_allclose(scores[name], expected)


def test_marl_eval_has_the_same_scores_at_every_level(results, monkeypatch) -> None:
    monkeypatch.setattr(runs, "learners", lambda _: {"a,b": ["random", "tour"]})
    data = json.loads(json.dumps(marl_eval_data(results, ["success", METRIC])))
    scores = rliable_scores(results, METRIC)
    [[study, tasks]] = data.items()
    assert (study, [*tasks]) == ("trial", ["quota 30", "quota 60"])
    for task, algorithms in enumerate(tasks.values()):
        assert [*algorithms] == ["a+b", "greedy"]
        for name, of_runs in algorithms.items():
            assert [*of_runs] == ["run_1", "run_2"]
            for run, steps in enumerate(of_runs.values()):
                values = steps["absolute_metrics"]
                assert steps == {"step_1": {"step_count": 0} | values, "absolute_metrics": values}
                assert values[METRIC] == [scores[name.replace("+", ",")][run, task]]
                assert [*values] == ["success", METRIC]


def test_what_has_no_scores_is_refused(results, tmp_path, monkeypatch) -> None:
    with pytest.raises(InputError, match="metric: 'sucess' is unknown"):
        rliable_scores(results, "sucess")
    few = run_study(small_study(tmp_path, missions=9), tmp_path / "out")
    with pytest.raises(InputError, match="missions: 9 for 10 runs"):
        rliable_scores(few)
    unequal = {"a": ["greedy"] * 2, "b": ["tour"] * 3}
    monkeypatch.setattr(runs, "learners", lambda _: unequal)
    with pytest.raises(InputError, match=r"trainings: \[2, 3\]"):
        rliable_scores(results)
