"""The bound of a mission against its exact optimum."""

from itertools import product

import numpy as np
import pytest

from dess import load_scenario, simulate_batch
from dess.analysis.bound import upper_bound
from dess.policies import load
from dess.scenario import ScenarioSpace
from tests.analysis.bound.tiny_sea import TinySea, contraction, gap_of

# --- without shadowing ---


def small(**values: object) -> ScenarioSpace:
    """A lone UAV that flies five slots, without shadowing."""
    world = {"grid": 4, "zone": (1, 1, 1, 1), "nodes": ((0, 1), (3, 2)), "edge_snr": -14.0}
    mission = {"uavs": 1, "quota": 20, "max_slots": 7, "shadowing_variance": 0.0}
    battery = {"flying_time": 3, "charge_start": 10, "charge_complete": 11, "charge_rate": 10}
    return load_scenario("paper", **world | mission | battery | {"initial_data": 6.0} | values)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"arrival_rate": 0.3},
        {"initial_data": (5.0, 20.0)},
        {"nodes": ((0, 1), (3, 2), (0, 3))},
        {"flight_cost": 0},
        {"edge_snr": -20.0},
    ],
    ids=["two nodes", "many arrivals", "drawn data", "three nodes", "no battery", "far apart"],
)
def test_the_bound_is_above_the_optimum_and_near_it(values):
    space = small(**values)
    assert gap_of(space, 0) <= 0.1
    assert upper_bound(space, 0, 0).ratio < 1


def test_a_uav_that_only_hovers_over_its_node_is_bounded_exactly():
    space = small(grid=2, nodes=((0, 0),), zone=(0, 0, 1, 1), arrival_rate=0.0, edge_snr=-30.0,
                  quota=4, initial_data=50.0)  # fmt: skip
    assert gap_of(space, 0) == pytest.approx(0, abs=1e-5)


def test_the_bound_is_above_the_optimum_where_data_arrive_during_a_charge():
    battery = {"charge_complete": 14, "charge_rate": 2, "max_slots": 12}
    gap_of(small(nodes=((1, 1),), initial_data=1.0, arrival_rate=3.0, **battery), 0)


# --- with shadowing ---

TWO, THREE = ((0, 1), (2, 2)), ((0, 1), (2, 2), (2, 0))
KINDS = {
    "a lone UAV, two nodes": {"nodes": TWO, "max_slots": 4},
    "a lone UAV, three nodes": {"nodes": THREE, "max_slots": 3},
    "two communication slots per slot": {"nodes": TWO, "communication_slots": 2, "quota": 6},
    "two UAVs": {"nodes": THREE, "max_slots": 2, "uavs": 2, "zone": (1, 1, 2, 1)},
}
HOVER = {"a lone UAV over its node": {"nodes": ((1, 1),), "max_slots": 4}}


def shadowed(**values: object) -> ScenarioSpace:
    """UAVs that, if nothing else is said, fly all slots of a mission and do not charge."""
    space = {"grid": 3, "zone": (1, 1, 1, 1), "uavs": 1, "communication_slots": 1, "max_slots": 3}
    battery = {"flying_time": 40, "charge_start": 10, "charge_complete": 50}
    quota = {"quota": values.get("max_slots", 3)}
    return load_scenario("paper", **space | battery | quota | values)


def test_the_optimum_is_reached_where_hovering_is_best():
    """Every replication is the same mission, but for the shadowing."""
    space = shadowed(
        nodes=((1, 1), (0, 1)), edge_snr=0.0, shadowing_variance=100.0, initial_data=1000.0,
        arrival_rate=0.0,
    )  # fmt: skip
    ratios = simulate_batch(space, load("greedy"), 3, 4000).missions["collection_ratio"]
    best = TinySea(space, 3, contraction(24)).optimum
    assert ratios.mean() == pytest.approx(best, abs=4 * ratios.std() / len(ratios) ** 0.5)
    assert best <= upper_bound(space, 3, 0).ratio <= 1.01 * best


@pytest.mark.parametrize("kind", KINDS)
def test_the_bound_is_above_the_optimum_with_shadowing(kind):
    gaps = []
    for edge_snr, variance, data in product((-20.0, -12.0), (4.0, 25.0), (8.0, (0.0, 30.0))):
        space = shadowed(
            edge_snr=edge_snr, shadowing_variance=variance, initial_data=data, arrival_rate=0.3,
            **KINDS[kind],
        )  # fmt: skip
        gaps.append(gap_of(space, 1, 3))
    assert np.mean(gaps) <= 0.2


@pytest.mark.parametrize("values", (KINDS | HOVER).values(), ids=KINDS | HOVER)
def test_the_bound_is_above_the_optimum_where_most_data_arrive_later(values):
    for edge_snr in (-20.0, -12.0):
        gap_of(shadowed(edge_snr=edge_snr, initial_data=1.0, arrival_rate=3.0, **values), 1, 3)
