"""The bound of a mission against its exact optimum."""

from itertools import product

import numpy as np
import pytest

from dess import load_scenario, rules, simulate_batch
from dess.analysis.bound import upper_bound
from dess.channel import empty_scratch, world_of
from dess.policies import load
from dess.scenario import ScenarioSpace
from dess.state import State, starts_of, state_of
from tests import compiled
from tests.analysis.bound.tiny_sea import TinySea, contraction

# --- without shadowing: all action sequences, by the rules of the simulator ---


def small(**values: object) -> ScenarioSpace:
    """A lone UAV that flies five slots, without shadowing."""
    world = {"grid": 4, "zone": (1, 1, 1, 1), "nodes": ((0, 1), (3, 2)), "edge_snr": -14.0}
    mission = {"uavs": 1, "quota": 20, "max_slots": 7, "shadowing_variance": 0.0}
    battery = {"flying_time": 3, "charge_start": 10, "charge_complete": 11, "charge_rate": 10}
    return load_scenario("paper", **world | mission | battery | {"initial_data": 6.0} | values)


def optimum(space: ScenarioSpace, seed: int) -> float:
    """The highest collection ratio of all action sequences, arrivals known."""
    uavs = space.uavs[1]
    world, scratch = world_of(space), empty_scratch(uavs, len(space.nodes))
    arrivals = np.empty(len(space.nodes), np.int64)
    state = state_of([space], 1)
    rules.launch(state, 0, starts_of([space], seed), 0, 0)

    def best(before: State) -> float:
        ratios = []
        for actions in product(range(5), repeat=uavs):
            after = State(*(array.copy() for array in before))
            mission = after.missions[0]
            after.uavs[0]["action"] = actions
            arrays = (array[0] for array in after)
            compiled.advance(*arrays, arrivals, *world, *scratch)
            if mission["active"]:
                ratios.append(best(after))
            else:
                ratios.append(mission["collected"] / (mission["initial"] + mission["arrived"]))
            if before.uavs["charging"].all():
                break  # whatever their actions, they hover
        return max(ratios)

    return best(state)


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
    best, bound = optimum(space, 0), upper_bound(space, 0, 0, iterations=30).ratio
    assert best - 1e-12 <= bound <= best + 0.1
    assert bound < 1


def test_a_uav_that_only_hovers_over_its_node_is_bounded_exactly():
    space = small(grid=2, nodes=((0, 0),), zone=(0, 0, 1, 1), arrival_rate=0.0, edge_snr=-30.0,
                  quota=4, initial_data=50.0)  # fmt: skip
    assert optimum(space, 0) == pytest.approx(upper_bound(space, 0, 0, iterations=10).ratio, 1e-5)


def test_the_bound_is_above_the_optimum_where_data_arrive_during_a_charge():
    battery = {"charge_complete": 14, "charge_rate": 2, "max_slots": 12}
    space = small(nodes=((1, 1),), initial_data=1.0, arrival_rate=3.0, **battery)
    assert optimum(space, 0) <= upper_bound(space, 0, 0).ratio


# --- with shadowing: backward induction ---

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


@pytest.mark.parametrize("kind", KINDS)
def test_both_ways_to_the_optimum_agree_without_shadowing(kind):
    values = {"shadowing_variance": 0.0, "initial_data": 8.0, "arrival_rate": 0.5}
    space = shadowed(edge_snr=-14.0, **values, **KINDS[kind])
    assert TinySea(space, 2, contraction(1)).optimum == pytest.approx(optimum(space, 2), 1e-12)


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
        bound = upper_bound(space, 1, 0, iterations=30).ratio
        gaps.append(bound - TinySea(space, 1, contraction(3)).optimum)
    print(f"{kind}: {np.mean(gaps):.3f} above the optimum on average, {max(gaps):.3f} at most")
    assert min(gaps) >= -1e-12
    assert np.mean(gaps) <= 0.2


@pytest.mark.parametrize("values", (KINDS | HOVER).values(), ids=KINDS | HOVER)
def test_the_bound_is_above_the_optimum_where_most_data_arrive_later(values):
    for edge_snr in (-20.0, -12.0):
        space = shadowed(edge_snr=edge_snr, initial_data=1.0, arrival_rate=3.0, **values)
        assert TinySea(space, 1, contraction(3)).optimum <= upper_bound(space, 1, 0).ratio
