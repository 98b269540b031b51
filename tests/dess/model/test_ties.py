"""Nodes at equal distances tie exactly, whatever they are computed from: the lowest index wins."""

import numpy as np
import pytest

from dess import policies, simulate
from dess.model import channel
from dess.model.state import constants_of
from dess.policies.planner import rates
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.flights import flown, rows_of

CELLS = [[x, y] for x in range(13) for y in range(13)]
SEA = {
    **{"grid": 13, "zone": [5, 5, 3, 3], "shadowing_variance": 0.0},
    **{"initial_data": 1000.0, "arrival_rate": 0.0, "max_slots": 60},
}


def _sea(slots: int, nodes: list[list[int]]) -> ScenarioSpace:
    return ScenarioSpace.model_validate(SEA | {"communication_slots": slots, "nodes": nodes})


@pytest.mark.parametrize("slots", [3, 5, 6])
def test_of_nodes_at_the_same_distance_the_first_is_served(slots):
    policy, ties = policies.load("random-unguarded"), 0
    for seed in range(12):
        space = _sea(slots, np.random.default_rng(seed).permutation(CELLS)[:12].tolist())
        nodes = slots * np.array(space.nodes)
        for event in simulate(space, policy, seed, events=True).events:
            if event.event == "communication":
                place = np.rint(slots * np.array([event.x, event.y])).astype(int)
                squares = ((nodes - place) ** 2).sum(1)  # integers
                ties += (squares == squares.min()).sum() > 1
                assert event.node == squares.argmin(), (event.x, event.y)
    assert ties > 100


def test_of_nodes_on_a_circle_the_first_with_data_is_served():
    """The search draws eight nodes at a time, and the circle has twelve."""
    lattice = range(-5, 6)
    circle = [[6 + x, 6 + y] for x in lattice for y in lattice if x**2 + y**2 == 25]
    alone = {"zone": [6, 6, 1, 1], "uavs": 1, "flying_time": 80, "initial_data": 1e-3}
    space = ScenarioSpace.model_validate(SEA | alone | {"nodes": circle})
    served = rows_of(flown(space, "")[1], "communication", "node")
    assert served == [*range(12)]


@pytest.mark.parametrize("slots", [3, 4, 5, 7])
def test_the_planner_expects_the_same_rate_at_the_same_distance(slots):
    space = ScenarioSpace.model_validate({"communication_slots": slots})
    snr = channel.world_of(space).mean_snr
    table = rates._mean_rate(snr, constants_of(space)[0])
    coarse, fine = np.indices(snr.shape)
    places = np.unique((slots * coarse) ** 2 + fine**2, return_inverse=True)[1].ravel()
    for values in (snr.ravel(), table.ravel()):
        first = np.zeros(places.max() + 1)
        first[places] = values
        assert (first[places] == values).all()
