"""Trainings: curves, comparisons of variants, their figures, and the files of policies."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dess import InputError
from dess.analysis import marl_eval_data, rliable_scores
from dess.analysis.answers.training import exports
from dess.analysis.answers.training.curves import (
    ALPHA,
    CURVE,
    CURVES,
    pairs_in,
    read_curve,
    read_curves,
    settling_position,
    smooth_curves,
)
from dess.analysis.answers.training.trained import Trained, curves_by_learner
from dess.analysis.answers.training.transfer import compare_all_transfers, compare_transfer
from dess.analysis.answers.training.variants import (
    FINAL,
    compare_variants,
    difference_of_trainings,
    methods_sentence,
    rows_of_ladder,
    without_each,
)
from dess.analysis.metrics import SUCCESS
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED
from dess.policies.registry import TRAINED
from tests.analysis.small import grid
from tests.policies.learner.tiny import tiny


def test_the_difference_of_means_is_welchs():
    a, b = [1.0, 2.0, 4.0], [3.0, 3.5]
    ends, p = difference_of_trainings(a, b)
    test = stats.ttest_ind(a, b, equal_var=False)
    assert ends.mean == pytest.approx(np.mean(a) - np.mean(b))
    assert (ends.low, ends.high) == pytest.approx(tuple(test.confidence_interval(0.95)))
    assert p == pytest.approx(test.pvalue)


def test_a_single_training_is_held_against_the_spread_of_the_others():
    """By hand: the prediction interval of one more, mean +- t s sqrt(1 + 1/n)."""
    others = np.array([1.0, 2.0, 3.0])
    ends, p = difference_of_trainings([5.0], others)
    half = stats.t.ppf(0.975, 2) * 1.0 * np.sqrt(1 + 1 / 3)
    assert (ends.low, ends.high) == pytest.approx((3.0 - half, 3.0 + half))
    assert p == pytest.approx(2 * stats.t.sf(3.0 / np.sqrt(4 / 3), 2))


def finals(**products: list[float]) -> pd.DataFrame:
    """The final products of the trainings of variants."""
    rows = [(variant, value) for variant, values in products.items() for value in values]
    table = pd.DataFrame(rows, columns=["variant", FINAL])
    return table.assign(seed=range(len(table)))


def test_intervals_of_shares_end_where_these_do():
    table = compare_variants(finals(base=[1.0, 0.9, 0.2], once=[0.73]), "base")
    base = table.set_index("variant").loc["base"]
    assert (base["low"], base["high"]) == (0.0, 1.0)
    assert (base["new_low"], base["new_high"]) == (0.0, 1.0)


METRIC = "evaluation_reward"
STEPS = [1000, 2000, 3000, 4000]


def training(variant, seed, values, before=0):
    """A curve with a number of evaluations before the last phase."""
    phases = ["harvest"] * before + ["battery"] * (len(values) - before)
    steps = STEPS[: len(values)]
    columns = {"phase": phases, "updates": steps, METRIC: values, "final_product": values[-1]}
    same = {"variant": variant, "seed": seed}
    return pd.DataFrame(same | columns).assign(uav_slots=500 * np.array(steps))


def several(variant, ends, level=0.0, before=0):
    """Trainings that rise from a level to their ends."""
    return pd.concat(
        training(variant, seed, np.linspace(level, end, len(STEPS)), before)
        for seed, end in enumerate(ends)
    )


def compared(using, without, **options):
    both = pd.concat([several("with", using, **options), several("without", without)])
    return compare_transfer(smooth_curves(both, METRIC), "with", "without", STEPS[-1])


def test_an_average_weighs_the_newest_and_begins_anew_with_every_phase():
    table = smooth_curves(training("one", 1, [4.0, 0.0, 8.0, 16.0], before=2), METRIC)
    a = ALPHA
    assert table["value"].tolist() == [4.0, 4.0 * (1 - a), 8.0, 8.0 * (1 - a) + 16.0 * a]
    assert table["updates"].tolist() == STEPS


def test_a_curve_has_settled_where_it_stays_near_its_end():
    averages = pd.Series([0.2, 0.55, 0.725])
    assert [settling_position(averages, margin) for margin in (1.0, 0.2, 0.0)] == [0, 1, 2]


def test_pairs_need_trainings_of_both_variants():
    curves = pd.concat(
        [several("quick", [1.0]), several("no transfer", [1.0]), several("no guard", [1.0])]
    )
    assert pairs_in(curves) == {"all methods of this project": ("quick", "no transfer")}
    (key,) = compare_all_transfers(curves, [METRIC], shortest=STEPS[-1])
    assert key == ("all methods of this project", METRIC)


@pytest.mark.parametrize(
    ("using", "without", "level", "verdict", "since"),
    [
        # Behind at first.
        ([9.0, 9.01, 9.02], [5.0, 5.01, 5.02], -1.0, HOLDS, STEPS[2]),
        # The interval contains 0.
        ([4.0, 9.0], [3.0, 8.0], 1.0, INCONCLUSIVE, STEPS[0]),
        ([3.0, 8.0], [4.0, 9.0], 0.0, INCONCLUSIVE, None),  # ends below
        # Two single trainings, equal at first.
        ([9.0], [5.0], 0.0, INCONCLUSIVE, STEPS[1]),
        # Ahead at first.
        ([2.0, 2.1, 2.2], [9.0, 9.1, 9.2], 1.0, REFUTED, None),
    ],
)
def test_transfer_is_judged_by_the_interval_of_the_end(using, without, level, verdict, since):
    result = compared(using, without, level=level)
    assert (result.verdict, result.since) == (verdict, since)
    assert result.throughout == (since == STEPS[0])
    assert (result.course == "ends below, or level") == (since is None)
    # Only the last phase counts.
    late = compared(using, without, level=level, before=2)
    assert late.since is None or late.since >= STEPS[2]
    both = pd.concat([several("with", using), several("without", without)])
    averages = smooth_curves(both, METRIC)
    short = compare_transfer(averages, "with", "without", shortest=STEPS[-1] + 1)
    assert (short.verdict, short.length) == (INCONCLUSIVE, STEPS[-1])


Change = Callable[[pd.DataFrame], Any]


@pytest.mark.parametrize(
    ("path", "read", "columns"),
    [("curves.parquet", read_curves, CURVES), ("ddqn/training.parquet", read_curve, CURVE)],
)
def test_shipped_curves_are_read_as_they_are(path, read, columns):
    kept = pd.read_parquet(TRAINED / path)[columns.names]
    pd.testing.assert_frame_equal(read(TRAINED / path), kept, check_dtype=False)


# Curves of another schema, and what the line names.
WRONG: dict[str, Change] = {
    "has no sound column variant": lambda curves: curves.drop(columns="variant"),
    "has no sound column seed": lambda curves: curves.assign(seed="one"),
    "has no sound column evaluation_reward": lambda c: c.assign(evaluation_reward=float("inf")),
    "has no sound column phase": lambda curves: curves[:0],
    "variant: has no pair of trainings": lambda curves: curves[curves["variant"] == "quick"],
}


@pytest.mark.parametrize("problem", WRONG)
def test_curves_of_another_schema_are_a_line(problem, tmp_path):
    path = tmp_path / "curves.parquet"
    WRONG[problem](pd.read_parquet(TRAINED / "curves.parquet")).to_parquet(path)
    with pytest.raises(InputError, match=f"^{path}: {problem}"):
        read_curves(path)


POLICIES, OF_RUNS = ["greedy", "random", "tour"], "collection_ratio"


@pytest.fixture(scope="module")
def results(studied):
    """Three policies at two design points, 21 missions each."""
    return studied(policies=POLICIES, missions=21, design=grid(quota=[30, 60]))


def block(results: Results, policy: str, point: int, missions: range) -> float:
    """The mean of a metric over some missions."""
    rows = results.missions.query("policy == @policy and point == @point")
    return float(rows[rows["replication"].isin([*missions])][OF_RUNS].mean())


def test_a_run_of_a_policy_without_trainings_is_a_block_of_missions(results):
    scores = rliable_scores(results, OF_RUNS)
    assert [*scores] == POLICIES
    for policy, rows in scores.items():
        assert rows.shape == (10, 2)
        for point in range(2):
            blocks = [block(results, policy, point, range(2 * r, 2 * r + 2)) for r in range(10)]
            np.testing.assert_allclose(rows[:, point], blocks)


def test_a_run_of_a_learner_is_a_training_on_its_own_missions(results, monkeypatch):
    monkeypatch.setattr(
        exports, "trained_policies_by_learner", lambda _: {"learner": ["random", "tour"]}
    )
    scores = rliable_scores(results, OF_RUNS)
    assert [*scores] == ["learner", "greedy"]
    halves = range(10), range(10, 20)
    for name, flown in {"learner": ["random", "tour"], "greedy": ["greedy"] * 2}.items():
        expected = [
            [block(results, policy, point, half) for point in range(2)]
            for policy, half in zip(flown, halves, strict=True)
        ]
        np.testing.assert_allclose(scores[name], expected)


def test_marl_eval_has_the_same_scores_at_every_level(results, monkeypatch):
    monkeypatch.setattr(
        exports, "trained_policies_by_learner", lambda _: {"a,b": ["random", "tour"]}
    )
    data = json.loads(json.dumps(marl_eval_data(results, ["success", OF_RUNS])))
    scores = rliable_scores(results, OF_RUNS)
    [[study, tasks]] = data.items()
    assert (study, [*tasks]) == ("trial", [f"communication quota {n}" for n in (30, 60)])
    for task, algorithms in enumerate(tasks.values()):
        assert [*algorithms] == ["a+b", "greedy"]
        for name, of_runs in algorithms.items():
            assert [*of_runs] == ["run_1", "run_2"]
            for run, steps in enumerate(of_runs.values()):
                values = steps["absolute_metrics"]
                assert steps == {"step_1": {"step_count": 0} | values, "absolute_metrics": values}
                assert values[OF_RUNS] == [scores[name.replace("+", ",")][run, task]]
                assert [*values] == ["success", OF_RUNS]


def test_what_has_no_scores_is_refused(results, studied, monkeypatch):
    with pytest.raises(InputError, match="metric: 'sucess' is unknown"):
        rliable_scores(results, "sucess")
    few = studied(missions=9)
    with pytest.raises(InputError, match="missions: 9 for 10 runs"):
        rliable_scores(few)
    unequal = {"a": ["greedy"] * 2, "b": ["tour"] * 3}
    monkeypatch.setattr(exports, "trained_policies_by_learner", lambda _: unequal)
    with pytest.raises(InputError, match=r"trainings: \[2, 3\]"):
        rliable_scores(results)


def test_trainings_that_differ_in_their_seed_are_of_one_learner():
    configs = {"one": tiny(seed=1), "two": tiny(seed=2), "other": tiny(seed=1, discount=0.9)}
    curve = pd.DataFrame({"updates": [250, 500]})
    trained = [Trained(name, config, curve) for name, config in configs.items()]
    sizes = curves_by_learner(trained).groupby(["variant", "seed"]).size()
    assert sizes.to_dict() == {("one and two", 1): 2, ("one and two", 2): 2, ("other", 1): 2}


def test_the_answer_names_no_largest_step_and_counts_what_is_needed():
    """The order of the methods decides the steps: what is needed is seen where one is missing."""

    def of(products: dict[str, list[float]]) -> pd.DataFrame:
        rows = [(name, p, float(p > 0)) for name, values in products.items() for p in values]
        return pd.DataFrame(rows, columns=["variant", FINAL, f"final_{SUCCESS}"])

    one_less = {"no guard": [0.6] * 3, "no low-battery starts": [0.7] * 3}
    one_less["no early returns"] = [0.7] * 3
    last = of({"none of the three": [0.0] * 3, **one_less, "quick": [0.7, 0.7, 0.8]})
    said = methods_sentence(rows_of_ladder(last))
    assert "step" not in said and "rises" not in said
    assert "0 of 3 (the paper's methods)" in said
    assert "3 of 3 without the guard" in without_each(last)
    assert without_each(last).endswith("no single method is needed for it.")
    failing = of(one_less | {"no guard": [0.6, 0.0, 0.0]})
    assert "1 of 3 without the guard" in without_each(failing)
    assert "needed" not in without_each(failing)
