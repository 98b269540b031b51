"""The bound of one mission against the optimum of all action sequences, and its derivatives."""

import numpy as np
import pytest

from analysis.bound.paths import blocks_of
from analysis.bound.prices import Bounds, Detail, improve, known_of, upper_bound
from dess import load_scenario, rules
from dess.channel import empty_scratch, world_of
from dess.scenario import ScenarioSpace
from dess.state import State, constants_of, empty_state, ranges_of, types_of


def small(**values: object) -> ScenarioSpace:
    """A lone UAV that flies five slots, without shadowing."""
    world = {"grid": 4, "zone": (1, 1, 1, 1), "nodes": ((0, 1), (3, 2)), "edge_snr": -14.0}
    mission = {"uavs": 1, "quota": 20, "max_slots": 7, "shadowing_variance": 0.0}
    battery = {"flying_time": 3, "charge_start": 10, "charge_complete": 11, "charge_rate": 10}
    return load_scenario("paper", **world | mission | battery | {"initial_data": 6.0} | values)


def optimum(space: ScenarioSpace, seed: int) -> float:
    """The highest collection ratio of all action sequences, arrivals known."""
    world, scratch = world_of(space), empty_scratch(1, len(space.nodes))
    arrivals = np.empty(len(space.nodes), np.int64)
    state = empty_state(1, 1, len(space.nodes))
    state.missions[:] = constants_of(space)
    state.missions["seed"] = seed
    rules.launch(state.missions[0], ranges_of(space), types_of(space), *(a[0] for a in state[1:]))

    def best(before: State) -> float:
        ratios = []
        for action in range(5):
            after = State(*(array.copy() for array in before))
            mission, uav = after.missions[0], after.uavs[0, 0]
            uav["action"] = action
            arrays = (array[0] for array in after)
            rules.advance(*arrays, arrivals, *world, *scratch)
            if mission["active"]:
                ratios.append(best(after))
            else:
                ratios.append(mission["collected"] / (mission["initial"] + mission["arrived"]))
            if before.uavs[0, 0]["charging"]:
                break  # whatever its action, it hovers
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
def test_the_bound_is_above_the_optimum_and_near_it(values: dict) -> None:
    space = small(**values)
    best, bound = optimum(space, 0), upper_bound(space, 0, 0, iterations=30).ratio
    assert best - 1e-12 <= bound <= best + 0.1
    assert bound < 1


def test_a_uav_that_only_hovers_over_its_node_is_bounded_exactly() -> None:
    space = small(grid=2, nodes=((0, 0),), zone=(0, 0, 1, 1), arrival_rate=0.0, edge_snr=-30.0,
                  quota=4, initial_data=50.0)  # fmt: skip
    assert optimum(space, 0) == pytest.approx(upper_bound(space, 0, 0, iterations=10).ratio, 1e-5)


def test_the_block_before_is_a_neighbour() -> None:
    nodes = np.array([[1, 1], [4, 1], [1, 4]])
    blocks = blocks_of(nodes, 6, 4, np.array([0, 2]))
    assert blocks.home[0, 0] == 0
    assert blocks.home[5, 0] == 1
    assert {*blocks.near[0]} - {-1} == {1, 2}
    assert all(
        blocks.near[k, blocks.place[k, j]] == j for k in range(3) for j in blocks.near[k] if j >= 0
    )


def paper_like(**values: object) -> ScenarioSpace:
    """A lone UAV that flies 15 slots over nine nodes and must charge once."""
    nodes = tuple((x, y) for x in (1, 4, 7) for y in (1, 4, 7))
    battery = {"flying_time": 11, "charge_start": 10, "charge_complete": 13, "charge_rate": 5}
    space = {"grid": 9, "nodes": nodes, "zone": (3, 3, 2, 2), "quota": 60, "edge_snr": -15.0}
    return load_scenario("paper", uavs=1, **space | battery | values)


def test_the_derivatives_are_those_of_the_bound() -> None:
    bounds = Bounds(known_of(paper_like(), 4, 0), Detail())
    generator = np.random.default_rng(0)
    prices = generator.uniform(0, 0.4, (2, 9))
    _, slope = bounds.at(prices)
    step = 1e-6 * generator.normal(size=prices.shape)
    change = bounds.at(prices + step)[0] - bounds.at(prices - step)[0]
    assert change == pytest.approx(2 * (slope * step).sum(), rel=1e-3)


def test_every_refinement_lowers_the_bound_at_the_same_prices() -> None:
    known = known_of(paper_like(), 4, 0)
    prices = np.full((1, 9), 0.3)
    coarse = Detail(cuts=(), local=(0.0,), levels=(0,))
    finer = coarse._replace(local=(0.0, 0.5, 1.0))
    finest = finer._replace(levels=(0, 1, 2))
    found = [Bounds(known, detail).at(prices)[0] for detail in (coarse, finer, finest)]
    assert found[0] > found[1] > found[2]


def test_a_cut_without_a_price_changes_nothing() -> None:
    known = known_of(paper_like(), 4, 0)
    prices = np.full((1, 9), 0.3)
    one = Bounds(known, Detail(cuts=())).at(prices)[0]
    two = Bounds(known, Detail(cuts=(0.5,))).at(np.vstack([np.zeros((1, 9)), prices]))[0]
    assert one == pytest.approx(two, 1e-12)


def test_more_iterations_never_raise_the_bound() -> None:
    known = known_of(paper_like(), 4, 0)
    ratios = [improve(known, iterations, Detail()).ratio for iterations in (0, 1, 5, 15)]
    assert ratios[0] == 1
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[-1] < ratios[1]
