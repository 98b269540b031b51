"""A planner beside a learner: differences, the front, what each collects, and when it goes home."""

import numpy as np
import pandas as pd
import pytest

from analysis import run_study
from analysis.answers import optimality
from analysis.answers.optimality import ALL
from analysis.bound import Bound
from analysis.execution import jobs
from analysis.names import PRODUCT
from analysis.results.event_log import uav_slots
from dess import InputError
from policies.planner import Budget, Planner
from tests.analysis.small import small_study

LOGGED = 3


def one(space, seed, replication, **_):
    """A bound of 1, with prices that are the number of the mission and of the node."""
    prices = np.array([[0.1, 0.2, 0.3], [replication / 100] * 3])
    return Bound(1.0, prices, np.array([9, 30]), 1)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planner")
    policies = ["greedy", "tour", "random"]
    study = small_study(folder, policies=policies, missions=30, bounds=True, logged=LOGGED)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jobs, "upper_bound", one)
        return run_study(study, folder / "out")


def test_differences_are_paired_by_fleet_and_over_all(results):
    table = optimality.differences(results, ["tour", "greedy"], "random")
    keys = table.loc[table["metric"] == PRODUCT, ["policy", "uavs"]].to_numpy().tolist()
    assert keys == [[policy, uavs] for policy in ("tour", "greedy") for uavs in (1, 2, 3, ALL)]
    wide = results.missions.pivot(index="replication", columns="policy", values=PRODUCT)
    fleets = results.missions.query("policy == 'greedy'").set_index("replication")["uavs"]
    rows = table[(table["policy"] == "greedy") & (table["metric"] == PRODUCT)].set_index("uavs")
    for uavs in (1, 2, 3):
        mine = (wide["greedy"] - wide["random"])[fleets == uavs]
        assert rows.loc[uavs, "difference"] == pytest.approx(mine.mean())
        assert rows.loc[uavs, "n"] == len(mine)
    assert rows.loc[ALL, "n"] == 30
    with pytest.raises(InputError, match="'none' is not in the study"):
        optimality.differences(results, ["none"], "random")


def test_the_answer_says_which_is_better_and_by_how_much(results):
    table = optimality.differences(results, ["greedy"], "random")
    text = optimality.answer(table, "greedy")
    difference = table[(table["uavs"] == ALL) & (table["metric"] == PRODUCT)].iloc[0]
    points = f"+{100 * difference['difference']:.1f} ["
    assert text.startswith(
        f"The planner is better: the product of greedy minus that of random is {points}"
    )
    assert text.endswith("over 30 missions.")
    assert optimality.ahead(table, "greedy") == f"{points[:-2]} points"
    turned = table.assign(low=-table["high"], high=-table["low"], difference=-table["difference"])
    assert optimality.answer(turned, "greedy").startswith("The learner is better: the product")
    open_ = table.assign(low=-0.01)
    assert optimality.answer(open_, "greedy").startswith("The missions do not tell which is better")


def test_coverage_is_what_the_logs_say_was_collected(results):
    shares = []
    for replication in range(LOGGED):
        log = results.events("greedy", 0, replication)
        by_node = log[log["node"] >= 0].groupby(["event", "node"])["value"].sum()
        had = by_node["mission_start"].add(by_node.get("arrival", 0.0), fill_value=0.0)
        shares.append(by_node["communication"].reindex(range(3), fill_value=0.0) / had)
    expected = np.mean(shares, axis=0)
    np.testing.assert_allclose(optimality.coverage(results, "greedy"), expected)
    assert 0 < expected.min() <= expected.max() <= 1


def test_the_share_at_home_is_that_of_uavs_in_the_zone(results):
    """The zone has the cells x 5..7, y 0..1."""
    table = optimality.at_home(results, ["greedy"]).set_index("slot")
    inside = total = 0
    for replication in range(LOGGED):
        slots = uav_slots(results.events("greedy", 0, replication)).query("slot == 2")
        inside += ((slots["x"] >= 5) & (slots["y"] <= 1)).sum()
        total += len(slots)
    assert table.loc[2, ["share", "n"]].tolist() == pytest.approx([inside / total, total])


def test_sessions_are_those_of_the_logs(results):
    logs = [results.events("greedy", 0, number) for number in range(LOGGED)]
    sessions = [log[log["event"] == "charge_start"] for log in logs]
    uavs = sum(len(log[(log["event"] == "mission_start") & (log["uav"] >= 0)]) for log in logs)
    begun = pd.concat(sessions)
    expected = [f"{len(begun) / uavs:.2f}", f"{begun['time'].mean():.1f}"]
    row = optimality.returns(results, ["greedy"]).iloc[0].tolist()
    assert row == ["greedy", *expected, f"{begun['battery'].mean():.1f} %", uavs]


def test_the_example_is_the_first_of_the_smallest_fleets_with_a_log(results):
    example = optimality.example(results, "greedy")
    fleets = results.missions.query("policy == 'greedy'")["uavs"].to_numpy()[:LOGGED]
    assert example.row["replication"] == int(np.argmin(fleets))


def test_the_price_of_a_node_is_the_sum_over_cuts(results):
    np.testing.assert_allclose(optimality.node_prices(results, 7), [0.17, 0.27, 0.37])


def test_the_plan_begins_where_the_uavs_start(results, monkeypatch):
    monkeypatch.setattr(Planner, "budget", Budget(500, 0))
    for replication in range(LOGGED):
        courses = optimality.plan(results, "planner", replication)
        log = results.events("greedy", 0, replication)
        starts = log[(log["event"] == "mission_start") & (log["uav"] >= 0)]
        assert [course.path[0].tolist() for course in courses] == starts[["x", "y"]].values.tolist()
        cells = np.concatenate([course.waypoints for course in courses])
        assert len(cells) and cells.min() >= 0 and cells.max() < 8
