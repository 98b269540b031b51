"""Figures of the gap, and of a planner beside a learner, show the numbers of their tables."""

import numpy as np
import pandas as pd
import pytest

from analysis.figures import optimality
from analysis.names import BOUND, GAP, PRODUCT
from analysis.questions.missions import LoggedMission
from dess import load_scenario, simulate
from dess.state import sample_scenario
from policies import load
from policies.planner import Course

PAPER = load_scenario("paper")


def gap_rows() -> pd.DataFrame:
    """Rows as of ``gap.by_fleet``: two policies, one and two UAVs, and all."""
    rows = pd.DataFrame(
        [(uavs, policy) for uavs in (1, 2, "all") for policy in ("one", "two")],
        columns=["uavs", "policy"],
    )
    for number, metric in enumerate((PRODUCT, BOUND, GAP)):
        rows[metric] = 0.3 * number + np.linspace(0.1, 0.2, len(rows))
        rows[f"{metric}_low"], rows[f"{metric}_high"] = rows[metric] - 0.02, rows[metric] + 0.01
    return rows.assign(n=100)


def test_a_panel_per_fleet_shows_products_and_the_bound() -> None:
    table = gap_rows()
    figure = optimality.gaps(table)
    assert len(figure.axes) == 2
    for ax, uavs in zip(figure.axes, (1, 2), strict=True):
        rows = table[table["uavs"] == uavs]
        bars = [bar.lines[0].get_xdata()[0] for bar in ax.containers]
        assert bars == pytest.approx(rows[PRODUCT])
        (bound,) = (line for line in ax.lines if line.get_label() == "upper bound")
        assert bound.get_xdata()[0] == rows[BOUND].iloc[0]
        assert [label.get_text() for label in ax.get_yticklabels()] == ["one", "two"]
    assert figure.axes[1].get_title(loc="left").startswith("2 UAVs: bound")


def test_differences_are_beside_each_other_by_fleet() -> None:
    table = pd.DataFrame(
        {"policy": ["a", "a", "b", "b"], "uavs": [1, "all"] * 2, "baseline": "c"}
        | {"difference": [0.1, 0.2, 0.3, 0.4], "low": 0.0, "high": 0.5}
    )
    (ax,) = optimality.differences(table).axes
    drawn = [bar.lines[0].get_ydata().tolist() for bar in ax.containers]
    assert drawn == [[0.1, 0.2], [0.3, 0.4]]
    assert [label.get_text() for label in ax.get_xticklabels()] == ["1 UAV", "all"]
    assert ax.get_title(loc="left") == "Difference from c"


def test_the_front_goes_through_policies_that_are_not_dominated() -> None:
    table = pd.DataFrame(
        {"policy": ["a", "b", "c"], "seconds": [1e-5, 1e-4, 1e-3], "mean": [0.5, 0.4, 0.9]}
        | {"low": 0.3, "high": 0.95, "on_front": [True, False, True]}
    )
    (ax,) = optimality.front(table, 0.97).axes
    (line,) = (line for line in ax.lines if line.get_label() == "Pareto front")
    assert (list(line.get_xdata()), list(line.get_ydata())) == ([1e-5, 1e-3], [0.5, 0.9])
    (bound,) = (line for line in ax.lines if line.get_label() == "upper bound")
    assert set(bound.get_ydata()) == {0.97}
    assert len(ax.containers) == 3


def test_maps_of_coverage_show_both_shares_and_the_difference() -> None:
    one, two = np.linspace(0, 1, 25), np.full(25, 0.5)
    maps = optimality.coverage(PAPER, {"one": one, "two": two})
    assert [*maps] == ["Collected by one", "Collected by two", "one − two"]
    texts = [[text.get_text() for text in figure.axes[0].texts] for figure in maps.values()]
    assert texts[0][:2] == ["0", "4"] and {*texts[1]} == {"50"}
    assert (texts[2][0], texts[2][12], texts[2][24]) == ("−50", "0", "+50")


def test_the_share_at_home_is_a_line_per_policy() -> None:
    table = pd.DataFrame({"policy": ["a"] * 2 + ["b"] * 2, "slot": [0, 1] * 2})
    (ax,) = optimality.at_home(table.assign(share=[1.0, 0.5, 1.0, 0.0])).axes
    assert [line.get_ydata().tolist() for line in ax.lines] == [[1.0, 0.5], [1.0, 0.0]]


def test_the_plan_is_drawn_over_the_mission() -> None:
    record = simulate(load_scenario("paper", uavs=1), load("greedy"), 3, 1, events=True)
    log = pd.DataFrame(record.events.columns())
    scenario = sample_scenario(load_scenario("paper", uavs=1), 3, 1)
    mission = LoggedMission(pd.Series(), pd.DataFrame(), scenario, log)
    course = Course(np.array([[8, 10]]), np.array([2]), np.array([[26, 5], [25, 5], [24, 5]]))
    figure = optimality.plan(mission, [course])
    (line,) = (line for line in figure.axes[0].lines if line.get_gid() == "plan-0")
    assert np.array_equal(line.get_xydata(), course.path)
    assert "1" in [text.get_text() for text in figure.axes[0].texts if tuple(text.xy) == (8, 10)]


def test_prices_are_written_at_the_nodes() -> None:
    values = np.linspace(0, 0.96, 25)
    (ax,) = optimality.prices(PAPER, values).axes
    assert [text.get_text() for text in ax.texts] == [f"{value:.2f}" for value in values]
    assert [text.xy for text in ax.texts] == [*PAPER.nodes]
