"""The examples run, and do what they say."""

import runpy
from pathlib import Path

import optuna
import pytest

import dess
from dess import policies

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture(scope="module")
def example():
    """The names of the example that searches fleet designs."""
    return runpy.run_path(str(EXAMPLES / "optuna_fleet.py"))


@pytest.fixture(scope="module")
def study(example):
    """A search of ten designs."""
    return example["search"](trials=10, seed=3)


def test_the_search_is_reproducible(example, study):
    again = example["search"](trials=4, seed=3)
    for trial, first in zip(again.trials, study.trials, strict=False):
        assert trial.params == first.params
        assert trial.intermediate_values == first.intermediate_values


def test_designs_that_lose_on_the_same_replications_are_given_up(example, study):
    pruned = study.get_trials(states=[optuna.trial.TrialState.PRUNED])
    complete = study.get_trials(states=[optuna.trial.TrialState.COMPLETE])
    assert pruned and len(pruned) + len(complete) == 10
    for trial in pruned:
        before = [t for t in complete if t.number < trial.number]
        leader = max(before, key=lambda t: t.value).intermediate_values
        losses = [leader[step] - value for step, value in trial.intermediate_values.items()]
        assert 5 <= len(losses) < example["BLOCKS"]  # 5 is the fewest that can be significant
        assert sum(losses) > 0


def test_the_best_design_is_worth_what_it_says(example, study):
    scenario = dess.load_scenario("paper", **study.best_params)
    missions = example["BLOCKS"] * example["BLOCK"]
    records = dess.simulate_batch(scenario, policies.load("greedy"), 3, missions).missions
    price = sum(price * study.best_params[part] for part, price in example["PRICES"].items())
    worth = records["collection_ratio_and_communication"].mean() - price
    assert study.best_value == pytest.approx(worth)


def test_random_actions_end_a_mission(capsys):
    runpy.run_path(str(EXAMPLES / "random_actions.py"))
    assert "data units collected" in capsys.readouterr().out
