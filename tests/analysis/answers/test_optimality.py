"""A planner beside a learner: gaps to the bound, differences, and what each collects."""

import numpy as np
import pandas as pd
import pytest

from analysis import run_study
from analysis.answers import optimality
from analysis.answers.optimality import ALL
from analysis.bound import Bound
from analysis.execution import jobs
from analysis.names import BOUND, GAP, PRODUCT
from analysis.results.event_log import uav_slots
from policies.planner import Budget, Planner
from tests.analysis.small import small_study


class Made:
    """Results of made-up missions."""

    bounds = {(0, 0): None}

    def __init__(self, missions):
        self.missions = missions


@pytest.fixture
def made():
    """Three missions of one UAV and two of two UAVs, by two policies; the gaps are by hand."""
    gaps = {"low": [0.10, 0.20, 0.30, 0.2, 0.2], "high": [0.05, 0.15, 0.25, 0.0, 0.1]}
    bound = np.array([0.7, 0.8, 0.9, 1.0, 1.0])
    rows = [
        {"policy": p, "point": 0, "replication": r, "uavs": u, BOUND: b, GAP: g, PRODUCT: b - g}
        | {"success": 1, "collection_ratio": b - g, "reward": 0.0}
        for p, of_policy in gaps.items()
        for r, (u, b, g) in enumerate(zip([1, 1, 1, 2, 2], bound, of_policy, strict=True))
    ]
    return Made(pd.DataFrame(rows))


def test_the_interval_is_that_of_paired_differences(made):
    table = optimality.by_fleet(made).set_index(["uavs", "policy"])
    row = table.loc[1, "low"]
    # Gaps 0.1, 0.2 and 0.3: mean 0.2, deviation 0.1, t of 2 degrees of freedom 4.3027.
    half = 4.3027 * 0.1 / np.sqrt(3)
    assert row[GAP] == pytest.approx(0.2)
    assert row[f"{GAP}_low"] == pytest.approx(0.2 - half, abs=1e-5)
    assert row[f"{GAP}_high"] == pytest.approx(0.2 + half, abs=1e-5)
    assert (row["n"], row[BOUND]) == (3, pytest.approx(0.8))
    assert row[PRODUCT] == pytest.approx(row[BOUND] - row[GAP])
    # The spread of the bounds and of the products, 0.1 each, is larger than that of the gaps here.
    constant = table.loc[2, "low"]
    assert constant[f"{GAP}_low"] == pytest.approx(constant[f"{GAP}_high"]) == pytest.approx(0.2)


def test_rows_are_by_number_of_uavs_then_over_all(made):
    table = optimality.by_fleet(made)
    assert [*zip(table["uavs"], table["policy"], table["n"], strict=True)] == [
        *((1, "low", 3), (1, "high", 3), (2, "low", 2), (2, "high", 2)),
        *((optimality.ALL, "low", 5), (optimality.ALL, "high", 5)),
    ]
    assert table[GAP].tolist() == pytest.approx([0.2, 0.15, 0.2, 0.05, 0.2, 0.11])


def test_the_sentence_is_about_fleets_whose_bound_says_something(made, monkeypatch):
    text = optimality.in_words(made)
    assert text.startswith("`high` is at most 39.8 points with 1 UAV (mean gap 15.0 [")
    assert optimality.in_words(made, "low").startswith("`low` is at most 44.8 points")
    table = optimality.by_fleet(made)
    certain = table.assign(**{BOUND: table[BOUND].mask(table["uavs"] == 2, 1.0)})
    assert {*optimality.useful(certain)["uavs"]} == {1}
    monkeypatch.setattr(optimality, "by_fleet", lambda _: certain)
    text = optimality.in_words(made)
    assert "with 2 UAVs" not in text
    assert text.endswith("The upper bound is 100 % for 2 UAVs, so there is no useful bound.")


def test_results_without_bounds_have_no_gap(tmp_path, monkeypatch):
    plain = run_study(small_study(tmp_path, missions=2), tmp_path / "plain")
    assert optimality.by_fleet(plain).empty
    bound = Bound(0.9, np.zeros((1, 3)), np.array([30]), 0)
    monkeypatch.setattr(jobs, "upper_bound", lambda *_, **__: bound)
    bounded = run_study(small_study(tmp_path, missions=2, bounds=True), tmp_path / "bounded")
    table = optimality.by_fleet(bounded)
    rows = table[table["uavs"] == optimality.ALL] if optimality.ALL in {*table["uavs"]} else table
    means = bounded.missions.groupby("policy", sort=False)[PRODUCT].mean()
    assert rows[GAP].tolist() == pytest.approx((0.9 - means).tolist())


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


def test_the_example_is_the_first_of_the_smallest_fleets_with_a_log(results):
    example = optimality.example(results, "greedy")
    fleets = results.missions.query("policy == 'greedy'")["uavs"].to_numpy()[:LOGGED]
    assert example.replication == int(np.argmin(fleets))


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
