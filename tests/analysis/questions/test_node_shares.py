"""How a team shares out the nodes, on layouts worked by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.questions import node_shares
from dess import load_scenario, simulate
from policies import load_team

SQUARE = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])
PAPER = np.array([(x, y) for y in (6, 11, 16, 21, 26) for x in (3, 8, 13, 18, 23)])

EVENTS = {
    "event": ["mission_start", "mission_start", "mission_start", "communication", "arrival"]
    + ["communication", "communication"],
    "uav": [0, -1, -1, 0, -1, 1, 1],
    "node": [-1, 0, 1, 0, 1, 0, 1],
    "value": [80.0, 6.0, 4.0, 2.0, 1.0, 1.5, 1.0],
}


def test_what_is_collected_and_held() -> None:
    """The battery at the start is no data."""
    assert node_shares.collected(EVENTS, 2, 2).tolist() == [[2.0, 0.0], [1.5, 1.0]]
    assert node_shares.held(EVENTS, 2).tolist() == [6.0, 5.0]
    assert node_shares.left_behind(EVENTS, 2).tolist() == [False, True]  # 3.5 of 6, 1 of 5


def test_a_mission_is_accounted_for() -> None:
    scenario = load_scenario("fig4").scenario_at(
        uavs=2, flying_time=80, charge_start=30, charge_complete=80
    )
    record = simulate(scenario, load_team("greedy"), 1, 0, events=True)
    assert record.events is not None
    log = record.events.columns()
    data, nodes = node_shares.collected(log, 2, 25), len(scenario.nodes)
    assert data.sum(axis=1) == pytest.approx(record.uavs["collected"])
    assert node_shares.held(log, nodes).sum() == pytest.approx(record.initial + record.arrived)


def test_the_far_edges_of_the_paper() -> None:
    far = node_shares.far_edges(PAPER)
    assert sorted(map(tuple, PAPER[far])) == sorted(
        {(3, y) for y in (6, 11, 16, 21, 26)} | {(x, 26) for x in (3, 8, 13, 18, 23)}
    )


def test_division() -> None:
    assert node_shares.division(np.array([[3, 0], [0, 5]])) == 1
    assert node_shares.division(np.array([[3, 5], [3, 5]])) == 0.5
    assert node_shares.division(np.array([[4, 1], [0, 3]])) == 7 / 8
    assert np.isnan(node_shares.division(np.zeros((2, 2))))


@pytest.mark.parametrize(
    ("first", "second", "share"),
    [
        ([1, 0, 1, 0], [0, 1, 0, 1], 1.0),  # left and right
        ([1, 1, 0, 0], [0, 0, 1, 1], 1.0),  # top and bottom
        ([1, 0, 0, 0], [0, 1, 1, 1], 1.0),  # a corner
        ([1, 0, 0, 1], [0, 1, 1, 0], 0.75),  # crosswise: a line leaves one on the wrong side
        ([4, 0, 0, 1], [0, 3, 2, 0], 0.9),  # that one is the least
        ([1, 1, 1, 1], [1, 1, 1, 1], 0.5),
        ([5, 1, 0, 0], [0, 0, 0, 0], 1.0),  # all on one side
    ],
)
def test_sectors(first: list[int], second: list[int], share: float) -> None:
    assert node_shares.sectors(np.array([first, second]), SQUARE) == pytest.approx(share)
    assert node_shares.sectors(np.array([second, first]), SQUARE) == pytest.approx(share)


def test_sectors_of_no_data_and_of_one_node() -> None:
    assert np.isnan(node_shares.sectors(np.zeros((2, 4)), SQUARE))
    assert node_shares.sectors(np.array([[3.0], [1.0]]), SQUARE[:1]) == 0.75


@given(st.floats(0, 2 * np.pi), st.floats(-12, 12))
def test_any_straight_line_makes_sectors(angle: float, offset: float) -> None:
    """Whatever way it runs, also beside the rows and columns of the paper's grid."""
    one = (PAPER - (13, 16)) @ (np.cos(angle), np.sin(angle)) < offset
    data = np.array([one, ~one], float)
    assert node_shares.sectors(data, PAPER) == pytest.approx(1)
