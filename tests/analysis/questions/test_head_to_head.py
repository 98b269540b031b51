"""Where a policy is ahead is told as it was made, and never by the missions that found it."""

import numpy as np
import pandas as pd
import pytest

from analysis import compare, run_study
from analysis.names import METRICS, PRODUCT
from analysis.questions import head_to_head
from analysis.questions.head_to_head import AHEAD, BEHIND, EVEN, INCONCLUSIVE, Pair
from analysis.stats.correction import adjust
from analysis.stats.intervals import mean_interval, wilson
from dess import InputError, simulate
from dess.scenario import ScenarioSpace
from dess.state import sample_scenario
from policies import load_team
from tests.analysis.small import grid, small_study

PRODUCT = PRODUCT
PAIR = Pair("ours", "theirs", 1)


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


def ranked(results):
    means = results.missions.groupby("policy")[PRODUCT].mean()
    return means.sort_values(ascending=False).index.tolist()


def test_the_pair_is_the_best_learned_policy_and_the_best_other(results, taught):
    first, second, third = ranked(results)
    taught([second])
    assert head_to_head.pair_of(results) == Pair(second, first, 2)
    taught([third], [second])
    assert head_to_head.pair_of(results) == Pair(second, first, 2)


def test_the_first_training_stands_for_its_learner(results, taught):
    first, second, third = ranked(results)
    taught([third, second])
    assert head_to_head.pair_of(results) == Pair(third, first, 1)


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
    with pytest.raises(InputError, match="learned: 'ddqn' is not in the study; allowed: greedy, "):
        head_to_head.pair_of(results, learned="ddqn")
    with pytest.raises(InputError, match="no two policies to compare among greedy, "):
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


def test_overall_is_the_paired_comparison(results):
    pair = Pair("random", "greedy", 3)
    table = head_to_head.overall(head_to_head.duels(results, pair), pair).set_index("metric")
    two = results.missions.query("policy in ['random', 'greedy']")
    expected = compare(two, "greedy", [*METRICS]).set_index("metric")
    for column in ("difference", "low", "high", "p"):
        assert table[column].tolist() == pytest.approx(expected[column].tolist())
    any_of_three = np.minimum(1, 3 * expected["p_adjusted"])
    assert table["p_adjusted"].tolist() == pytest.approx(any_of_three.tolist())


def test_missions_are_won_tied_and_lost():
    missions = missions_of(lambda t: 0, n=10).assign(difference=[1, 1, 1, 1, 1, 0, 0, 0, -1, -1])
    table = head_to_head.outcomes(missions).set_index("outcome")
    assert table["count"].to_dict() == {AHEAD: 5, EVEN: 3, BEHIND: 2}
    assert tuple(table.loc[BEHIND, ["share", "low", "high"]]) == wilson(2, 10)


def test_bins_are_the_values_or_hold_about_as_many():
    codes, names = head_to_head.bins(pd.Series([3, 1, 2, 3]))
    assert (codes.tolist(), names) == ([2, 0, 1, 2], ["1", "2", "3"])
    codes, names = head_to_head.bins(pd.Series(range(100)), 4)
    assert np.bincount(codes).tolist() == [25, 25, 25, 25]
    assert names == ["0–24", "25–49", "50–74", "75–99"]
    values = np.random.default_rng(1).uniform(5, 20, 1000)
    codes, names = head_to_head.bins(pd.Series(values), 5)
    assert set(np.bincount(codes)) == {200}
    assert all(values[codes == a].max() < values[codes == a + 1].min() for a in range(4))
    codes, names = head_to_head.bins(pd.Series([0] * 90 + [*range(1, 11)]), 5)  # quantiles coincide
    assert len(names) == codes.max() + 1 < 5 and names[0] == "0"


def test_along_a_parameter_the_difference_is_that_of_its_missions():
    missions = missions_of(lambda t: 0.05 * (t["uavs"] - 2))
    table = head_to_head.along(missions, candidates=2)
    assert table["field"].unique().tolist() == [*head_to_head.PARAMETERS]
    assert (table.groupby("field")["n"].sum() == len(missions)).all()
    own = table.query("field == 'uavs'").set_index("value")
    assert own["verdict"].to_dict() == {"1": BEHIND, "2": INCONCLUSIVE, "3": AHEAD}
    part = missions.query("uavs == 3")
    ends = mean_interval(part["difference"])
    assert own.loc["3", ["mean", "low", "high"]].tolist() == pytest.approx(list(ends))
    lost = wilson(int((part["difference"] < 0).sum()), len(part))
    assert tuple(own.loc["3", ["behind", "behind_low", "behind_high"]]) == lost
    expected = np.minimum(1, 2 * adjust(table["p"].to_numpy(), "holm"))
    assert table["p_adjusted"].tolist() == expected.tolist()


def test_what_all_missions_share_is_no_parameter():
    missions = missions_of(lambda t: 0.1, uavs=2, flying_time=80)
    assert head_to_head.varied(missions) == ["charge_start", "charge_complete", "initial_data"]
    assert set(head_to_head.along(missions)["field"]) == {*head_to_head.varied(missions)}
    fixed = {field: 50 for field in head_to_head.PARAMETERS}
    alike = missions_of(lambda t: 0.1, **fixed)
    assert head_to_head.along(alike).empty and head_to_head.dependence(alike).empty
    (region,) = head_to_head.rules(alike).itertuples()
    assert (region.rule, region.verdict, region.n) == ("all missions", AHEAD, 200)


def test_across_two_parameters_every_mission_is_in_one_cell():
    missions = missions_of(lambda t: 0.1 * ((t["uavs"] == 3) & (t["flying_time"] > 75)))
    table = head_to_head.across(missions, "uavs", "flying_time")
    assert table["n"].sum() == len(missions)
    sure = table[table["verdict"] == AHEAD]
    assert set(sure["value"]) == {"3"}
    row = table.query("value == '1' and position_2 == 0").iloc[0]
    low, high = map(int, row["value_2"].split("–"))
    part = missions.query("uavs == 1 and @low <= flying_time <= @high")
    assert (row["n"], row["mean"]) == (len(part), pytest.approx(part["difference"].mean()))


def test_dependence_finds_what_the_difference_depends_on():
    table = head_to_head.dependence(missions_of(lambda t: 0.02 * t["uavs"])).set_index("field")
    assert table.index[0] == "uavs"
    assert table["explained"].is_monotonic_decreasing and 0.5 < table["explained"].iloc[0] < 1
    assert table.loc["uavs", "p_adjusted"] < 1e-6
    assert (table.drop("uavs")["p_adjusted"] > 0.05).all()
    none = head_to_head.dependence(missions_of(lambda t: 0).assign(difference=0.1))
    assert (none["p"] == 1).all() and (none["explained"] == 0).all()


def test_rules_find_the_region_of_the_loss():
    def gap(t):
        return 0.1 - 0.3 * ((t["uavs"] == 3) & (t["flying_time"] <= 72))

    missions = missions_of(gap, n=2000)
    table = head_to_head.rules(missions)
    assert table["rule"].iloc[0] == "UAVs 3, Flying time 70–72"
    assert table["verdict"].tolist() == [BEHIND] + [AHEAD] * (len(table) - 1)
    assert table["mean"].is_monotonic_increasing
    assert len(table) <= 2**head_to_head.DEPTH
    odd = missions.query("replication % 2 == 1 and uavs == 3 and flying_time <= 72")
    ends = mean_interval(odd["difference"])
    assert table.loc[0, ["mean", "low", "high"]].tolist() == pytest.approx(list(ends))
    assert table["n"].sum() == table["found_on"].sum() == len(missions) / 2
    assert table["found_on"].min() >= head_to_head.SHARE * len(missions) / 2


def test_regions_that_chance_finds_are_not_told():
    """On the missions that a tree was grown on, noise looks like regions; not on the others."""
    seeds = range(20)
    tables = [head_to_head.rules(missions_of(lambda t: 0, n=400, seed=seed)) for seed in seeds]
    assert all(len(table) > 2 for table in tables)
    false = sum((table["verdict"] != INCONCLUSIVE).any() for table in tables)
    assert false <= 3  # of 20, each with a chance of at most 1 in 20


def test_what_is_told_of_regions_does_not_depend_on_the_missions_that_found_them():
    missions = missions_of(lambda t: 0.1 * (t["uavs"] == 3))
    even = missions["replication"] % 2 == 0
    moved = {c: missions[c].where(~even, missions[c] + 0.5) for c in ("difference", PRODUCT)}
    same = head_to_head.rules(missions.assign(**moved))
    assert same["mean"].tolist() == head_to_head.rules(missions)["mean"].tolist()


def test_halves_share_no_mission():
    found, told = head_to_head.halves(missions_of(lambda t: 0, n=9))
    assert found["replication"].tolist() == [0, 2, 4, 6, 8]
    assert told["replication"].tolist() == [1, 3, 5, 7]


def test_few_missions_make_few_rules():
    assert head_to_head.rules(missions_of(lambda t: 0.1, n=1)).empty
    (row,) = head_to_head.rules(missions_of(lambda t: 0.1, n=8)).itertuples()
    assert (row.rule, row.n) == ("all missions", 4)


def test_the_worst_missions_and_the_most_lost():
    missions = missions_of(lambda t: 0, n=4).assign(
        collection_ratio=[0.9, 0.4, 0.8, 0.5],
        **{PRODUCT: [0.0, 0.4, 0.0, 0.5]},
        difference=[-0.9, 0.1, -0.2, -0.3],
    )
    assert head_to_head.worst(missions, 3)["replication"].tolist() == [2, 0, 1]
    assert head_to_head.most_lost(missions, 2)["replication"].tolist() == [0, 3]
    assert head_to_head.most_lost(missions, 9)["replication"].tolist() == [0, 3, 2]


def test_quotas_are_those_of_the_mission(tmp_path):
    study = small_study(tmp_path, policies=["random"], missions=8, set={"quota": 90})
    results = run_study(study, tmp_path / "out")
    told = []
    for replication in range(8):
        record = simulate(results.scenario(), load_team("random"), 7, replication)
        ends = [row["end"] for row in record.uav_rows()]
        told.append(head_to_head.quotas(results, "random", replication))
        assert told[-1] == f"{ends.count('quota')} of {len(ends)}"
    assert len({*told}) > 1


class West:
    """Flies west for good, and never charges."""

    name = "west"

    def act(self, view):
        return np.full(len(view), 3)


def test_the_stranded_are_those_whose_battery_is_empty(results):
    space = ScenarioSpace.of(results.scenario(), quota=1000, uavs=2)
    record = simulate(space, West(), 7, 0, events=True)
    assert [row["end"] for row in record.uav_rows()] == ["battery", "battery"]
    dry = head_to_head.stranded(
        pd.DataFrame(record.events.columns()), sample_scenario(space, 7, 0)
    ).sort_values("uav")
    assert dry["uav"].tolist() == [0, 1]
    assert set(dry["time"]) == {record.flying_time}
    assert all(dry["moves"] >= 5 - dry["x"])


@pytest.mark.parametrize(
    ("x", "y", "moves"), [(5, 0, 0), (7, 1, 0), (4, 0, 1), (5, 4, 3), (2, 3, 5)]
)
def test_moves_to_the_zone(results, x, y, moves):
    scenario = sample_scenario(results.scenario(), 7, 0)  # its zone is x 5..7, y 0..1
    log = {"event": ["battery_empty"], "uav": [1], "time": [12.0], "x": [float(x)], "y": [float(y)]}
    (row,) = head_to_head.stranded(pd.DataFrame(log), scenario).itertuples()
    assert (row.uav, row.time, row.moves) == (1, 12.0, moves)
