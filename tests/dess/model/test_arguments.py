"""What people pass: names, numbers of numpy and pandas, and what is neither."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import dess
from dess import InputError, ScenarioSpace, analysis, load_scenario, simulate, simulate_batch
from dess.analysis.ask.question import sweep_question, what_if_question
from dess.model.view import View
from dess.policies import load
from dess.policies.heuristics import Greedy

FOLDER = Path(dess.__file__).parent / "scenarios"

PLAIN: list[tuple[dict[str, Any], dict[str, Any]]] = [
    ({"uavs": np.int64(3)}, {"uavs": 3}),
    ({"uavs": np.array([1, 3], np.uint8)}, {"uavs": [1, 3]}),
    ({"uavs": pd.Series([1, 3])}, {"uavs": [1, 3]}),
    ({"edge_snr": np.float32(-20), "forbid_swaps": np.bool_(True)},
     {"edge_snr": -20.0, "forbid_swaps": True}),
    ({"nodes": np.array([[1, 2], [3, 4]])}, {"nodes": [[1, 2], [3, 4]]}),
    ({"nodes": [np.array([1, 2]), (np.int16(3), 4)]}, {"nodes": [[1, 2], [3, 4]]}),
    ({"failures": {"uav_rate": np.float64(0.5)}}, {"failures": {"uav_rate": 0.5}}),
    ({"wind.strength": np.float64(0.5)}, {"wind.strength": 0.5}),
    ({"fleet": [{"quota": np.int32(30)}]}, {"fleet": [{"quota": 30}]}),
    ({"zones": [{"cells": np.array([0, 0, 2, 2])}], "zones.pads": np.array([np.int64(3)])},
     {"zones": [{"cells": [0, 0, 2, 2]}], "zones.pads": [3]}),
]  # fmt: skip


@pytest.mark.parametrize(("given", "plain"), PLAIN, ids=[str([*of]) for of, _ in PLAIN])
def test_numbers_of_numpy_and_pandas_are_numbers(given, plain):
    assert load_scenario("paper", **given) == load_scenario("paper", **plain)


def test_an_integer_is_not_made_of_a_real_number_of_numpy():
    with pytest.raises(InputError, match="uavs.0: 3.0 is not an integer; allowed: an integer or"):
        load_scenario("paper", uavs=np.float64(3))


def test_questions_and_studies_take_numbers_of_numpy_and_pandas():
    policies: Any = ["greedy"]
    plain = sweep_question({"uavs": (1, 2)}, "paper", policies, 4, 3).study
    numbers: Any = np.int64(4), np.int64(3)
    for values in (np.arange(1, 3), pd.Series([1, 2])):
        swept = dict(uavs=values)  # noqa: C408
        fields = {f: analysis.ask.question.values_of(f, of) for f, of in swept.items()}
        assert sweep_question(fields, "paper", policies, *numbers).study == plain
    asked = what_if_question({"uavs": np.int64(3)}, None, "paper", policies, *numbers).study
    assert asked == what_if_question({"uavs": 3}, None, "paper", policies, 4, 3).study
    fewer: Any = np.int64(5)
    assert analysis.load_study("fig4", missions=fewer) == analysis.load_study("fig4", missions=5)


# --- names ---

SCENARIOS: dict[str, Any] = {
    "name": "paper",
    "path": FOLDER / "paper.toml",
    "path as text": str(FOLDER / "paper.toml"),
    "space": load_scenario("paper"),
}
POLICIES: dict[str, Any] = {
    "names": "greedy,tour",
    "list of names": ["greedy", "tour"],
    "mixed": (load("greedy"), "tour"),
    "objects": [load("greedy"), load("tour")],
}
TAKING: dict[str, Callable[[Any], Any]] = {
    "simulate": lambda s: simulate(s, "greedy", 1).metrics.tobytes(),
    "simulate_batch": lambda s: simulate_batch(s, "greedy", 1, 2).missions.tobytes(),
    "a list": lambda s: simulate_batch([s, s], "greedy", 1, 2).missions.tobytes(),
    "evaluate": lambda s: analysis.evaluate(s, "greedy", 2).moments["success"],
    "upper_bound": lambda s: analysis.bound.upper_bound(s, 1, 0, iterations=1).ratio,
    "of": lambda s: ScenarioSpace.of(s, quota=300),
    "parallel_env": lambda s: dess.parallel_env(s, 1).reset()[0]["uav_0"]["observation"].tobytes(),
    "vector_env": lambda s: dess.vector_env(s, 2, 1).reset()[0].tobytes(),
    "single_env": lambda s: dess.single_env(s, seed=1).reset()[0].tobytes(),
}


@pytest.mark.parametrize("function", TAKING)
def test_a_name_or_a_path_stands_for_a_scenario(function):
    results = [TAKING[function](scenario) for scenario in SCENARIOS.values()]
    assert results == [results[0]] * len(results)


@pytest.mark.parametrize("function", TAKING)
@pytest.mark.parametrize("wrong", [3, {"uavs": 3}, ScenarioSpace, "papr"], ids=str)
def test_what_is_no_scenario_is_refused_in_one_line(function, wrong):
    line = "^(scenario: .* is of type .*|papr: no such scenario.*); allowed: .*paper[^\n]*$"
    with pytest.raises(InputError, match=line):
        TAKING[function](wrong)


def test_names_stand_for_policies():
    teams = [*POLICIES.values()]
    single = [simulate("paper", team, 1, 3).metrics.tobytes() for team in teams]
    many = [simulate_batch("paper", team, 1, 3).missions.tobytes() for team in teams]
    assert single == [single[0]] * len(teams) and many == [many[0]] * len(teams)
    assert simulate("paper", "greedy", 1, 3).metrics.tobytes() != single[0]


@pytest.mark.parametrize("wrong", [3, None, Greedy, len, ["greedy", 3], [], "gredy"], ids=str)
def test_what_is_no_policy_is_refused_in_one_line(wrong):
    takers: list[Callable] = [simulate, simulate_batch, analysis.evaluate]
    for taker in takers:
        line = "^policy: .* is (of type|empty|unknown).*; allowed: [^\n]*greedy[^\n]*$"
        with pytest.raises(InputError, match=line):
            taker("paper", wrong)


@pytest.mark.parametrize("wrong", ["x", None, 1.5, [0.5], -1, {"a": 1}], ids=str)
def test_what_is_no_replication_is_refused_in_one_line(wrong):
    with pytest.raises(InputError, match="^replications: [^\n]*; allowed: a number, or integers$"):
        simulate_batch("paper", "greedy", 1, wrong)


# --- what missions share ---


class Vandal:
    """Writes into all arrays of the world that it sees, and then hovers."""

    name = "vandal"

    def __init__(self) -> None:
        self.refusals = 0

    def act(self, view: View) -> np.ndarray:
        world = view.world
        for array in (*world[:-1], *world.chart):
            if array is not None:
                with pytest.raises(ValueError, match="read-only"):
                    array[:] = 0
                self.refusals += 1
        return np.full(len(view), 4)


def test_a_policy_cannot_write_into_what_missions_share():
    vandal = Vandal()
    bay = load_scenario("bay", max_slots=3)  # with no-fly cells or zones
    simulate(bay, vandal), simulate_batch(bay, vandal)
    assert vandal.refusals >= 2 * 8
    env = dess.vector_env("paper", 2)
    arrays = [array for array in (*env.world[:-1], *env.world.chart) if array is not None]
    assert len(arrays) >= 8 and not any(array.flags.writeable for array in arrays)
