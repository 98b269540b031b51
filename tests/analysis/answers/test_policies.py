"""Two policies in the same missions: how they differ, where, and how long they take to decide.

Figures show what is in their tables.
"""

import numpy as np
import pandas as pd
import pytest

from dess import InputError
from dess.analysis import run_study
from dess.analysis.answers.policies import comparisons, decision_times, pairs, ranks
from dess.analysis.answers.policies.decision_times import (
    CALLS,
    ensure_decision_times,
    measure_decision_times,
    read_decision_times,
)
from dess.analysis.answers.policies.pairs import (
    Pair,
    compare_pair,
    draw_difference_distribution,
    missions_to_draw,
    most_lost,
    pair_missions,
    pair_of,
    pair_outcome_table,
    pairing_sentence,
    worst_pair_missions,
)
from dess.analysis.answers.policies.parameter_bins import (
    colours_in_words,
    dependence_on_parameters,
    dependence_table,
    differences_along_parameters,
    divide_into_bins,
    varying_parameters,
)
from dess.analysis.metrics import METRICS, PRODUCT
from dess.analysis.names import PARAMETERS
from dess.analysis.stats.corrections import adjust_p_values
from dess.analysis.stats.verdict import BETTER, INCONCLUSIVE, WORSE
from tests.analysis.small import grid, small_study

PAIR = Pair("ours", "theirs", 1)


@pytest.fixture(scope="module")
def results(studied):
    return studied(policies=["random", "greedy", "nearest"], missions=40)


@pytest.mark.parametrize(
    ("learners", "named", "pair"),
    [
        ([[1]], {}, (1, 0, 2)),
        ([[2], [1]], {}, (1, 0, 2)),
        ([], {}, (0, 1, 3)),  # the best two, and of three, any two
        ([[0]], {"heuristic": 2}, (0, 2, 1)),
        ([[0]], {"learned": 2}, (2, 1, 1)),
        ([[0]], {"learned": 2, "heuristic": 0}, (2, 0, 1)),
    ],
)
def test_the_pair_is_the_best_learned_policy_and_the_best_other(
    results, monkeypatch, learners, named, pair
):
    """Policies are numbers, from the best to the worst; those of a learner are trainings."""
    means = results.missions.groupby("policy")[PRODUCT].mean()
    ranked = means.sort_values(ascending=False).index.tolist()
    taught = {f"learner {n}": [ranked[k] for k in of] for n, of in enumerate(learners)}
    for module in (pairs, comparisons, ranks):
        monkeypatch.setattr(module, "trained_policies_by_learner", lambda results: taught)
    asked = {name: ranked[k] for name, k in named.items()}
    policy, baseline, candidates = pair
    assert pair_of(results, **asked) == Pair(ranked[policy], ranked[baseline], candidates)


def test_a_pair_has_one_p_value_in_every_table(results):
    """All tables are corrected for the same tests: of three pairs by three metrics."""
    pair = pair_of(results)
    of_pair = compare_pair(results, pair).set_index("metric")
    table = comparisons.compare_with_best(results)
    other = table[table["policy"] == {*pair[:2]}.difference(table["baseline"]).pop()]
    expected = other.set_index("metric")
    assert of_pair["p_adjusted"].to_dict() == expected["p_adjusted"].to_dict()
    assert of_pair["p_adjusted"].tolist() == pytest.approx(
        (9 * of_pair["p"]).clip(upper=1).tolist()
    )
    assert "for the 9 comparisons" in comparisons.comparison_table(results).caption


def test_what_is_no_pair_is_refused(results, studied):
    with pytest.raises(InputError, match="learned: 'ddqn' is not in the study"):
        pair_of(results, learned="ddqn")
    with pytest.raises(InputError, match="no two policies to compare among random, "):
        pair_of(results, "greedy", "greedy")
    alone = studied(policies=["greedy"])
    with pytest.raises(InputError, match="no two policies to compare among greedy"):
        pair_of(alone)
    several = studied(design=grid(uavs=[1, 2]), missions=2)
    with pytest.raises(InputError, match="study trial: 2 design points"):
        pair_missions(several, Pair("greedy", "random", 1))


def test_missions_are_won_tied_lost_and_failed():
    missions = missions_of(lambda t: 0, n=10).assign(
        difference=[1, 1, 1, 1, 1, 0, 0, 0, -1, -1],
        success=[1] * 8 + [0, 0],
        success_baseline=[0, 0] + [1] * 7 + [0],
    )
    table = pair_outcome_table(missions, PAIR)
    assert dict(zip(table["Outcome"], table["Missions"], strict=True)) == {
        "ours ahead": "5",
        "level": "3",
        "ours behind": "2",
        "only ours fails": "1",
        "only theirs fails": "2",
    }
    # Wilson's interval of 2 in 10.
    assert table["Share"].iloc[2] == "20.0 % [5.7, 51.0]"


def test_the_worst_missions_and_the_most_lost():
    missions = missions_of(lambda t: 0, n=4).assign(
        collection_ratio=[0.9, 0.4, 0.8, 0.5],
        **{PRODUCT: [0.0, 0.4, 0.0, 0.5]},
        difference=[-0.9, 0.1, -0.2, -0.3],
    )
    assert worst_pair_missions(missions, 3)["replication"].tolist() == [2, 0, 1]
    assert missions_to_draw(missions, PAIR) == [
        *(("ours", 2), ("theirs", 2)),
        *(("ours", 0), ("theirs", 0)),
    ]
    assert most_lost(missions, 2)["replication"].tolist() == [0, 3]
    assert most_lost(missions, 9)["replication"].tolist() == [0, 3, 2]


def missions_of(gap, n=400, seed=1, **fixed):
    """Missions with a difference that is a function of their parameters, and some noise."""
    generator = np.random.default_rng(seed)
    table = pd.DataFrame(
        {
            "replication": range(n),
            "uavs": generator.integers(1, 4, n),
            "flying_time": generator.integers(70, 81, n),
            "charge_start": generator.integers(10, 51, n),
            "charge_complete": generator.integers(60, 101, n),
            "initial_data": generator.uniform(10, 15, n),
        }
    ).assign(**fixed)
    theirs = generator.uniform(0.4, 0.5, n)
    ours = theirs + gap(table) + generator.normal(0, 0.01, n)
    for metric in METRICS:
        ones = np.ones(n, int)
        table[metric] = ones if metric == "success" else ours
        table[f"{metric}_baseline"] = ones if metric == "success" else theirs
    return table.assign(difference=ours - theirs)


def test_bins_are_the_values_or_hold_about_as_many():
    codes, names = divide_into_bins(pd.Series([3, 1, 2, 3]))
    assert (codes.tolist(), names) == ([2, 0, 1, 2], ["1", "2", "3"])
    codes, names = divide_into_bins(pd.Series(range(100)), 4)
    assert np.bincount(codes).tolist() == [25, 25, 25, 25]
    assert names == ["0–24", "25–49", "50–74", "75–99"]
    values = np.random.default_rng(1).uniform(5, 20, 1000)
    codes, names = divide_into_bins(pd.Series(values), 5)
    assert set(np.bincount(codes)) == {200}
    assert all(values[codes == a].max() < values[codes == a + 1].min() for a in range(4))
    # Quantiles coincide.
    codes, names = divide_into_bins(pd.Series([0] * 90 + [*range(1, 11)]), 5)
    assert len(names) == codes.max() + 1 < 5 and names[0] == "0"


def test_along_a_parameter_the_difference_is_that_of_its_missions():
    missions = missions_of(lambda t: 0.05 * (t["uavs"] - 2))
    table = differences_along_parameters(missions, candidates=2)
    assert table["field"].unique().tolist() == [*PARAMETERS]
    assert (table.groupby("field")["n"].sum() == len(missions)).all()
    by_uavs = table.query("field == 'uavs'").set_index("value")
    assert by_uavs["verdict"].to_dict() == {"1": WORSE, "2": INCONCLUSIVE, "3": BETTER}
    own = missions.query("uavs == 3")["difference"].mean()
    assert by_uavs.loc["3", "mean"] == pytest.approx(own)
    expected = np.minimum(1, 2 * adjust_p_values(table["p"].to_numpy(), "holm"))
    assert table["p_adjusted"].tolist() == expected.tolist()


def test_a_bin_has_ten_missions_or_more():
    """Eight missions were drawn as bins of one or two."""
    few = missions_of(lambda t: 0.0, n=8)
    assert differences_along_parameters(few).empty
    assert dependence_table(differences_along_parameters(few), dependence_on_parameters(few)).empty
    assert differences_along_parameters(missions_of(lambda t: 0.0, n=45))["n"].min() >= 10


def test_only_colours_that_occur_are_explained():
    ahead = differences_along_parameters(missions_of(lambda t: 0.5 + 0 * t["uavs"]))
    said = colours_in_words(ahead, PAIR)
    assert said.startswith("By Holm's test over all bins, ours is better where a dot is blue. ")
    assert "orange" not in said and "hollow" not in said
    mixed = differences_along_parameters(missions_of(lambda t: 0.05 * (t["uavs"] - 2)))
    assert "ours is worse where a dot is orange" in colours_in_words(mixed, PAIR)


@pytest.mark.parametrize(
    ("reduction", "said"),
    [(0.0, "as many"), (0.02, "as many"), (0.75, "4.0 times as many"), (1.0, "infinitely many")],
)
def test_what_the_pairing_gains_is_said_in_words(reduction, said):
    table = pd.DataFrame({"metric": [PRODUCT], "variance_reduction": [reduction]})
    assert pairing_sentence(table) == f"{said} independent missions would be as precise"


def test_what_all_missions_share_is_no_parameter():
    missions = missions_of(lambda t: 0.1, uavs=2, flying_time=80)
    assert varying_parameters(missions) == [
        "charge_start",
        "charge_complete",
        "initial_data",
    ]
    assert set(differences_along_parameters(missions)["field"]) == {*varying_parameters(missions)}
    fixed = {field: 50 for field in PARAMETERS}
    alike = missions_of(lambda t: 0.1, **fixed)
    assert differences_along_parameters(alike).empty and dependence_on_parameters(alike).empty


def test_dependence_finds_what_the_difference_depends_on():
    table = dependence_on_parameters(missions_of(lambda t: 0.02 * t["uavs"])).set_index("field")
    assert table.index[0] == "uavs"
    assert table["explained"].is_monotonic_decreasing and 0.5 < table["explained"].iloc[0] < 1
    assert table.loc["uavs", "p_adjusted"] < 1e-6
    assert (table.drop("uavs")["p_adjusted"] > 0.05).all()
    none = dependence_on_parameters(missions_of(lambda t: 0).assign(difference=0.1))
    assert (none["p"] == 1).all() and (none["explained"] == 0).all()


def test_the_band_is_that_of_dvoretzky_kiefer_and_wolfowitz_by_hand():
    sample = pd.DataFrame({"difference": np.linspace(-0.2, 0.2, 60)})
    (ax,) = draw_difference_distribution(sample, PAIR).figure.axes
    (band,) = (c for c in ax.collections if c.get_gid() == "band")
    x, y = band.get_paths()[0].vertices.T
    half = 0.17533  # sqrt(ln(2 / 0.05) / 120)
    assert sorted({*y[x == x.min()]}) == pytest.approx([0, half], abs=1e-5)
    assert sorted({*y[x == x.max()]}) == pytest.approx([1 - half, 1], abs=1e-5)


TICK = 2.0**-10  # seconds, so that no sum of ticks is rounded


class Ticks:
    """A clock that goes on by its step whenever it is read."""

    def __init__(self, *steps):
        self.steps, self.reads, self.time = steps, 0, 0.0

    def __call__(self):
        self.time += self.steps[self.reads % len(self.steps)]
        self.reads += 1
        return self.time


@pytest.fixture(scope="module")
def timed_study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("times")
    (folder / "timed_here.py").write_text(
        "from dess.policies.heuristics import Greedy\nclass Mine(Greedy):\n    pass\n"
    )
    policies = ["greedy", f"{folder / 'timed_here.py'}:Mine", "random,greedy"]
    return run_study(small_study(folder, policies=policies, missions=2), folder / "trial")


@pytest.fixture(scope="module")
def measured(timed_study):
    """Calls that all take 2 ticks, with a tick in between."""
    return measure_decision_times(timed_study, Ticks(TICK, 2 * TICK))


def test_times_are_those_of_the_calls_alone(measured, timed_study):
    assert {(cost.median, cost.slow) for cost in measured.costs} == {(2 * TICK, 2 * TICK)}
    # Of ten calls, one takes 9 ticks.
    clock = Ticks(*([0.0, TICK] * 9), 0.0, 9 * TICK)
    slow = measure_decision_times(timed_study, clock).costs[0]
    assert (slow.median, slow.slow) == (TICK, 9 * TICK)


def test_policies_that_are_files_are_not_run_and_have_no_times(measured):
    assert [cost.policy for cost in measured.costs] == ["greedy", "random,greedy"]
    assert measured.costs[0].calls >= CALLS


def test_they_are_measured_once_for_the_same_results(timed_study, monkeypatch):
    with pytest.raises(InputError, match=r"no such file; allowed: what is made by: dess report$"):
        read_decision_times(timed_study)
    steps = []
    ensure_decision_times(timed_study, lambda *step: steps.append(step))
    assert steps == [(1, 3), (2, 3), (3, 3)]
    kept = read_decision_times(timed_study)
    monkeypatch.delattr(decision_times, "measure_decision_times")
    ensure_decision_times(timed_study)
    assert read_decision_times(timed_study) == kept
