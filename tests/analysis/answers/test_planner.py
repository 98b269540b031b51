"""A planner beside a learner: differences, and what each collects, plans and would pay."""

from dataclasses import replace

import numpy as np
import pytest

from dess.analysis import run_study
from dess.analysis.answers import planner
from dess.analysis.bound import Bound
from dess.analysis.execution import jobs
from dess.analysis.figures import style
from dess.analysis.results.event_log import uav_slots
from dess.analysis.stats.verdict import ABOVE, INCONCLUSIVE, SEEN_ABOVE
from dess.policies.planner import Budget, Planner
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


def test_the_answer_says_which_is_better(results):
    table = planner.compare_with_learner(results, ["greedy"], "random")
    cases = {"planner is": (0.1, 0.2), "learner is": (-0.2, -0.1), "missions do": (-0.1, 0.1)}
    for said, ends in cases.items():
        given = table.assign(low=ends[0], high=ends[1], difference=sum(ends) / 2)
        sentence, number = planner.planner_sentences(given, "greedy")
        assert sentence.startswith(f"The {said}")
        assert bool(number) == (said != "missions do")  # nothing inconclusive is a headline


def test_coverage_is_what_the_logs_say_was_collected(results):
    shares = []
    for replication in range(LOGGED):
        log = results.events("greedy", 0, replication)
        by_node = log[log["node"] >= 0].groupby(["event", "node"])["value"].sum()
        had = by_node["mission_start"].add(by_node.get("arrival", 0.0), fill_value=0.0)
        shares.append(by_node["communication"].reindex(range(3), fill_value=0.0) / had)
    expected = np.mean(shares, axis=0)
    found = planner.collected_shares(results, "greedy")
    np.testing.assert_allclose(found.mean(axis=0), expected)
    assert 0 < expected.min() <= expected.max() <= 1


def test_few_missions_show_few_differences_of_nodes():
    """At the first node by far, at the second one in what was seen, at the last ones not at all."""
    noise = np.random.default_rng(3).normal(0, 0.02, (60, 4))
    others = np.full((60, 4), 0.3)
    shares = others + [0.5, 0.02, 0.0, 0.0] + noise
    verdicts = planner.judge_nodes(shares, others)
    assert verdicts.tolist() == [ABOVE, SEEN_ABOVE, INCONCLUSIVE, INCONCLUSIVE]
    assert ABOVE not in planner.judge_nodes(shares[:10], others[:10])[1:]


def test_maps_of_few_missions_have_pale_colours_or_none(results):
    ours, theirs, change = planner.draw_coverage(results, "greedy", "random")
    shares = [planner.collected_shares(results, policy) for policy in ("greedy", "random")]
    for drawing, of_policy in zip((ours, theirs), shares, strict=True):
        (nodes,) = (
            part for part in drawing.figure.axes[0].collections if part.get_array() is not None
        )
        np.testing.assert_allclose(nodes.get_array(), style.PALE * of_policy.mean(axis=0))
        assert "The 95 % interval of a node reaches up to" in drawing.caption
    verdicts = planner.judge_nodes(*shares)
    assert SEEN_ABOVE in verdicts and INCONCLUSIVE in verdicts
    (nodes,) = (part for part in change.figure.axes[0].collections if part.get_array() is not None)
    depth = [{SEEN_ABOVE: style.PALE, INCONCLUSIVE: 0.0}[verdict] for verdict in verdicts]
    expected = depth * (shares[0] - shares[1]).mean(axis=0)
    np.testing.assert_allclose(nodes.get_array(), expected)
    more = list(verdicts).count(SEEN_ABOVE)
    assert f"greedy collects more from {more} and less from 0 of 3 nodes" in change.caption
    assert "Pale: in what was seen; a rare failure is not ruled out." in change.caption


def test_the_share_at_home_is_that_of_uavs_in_the_zone(results):
    """The zone has the cells x 5..7, y 0..1."""
    table = planner.at_home(results, ["greedy"]).data.set_index("slot")
    inside = total = 0
    for replication in range(LOGGED):
        slots = uav_slots(results.events("greedy", 0, replication)).query("slot == 2")
        inside += ((slots["x"] >= 5) & (slots["y"] <= 1)).sum()
        total += len(slots)
    assert table.loc[2, ["share", "n"]].tolist() == pytest.approx([inside / total, total])


def test_the_example_is_the_first_of_the_smallest_fleets_with_a_log(results):
    example = planner.first_logged_mission(results, "greedy")
    fleets = results.missions.query("policy == 'greedy'")["uavs"].to_numpy()[:LOGGED]
    assert example.replication == int(np.argmin(fleets))


def test_the_price_of_a_node_is_the_sum_over_cuts(results):
    np.testing.assert_allclose(planner.node_prices(results, 7), [0.17, 0.27, 0.37])


def test_the_plan_begins_where_the_uavs_start(results, monkeypatch):
    monkeypatch.setattr(Planner, "budget", Budget(500, 0))
    mission = planner.first_logged_mission(results, "greedy")
    planned = replace(mission, policy="planner")
    (ax,) = planner.draw_plan(results, planned).figure.axes
    ways = [line.get_xydata() for line in ax.lines if "plan" in str(line.get_gid())]
    log = mission.events
    starts = log[(log["event"] == "mission_start") & (log["uav"] >= 0)]
    assert [way[0].tolist() for way in ways] == starts[["x", "y"]].to_numpy().tolist()
    cells = np.array([text.xy for text in ax.texts if text.get_position() == (6, 6)])
    assert len(cells) and cells.min() >= 0 and cells.max() < 8
    unplanned = planner.draw_plan(results, mission)
    assert not any("plan" in str(line.get_gid()) for line in unplanned.figure.axes[0].lines)
