"""The summary of a study: tables of means, comparisons, selections and the worst missions."""

import warnings
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from dess import InputError
from dess.analysis import load_study, run_study
from dess.analysis.answers import summary
from dess.analysis.answers.policies import comparisons, performance, ranks
from dess.analysis.answers.settings.sobol import sobol_indices
from dess.analysis.measured import check_metric, check_ranking_metric, recorded_metrics
from dess.analysis.metrics import METRICS, PRODUCT, RATIO
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.stats.alternatives import BEST, ONLY, SEEN_BEST, TIED
from dess.analysis.stats.differences import compare
from dess.analysis.stats.verdict import SEEN_WORSE, WORSE
from dess.analysis.study.design import Saltelli

# Names only: nothing is simulated.
FIELDS = ("edge_snr", "arrival_rate", "path_loss_exponent")
INDICES = ["first", "first_low", "first_high", "total", "total_low", "total_high"]


def noise_of(replication):
    """A number in [0, 1) of a replication, as good as random."""
    return np.array([np.random.default_rng(each).random() for each in replication])


def unit(number, base, seed=0):
    """A design of so many fields, each on [0, 1]."""
    return Saltelli(ranges={field: [0, 1] for field in FIELDS[:number]}, base=base, seed=seed)


def evaluated(design, **functions):
    """A mission per point: its metrics are functions of the fields and of the noise."""
    replication = [point.replication for point in design.points]
    x = np.array([list(point.values.values()) for point in design.points]).T
    metrics = {name: metric(*x, noise_of(replication)) for name, metric in functions.items()}
    return pd.DataFrame({"point": range(len(replication)), "replication": replication} | metrics)


# x, y and the noise e are uniform on [0, 1]: each has variance 1/12.
KNOWN = {
    # Variances 1 : 4. Nothing interacts, so total = first.
    "additive": (lambda x, e: x + 2 * e, [1 / 5, 4 / 5], [1 / 5, 4 / 5]),
    # Variance E[x^2] / 12 = 1/36. The mean does not depend on x: its first is 0.
    # E[. | e] = (e - 1/2) / 2 has variance 1/48, 3/4 of it; all of it is gone once e is known.
    "spread": (lambda x, e: x * (e - 1 / 2), [0, 3 / 4], [1 / 4, 1]),
    # A success with probability x: variance 1/4, of which E[. | x] = x explains 1/12, as does
    # E[. | e] = 1 - e.
    "success": (lambda x, e: (e < x).astype(int), [1 / 3, 1 / 3], [2 / 3, 2 / 3]),
}


@pytest.mark.parametrize("case", KNOWN)
def test_known_shares_of_parameters_and_noise(case):
    function, first, total = KNOWN[case]
    design = unit(len(first) - 1, base=2048)
    table = sobol_indices(design, evaluated(design, y=function), ["y"])
    for index, truth in (("first", first), ("total", total)):
        low, high = table[f"{index}_low"], table[f"{index}_high"]
        room = (high - low) / 2  # some of so many intervals of 95 % miss
        assert ((low - room <= truth) & (truth <= high + room)).all()
        assert (high - low < 0.25).all()


def test_a_metric_without_variance_has_no_shares():
    design = unit(2, base=16)
    missions = evaluated(
        design,
        always=lambda x, y, e: np.ones(x.size),
        tenth=lambda x, y, e: np.full(x.size, 0.1),
        # Only outside of A and B, which measure the variance.
        elsewhere=lambda x, y, e: np.arange(x.size) % 5 == 1,
        y=lambda x, y, e: x + e,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = sobol_indices(design, missions, ["always", "tenth", "elsewhere", "y"])
    assert table.loc[table["metric"] != "y", INDICES].isna().all(axis=None)
    assert table.loc[table["metric"] == "y", INDICES].notna().all(axis=None)
    with pytest.raises(InputError, match="160 are not .* one for each of its 80 design points$"):
        sobol_indices(design, pd.concat([missions, missions]), ["y"])


def test_indices_depend_on_nothing_else():
    design = unit(1, base=64)
    missions = evaluated(design, other=lambda x, e: x * e, y=lambda x, e: x + e)
    np.random.seed(1)
    alone = sobol_indices(design, missions, ["y"])
    np.random.seed(2)
    both = sobol_indices(design, missions, ["other", "y"])
    pd.testing.assert_frame_equal(alone, both.iloc[2:].reset_index(drop=True))


def stub(**policies):
    """Results of one design point: the products of every policy in the same replications."""
    tables = [
        pd.DataFrame(
            {"policy": name, "point": 0, "replication": range(len(values)), PRODUCT: values}
        )
        for name, values in policies.items()
    ]
    results = SimpleNamespace(
        missions=pd.concat(tables, ignore_index=True), analyses=lambda policy: np.zeros(1, int)
    )
    rows = [(name, 0, PRODUCT, np.mean(values), 0.0, 1.0) for name, values in policies.items()]
    return results, pd.DataFrame(rows, columns=["policy", "point", "metric", "mean", "low", "high"])


def test_policies_are_compared_on_common_replications():
    """A lead in every replication is significant, if rare failures could not make up for it."""
    spread = np.linspace(0.3, 0.8, 30)
    jitter = np.tile([0.19, 0.2], 15)
    results, means = stub(a=spread + jitter, b=spread, c=spread[::-1] - 0.3)
    verdicts = summary.add_verdicts(results, means)["verdict"].tolist()
    assert verdicts == [BEST, WORSE, WORSE]
    results, means = stub(a=spread + 0.01, b=spread)
    assert summary.add_verdicts(results, means)["verdict"].tolist() == [SEEN_BEST, SEEN_WORSE]
    results, means = stub(a=spread, b=spread[::-1])
    assert summary.add_verdicts(results, means)["verdict"].tolist() == [TIED] * 2
    assert summary.add_verdicts(results, means[1:])["verdict"].tolist() == [ONLY]


@pytest.mark.parametrize("metric", ["pad_requests", "utilisation", "generated"])
def test_what_is_neither_better_nor_worse_ranks_nothing(metric):
    """No policy is the best by it, and no setting."""
    spread = np.linspace(0.3, 0.8, 30)
    results, means = stub(a=spread + 0.2, b=spread)
    missions = results.missions.rename(columns={PRODUCT: metric})
    results = SimpleNamespace(missions=missions, analyses=results.analyses)
    means = means.assign(metric=metric)
    assert summary.add_verdicts(results, means)["verdict"].tolist() == [ONLY] * 2
    missions = {
        name: 0 for name in (*recorded_metrics(), "pad_requests", "utilisation", "generated")
    }
    check_metric(metric, missions)
    with pytest.raises(InputError, match="neither better nor worse"):
        check_ranking_metric(metric, missions)


def test_an_allowance_for_failures_is_said_with_both_intervals():
    """One policy is ahead by 0.1 in all of 300 missions, but for a little noise."""
    ratio = np.linspace(0.6, 0.8, 300)
    rows = [("a", n, value, 2) for n, value in enumerate(ratio + np.tile([0.095, 0.105], 150))]
    rows += [("b", n, value, 2) for n, value in enumerate(ratio)]
    missions = pd.DataFrame(rows, columns=["policy", "replication", PRODUCT, "uavs"])
    text = comparisons.allowance_for_difference(compare(missions, "b", [PRODUCT]), "policy")
    # Student's t of ±0.5 points: 1.968 x 0.5 / sqrt(299); with 0.8 and -0.7 added: ±0.7 points.
    assert "300 missions without a failure do not rule out one in 100 missions" in text
    assert "the difference of a in product is known to ±0.7" in text
    assert "without it (Student's t), to ±0.057 points" in text
    unlike = missions.assign(**{PRODUCT: np.random.default_rng(1).random(600)})
    assert comparisons.allowance_for_difference(compare(unlike, "b", [PRODUCT]), "policy") == ""


def test_it_is_said_how_means_weigh_the_numbers_of_uavs():
    """Of one UAV, which is drawn most often, the product is 0.4, of two UAVs 0.8."""
    uavs = np.repeat([1, 2], [30, 10])
    missions = pd.DataFrame({"policy": "a", "point": 0, "uavs": uavs, PRODUCT: 0.4 * uavs})
    missions = missions.assign(replication=range(40), **dict.fromkeys(("success", RATIO), 1))
    manifest = SimpleNamespace(scenarios=[SimpleNamespace(uavs=(1, 2))])
    results = SimpleNamespace(
        missions=missions.assign(reward=0.0), store=SimpleNamespace(manifest=manifest)
    )
    text = summary.weights_in_words(results)
    assert "the product of a is 60.0 %, and would be 50.0 % as a plain mean" in text
    manifest.scenarios[0].uavs = (2, 2)
    assert summary.weights_in_words(results) == ""


def test_targets_are_met_by_the_lower_end():
    rows = [("a", 0, 0.9), ("a", 1, 0.89), ("b", 0, 0.95)]
    means = pd.DataFrame(rows, columns=["policy", "point", "low"]).assign(metric=PRODUCT, high=1.0)
    product = means.assign(metric="success", low=[0.5, 0.9, 0.9])
    table = pd.concat([means, product], ignore_index=True)
    left = summary.settings_meeting(table, {PRODUCT: 0.9})
    assert [*zip(left["policy"], left["point"], strict=True)] == [("a", 0), ("b", 0)] * 2
    assert (
        summary.settings_meeting(table, {PRODUCT: 0.9, "success": 0.6})["policy"].tolist()
        == ["b"] * 2
    )
    assert summary.settings_meeting(table, {}).equals(table)


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
    # A: (0.9 + 0.1) / 2.
    assert ranks.rank_policies(missions) == ["b", "c", "a"]
    assert ranks.best_policy(missions) == "b"
    assert ranks.best_policy(missions, among=["a", "c"]) == "c"


def test_checkpoints_of_one_learner_are_one_learner(tmp_path):
    def results_of(*policies):
        study = load_study("table4", policies=policies, missions=5)
        return run_study(study, tmp_path / "-".join(policies))

    results = results_of("greedy", "random", "ddqn", "ddqn-2")
    assert trained_policies_by_learner(results) == {"ddqn": ["ddqn", "ddqn-2"]}
    mixed = results_of("greedy", "ddqn", "ddqn-paper", "ddqn,greedy")
    assert sorted(trained_policies_by_learner(mixed).values()) == [["ddqn"], ["ddqn-paper"]]
    table = comparisons.compare_learned_with_heuristic(results)
    assert set(table["about"]) == {"the learner"}
    assert set(table["trainings"]) == {2}
    alone = results_of("greedy", "ddqn")
    assert set(comparisons.compare_learned_with_heuristic(alone)["about"]) == {"this checkpoint"}


COPY = """
from dess.policies.registry import load


class CopyNet:
    name = "copy_net"
    weights = "of a network"

    def __init__(self):
        self.network = load("ddqn")

    def act(self, view):
        return self.network.act(view)
"""


def test_a_policy_of_a_user_with_weights_is_learned(tmp_path):
    """It is no heuristic with which learned policies are compared."""
    (tmp_path / "copied_network.py").write_text(COPY)
    copy = f"{tmp_path}/copied_network.py:CopyNet"
    study = load_study("table4", policies=["random", copy, "ddqn", "greedy"], missions=5)
    results = run_study(study, tmp_path / "out")
    assert trained_policies_by_learner(results) == {copy: [copy], "ddqn": ["ddqn"]}
    learned, heuristics = ranks.rank_learned_and_others(results)
    assert {*learned} == {copy, "ddqn"} and heuristics[0] == "greedy"
    table = comparisons.compare_learned_with_heuristic(results)
    assert {*table["baseline"]} == {"greedy"} and {*table["learner"]} == {copy, "ddqn"}


def test_what_is_said_of_the_guard_is_computed():
    """Policies under the guard may fail as well."""
    shares = {"greedy": 0.4, "random": 0.9, "random-unguarded": 0.01}
    means = pd.DataFrame(
        {"policy": policy, "metric": metric, "mean": mean, "low": mean, "high": mean}
        for policy, mean in shares.items()
        for metric in METRICS
    )
    said = performance.guard_sentences(means)
    assert "under the return guard: they succeed in 40.0 % to 90.0 % of the missions." in said
    assert "nearly all" not in said
