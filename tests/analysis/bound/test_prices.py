"""The bound lies above every policy, and what it refuses."""

from collections.abc import Sequence

import numpy as np
import pytest

from dess import load_scenario, policies, simulate_batch
from dess.analysis.bound import upper_bound
from dess.analysis.bound.prices import Bounds, Detail, ceilings_memory, known_of
from dess.base.errors import InputError
from dess.scenario.scenario import ScenarioSpace
from tests.analysis.bound.tiny_sea import TinySea, contraction

TINY = {"grid": 6, "nodes": ((1, 1), (4, 2), (2, 5)), "zone": (2, 1, 2, 2), "max_slots": 60}


def tiny(**values: object) -> ScenarioSpace:
    return load_scenario("paper", **TINY | values)


def check_means(space: ScenarioSpace, names: Sequence[str], missions: int) -> None:
    """The mean of no policy exceeds the mean of the bounds by more than chance explains."""
    bounds = np.array([upper_bound(space, 11, r).ratio for r in range(missions)])
    assert bounds.max() < 1  # otherwise the test could not fail
    for name in names:
        records = simulate_batch(space, policies.load(name), 11, missions).missions
        above = records["collection_ratio"] - bounds
        assert above.mean() <= 4 * above.std(ddof=1) / missions**0.5, name
        assert space.shadowing_variance or above.max() <= 1e-12, name


@pytest.mark.parametrize("variance", [0.0, 2.0])
def test_no_policy_has_a_higher_mean_on_a_tiny_sea(variance):
    """Nor, where nothing is left to chance, a higher ratio in any mission."""
    battery = {"flying_time": 8, "charge_start": 10, "charge_complete": 30}
    sea = {"quota": 40, "initial_data": (200.0, 300.0), "shadowing_variance": variance}
    space = tiny(uavs=(1, 4), **sea, **battery)
    check_means(space, ["random", "nearest", "greedy", "tour", "planner"], 20)


def test_the_optimum_is_reached_where_hovering_is_best():
    """A lone UAV that need not charge; all replications are one mission, but for the shadowing."""
    sea = {"grid": 3, "zone": (1, 1, 1, 1), "nodes": ((1, 1), (0, 1)), "uavs": 1, "quota": 3}
    battery = {"flying_time": 40, "charge_start": 10, "charge_complete": 50}
    link = {"communication_slots": 1, "edge_snr": 0.0, "shadowing_variance": 100.0}
    data = {"initial_data": 1000.0, "arrival_rate": 0.0, "max_slots": 3}
    space = load_scenario("paper", **sea | battery | link | data)
    missions = simulate_batch(space, policies.load("greedy"), 3, 4000).missions
    ratios = missions["collection_ratio"]
    best = TinySea(space, 3, contraction(12)).optimum
    assert ratios.mean() == pytest.approx(best, abs=4 * ratios.std() / len(ratios) ** 0.5)
    assert best <= upper_bound(space, 3, 0).ratio <= 1.01 * best


@pytest.mark.slow
@pytest.mark.parametrize(("uavs", "quota"), [(1, 440), (2, 160), (3, 100), (4, 80)])
def test_no_policy_has_a_higher_mean_in_the_paper(uavs, quota):
    """With longer quotas, two or more UAVs have the bound 1."""
    space = load_scenario("paper", uavs=uavs, quota=quota)
    check_means(space, ["greedy", "ddqn", "planner"], 12)


def test_the_same_mission_has_the_same_bound():
    first, second = (upper_bound(tiny(), 5, 2, iterations=4) for _ in range(2))
    assert first.ratio == second.ratio
    assert first.prices.tobytes() == second.prices.tobytes()


def test_sections_beyond_the_paper_are_refused():
    with pytest.raises(InputError, match="bound: the scenario has sections"):
        upper_bound(tiny(**{"wind.strength": 0.5}), 0, 0)


def test_a_mission_that_takes_too_much_memory_is_refused():
    with pytest.raises(InputError, match=r"takes 5\.\d GiB of memory"):
        upper_bound(load_scenario("paper", uavs=1, grid=128), 0, 0)


@pytest.mark.parametrize("values", [{}, {"flight_cost": 0}, {"nodes": ((1, 1),)}])
def test_no_mission_takes_more_memory_than_was_expected(values):
    battery = {"flying_time": (4, 20), "charge_start": (10, 12), "charge_complete": (14, 30)}
    space = tiny(quota=160, **battery | values)
    most = ceilings_memory(space, Detail())
    used = [Bounds(known_of(space, 5, r), Detail()).ceilings.nbytes for r in range(20)]
    assert max(used) <= most <= 3 * max(used)
