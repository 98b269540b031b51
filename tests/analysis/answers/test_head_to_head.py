"""Two policies are compared in the same missions, and the sentences about it say what came out."""

import pandas as pd
import pytest

from analysis import run_study
from analysis.answers import comparison as head_to_head
from analysis.answers.comparison import Pair
from analysis.names import METRICS, PRODUCT
from analysis.stats.differences import paired
from analysis.stats.intervals import by_replication
from dess import InputError, simulate
from policies import load_team
from tests.analysis.answers.test_regions import missions_of
from tests.analysis.small import grid, small_study


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    study = small_study(folder, policies=["random", "greedy", "nearest"], missions=40)
    return run_study(study, folder / "out")


@pytest.fixture
def taught(monkeypatch):
    """Make policies pass for learned ones: of every learner its trainings."""

    def teach(*learners):
        named = {f"learner {n}": names for n, names in enumerate(learners)}
        monkeypatch.setattr(head_to_head, "learners", lambda results: named)

    return teach


def ranked(results):
    means = results.missions.groupby("policy")[PRODUCT].mean()
    return means.sort_values(ascending=False).index.tolist()


def test_the_pair_is_the_best_learned_policy_and_the_best_other(results, taught):
    first, second, third = ranked(results)
    taught([second])
    assert head_to_head.pair_of(results) == Pair(second, first, 2)
    taught([third], [second])
    assert head_to_head.pair_of(results) == Pair(second, first, 2)


def test_without_a_learned_policy_the_best_two_are_the_pair(results):
    first, second, _ = ranked(results)
    assert head_to_head.pair_of(results) == Pair(first, second, 3)  # of three, any two


def test_policies_may_be_named(results, taught):
    first, second, third = ranked(results)
    taught([first])
    assert head_to_head.pair_of(results, heuristic=third) == Pair(first, third, 1)
    assert head_to_head.pair_of(results, learned=third) == Pair(third, second, 1)
    assert head_to_head.pair_of(results, third, first) == Pair(third, first, 1)


def test_what_is_no_pair_is_refused(results, tmp_path):
    with pytest.raises(InputError, match="learned: 'ddqn' is not in the study; allowed: random, "):
        head_to_head.pair_of(results, learned="ddqn")
    with pytest.raises(InputError, match="no two policies to compare among random, "):
        head_to_head.pair_of(results, "greedy", "greedy")
    alone = run_study(small_study(tmp_path, policies=["greedy"]), tmp_path / "out")
    with pytest.raises(InputError, match="no two policies to compare among greedy; allowed: two"):
        head_to_head.pair_of(alone)


def test_duels_are_of_the_same_missions(results):
    duels = head_to_head.duels(results, Pair("random", "greedy", 1)).set_index("replication")
    ours, theirs = (
        results.missions.query("policy == @name").set_index("replication")
        for name in ("random", "greedy")
    )
    assert duels["difference"].to_numpy() == pytest.approx(ours[PRODUCT] - theirs[PRODUCT])
    for metric in METRICS:
        assert duels[metric].tolist() == ours[metric].tolist()
        assert duels[f"{metric}_baseline"].tolist() == theirs[metric].tolist()
    nodes = len(results.scenario().nodes)
    assert duels["initial_data"].tolist() == (ours["initial"] / nodes).tolist()
    assert duels["uavs"].tolist() == ours["uavs"].tolist() == theirs["uavs"].tolist()


def test_duels_of_several_design_points_are_refused(tmp_path):
    study = small_study(tmp_path, design=grid(uavs=[1, 2]), missions=2)
    results = run_study(study, tmp_path / "out")
    with pytest.raises(InputError, match="study trial: 2 design points; allowed: one"):
        head_to_head.duels(results, Pair("greedy", "random", 1))


def test_overall_is_a_paired_t_test_that_allows_for_the_choice(results):
    pair = Pair("random", "greedy", 3)
    table = head_to_head.overall(results, pair).set_index("metric")
    values = by_replication(results.missions, PRODUCT, "policy")
    test = paired(*(values[policy].to_numpy() for policy in ("random", "greedy")), metric=PRODUCT)
    row = table.loc[PRODUCT]
    assert [row["difference"], row["low"], row["high"]] == pytest.approx([*test[:3]])
    assert row["p"] == pytest.approx(test.p)
    smallest = table["p"].idxmin()  # by Holm times three metrics, by Bonferroni times three pairs
    assert table.loc[smallest, "p_adjusted"] == pytest.approx(min(1, 9 * table["p"].min()))


def test_common_missions_are_worth_the_variance_that_they_save():
    comparison = pd.DataFrame({"metric": [*METRICS], "variance_reduction": [0.0, 0.5, 8 / 9]})
    assert head_to_head.pairing(comparison) == "9 times as many"
    always = comparison.assign(variance_reduction=1.0)
    assert head_to_head.pairing(always) == "infinitely many"


def test_missions_are_won_tied_lost_and_failed():
    missions = missions_of(lambda t: 0, n=10).assign(
        difference=[1, 1, 1, 1, 1, 0, 0, 0, -1, -1],
        success=[1] * 8 + [0, 0],
        success_baseline=[0] + [1] * 8 + [0],
    )
    table = head_to_head.outcomes(missions, Pair("ours", "theirs", 1))
    assert dict(zip(table["Outcome"], table["Missions"], strict=True)) == {
        "ours ahead": "5",
        "level": "3",
        "ours behind": "2",
        "only ours fails": "1",
        "only theirs fails": "1",
    }
    assert table["Share"].iloc[2] == "20.0 % [5.7, 51.0]"  # Wilson's interval of 2 in 10


def test_the_worst_missions_and_the_most_lost():
    missions = missions_of(lambda t: 0, n=4).assign(
        collection_ratio=[0.9, 0.4, 0.8, 0.5],
        **{PRODUCT: [0.0, 0.4, 0.0, 0.5]},
        difference=[-0.9, 0.1, -0.2, -0.3],
    )
    assert head_to_head.worst(missions, 3)["replication"].tolist() == [2, 0, 1]
    assert head_to_head.drawn(missions, Pair("ours", "theirs", 1)) == [
        *(("ours", 2), ("theirs", 2)),
        *(("ours", 0), ("theirs", 0)),
    ]
    assert head_to_head.most_lost(missions, 2)["replication"].tolist() == [0, 3]
    assert head_to_head.most_lost(missions, 9)["replication"].tolist() == [0, 3, 2]


def test_the_outcome_of_a_mission_is_that_of_its_uavs(tmp_path):
    study = small_study(
        tmp_path, policies=["random-unguarded", "greedy"], missions=8, set={"quota": 120}
    )
    results = run_study(study, tmp_path / "out")
    pair = Pair("random-unguarded", "greedy", 1)
    missions = head_to_head.duels(results, pair)
    table, depleted, quotas = head_to_head.outcome_table(missions, results, pair), 0, set()
    assert table["", "Mission"].tolist() == [str(n) for n in range(8)]
    for replication in range(8):
        record = simulate(results.scenario(), load_team("random-unguarded"), 7, replication)
        ends = [row["end"] for row in record.uav_rows()]
        depleted += ends.count("battery")
        quotas.add(f"{ends.count('quota')} of {len(ends)}")
        assert (
            table["random-unguarded", "Quotas"][replication]
            == f"{ends.count('quota')} of {len(ends)}"
        )
        assert table["random-unguarded", "Success"][replication] == (
            "yes" if record.success else "no"
        )
    assert len(quotas) > 1
    assert depleted == head_to_head.depleted(results, "random-unguarded", range(8)) > 0
