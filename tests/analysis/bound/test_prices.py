"""The bound lies above every policy, and what it refuses."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dess import load_scenario, policies, simulate_batch
from dess.analysis.bound import upper_bound
from dess.analysis.bound.prices import Bounds, Detail, ceilings_memory, known_of
from dess.errors import InputError
from dess.scenario import ScenarioSpace

TINY = {"grid": 6, "nodes": ((1, 1), (4, 2), (2, 5)), "zone": (2, 1, 2, 2), "max_slots": 60}


def tiny(**values: object) -> ScenarioSpace:
    return load_scenario("paper", **TINY | values)


@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    uavs=st.integers(1, 4),
    quota=st.integers(1, 120),
    flying_time=st.integers(1, 40),
    charge=st.tuples(st.integers(10, 30), st.integers(1, 30)),
    arrival_rate=st.sampled_from([0.0, 0.02, 0.5]),
    initial=st.sampled_from([0.0, 3.0, (5.0, 20.0)]),
    edge_snr=st.sampled_from([-25.0, 0.0, 10.0]),
    flight_cost=st.integers(0, 1),
    policy=st.sampled_from(["greedy", "nearest", "tour", "random", "planner"]),
    seed=st.integers(0, 2**32),
)
def test_no_policy_collects_more_without_shadowing(
    uavs, quota, flying_time, charge, arrival_rate, initial, edge_snr, flight_cost, policy, seed
):
    space = tiny(
        uavs=uavs, quota=quota, flying_time=flying_time, charge_start=charge[0],
        charge_complete=sum(charge), arrival_rate=arrival_rate, initial_data=initial,
        edge_snr=edge_snr, flight_cost=flight_cost, shadowing_variance=0.0,
    )  # fmt: skip
    ratio = simulate_batch(space, policies.load(policy), seed).missions["collection_ratio"][0]
    assert ratio - 1e-12 <= upper_bound(space, seed, 0, iterations=3).ratio


def test_a_uav_that_comes_back_to_a_node_collects_no_more():
    """It must charge every few slots, in the block of another node."""
    space = load_scenario(
        "paper", grid=8, nodes=((1, 4), (3, 4)), zone=(1, 4, 1, 1), uavs=1, quota=60,
        communication_slots=1, flying_time=12, charge_start=11, charge_complete=14, edge_snr=-25.0,
        initial_data=(1.0, 1000.0), arrival_rate=0.0, shadowing_variance=0.0,
    )  # fmt: skip
    ratio = simulate_batch(space, policies.load("planner"), 5).missions["collection_ratio"][0]
    assert ratio <= upper_bound(space, 5, 0).ratio < 1


def check_means(space: ScenarioSpace, names: Sequence[str], missions: int) -> None:
    """The mean of no policy exceeds the mean of the bounds by more than chance explains."""
    bounds = np.array([upper_bound(space, 11, r).ratio for r in range(missions)])
    assert bounds.max() < 1  # otherwise the test could not fail
    for name in names:
        records = simulate_batch(space, policies.load(name), 11, missions).missions
        above = records["collection_ratio"] - bounds
        assert above.mean() <= 4 * above.std(ddof=1) / missions**0.5, name


def test_no_policy_has_a_higher_mean_on_a_tiny_sea():
    battery = {"flying_time": 8, "charge_start": 10, "charge_complete": 30}
    space = tiny(uavs=(1, 4), quota=40, initial_data=(200.0, 300.0), **battery)
    check_means(space, ["random", "nearest", "greedy", "tour", "planner"], 20)


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
    with pytest.raises(InputError, match=r"takes 5\.\d GiB of memory; allowed: 4 GiB"):
        upper_bound(load_scenario("paper", uavs=1, grid=128), 0, 0)


@pytest.mark.parametrize("values", [{}, {"flight_cost": 0}, {"nodes": ((1, 1),)}])
def test_no_mission_takes_more_memory_than_was_expected(values):
    battery = {"flying_time": (4, 20), "charge_start": (10, 12), "charge_complete": (14, 30)}
    space = tiny(quota=160, **battery | values)
    most = ceilings_memory(space, Detail())
    used = [Bounds(known_of(space, 5, r), Detail()).ceilings.nbytes for r in range(20)]
    assert max(used) <= most <= 3 * max(used)
