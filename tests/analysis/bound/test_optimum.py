"""The bound of a mission against its exact optimum: without and with charges, and on any seas."""

from collections.abc import Iterable, Iterator
from itertools import islice, product

import numpy as np
import pytest

from dess import load_scenario
from dess.analysis.bound import upper_bound
from dess.base.errors import InputError
from dess.scenario.scenario import ScenarioSpace
from tests.analysis.bound.tiny_sea import TinySea, bound_of_data, check, contraction, gap_of

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


def shadowed(**values: object) -> ScenarioSpace:
    """UAVs that, if nothing else is said, fly all slots of a mission and do not charge."""
    space = {"grid": 3, "zone": (1, 1, 1, 1), "uavs": 1, "communication_slots": 1, "max_slots": 3}
    battery = {"flying_time": 40, "charge_start": 10, "charge_complete": 50}
    quota = {"quota": values.get("max_slots", 3)}
    return load_scenario("paper", **space | battery | quota | values)


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


# --- with charges, where missions end by quota or are cut ---


def battery(start: int, low: int, full: int, rate: int, **values: object) -> dict:
    limits = {"flying_time": start, "charge_start": low, "charge_complete": full}
    return limits | {"charge_rate": rate} | values


# With values of max_slots: one that leaves time to fill the quota, and some that cut off the
# mission, most of them during a charge.
BATTERIES = [
    # No battery decrease.
    (battery(10, 10, 18, 1, flight_cost=0, quota=4), (20, 9, 7)),
    # No flight before the charge.
    (battery(2, 10, 12, 1, quota=4), (16, 12, 6)),
    (battery(2, 10, 12, 5, quota=4), (10, 5, 3)),  # a short charge
    (battery(12, 11, 14, 1, quota=4), (12, 6)),  # not low at first
    (battery(3, 10, 11, 1, quota=5), (20, 12, 7)),  # up to the next percent
    (battery(11, 10, 11, 1, quota=4), (7, 4)),  # one percent
    # Half a slot left.
    (battery(2, 10, 12, 5, quota=5, communication_slots=2), (9, 4)),
]
CASES = [values | {"max_slots": end} for values, ends in BATTERIES for end in ends]

CORNER = {"zone": (0, 0, 1, 1), "nodes": ((0, 0),), "edge_snr": -30.0}
PLENTY = {"grid": 2, "initial_data": 300.0, "arrival_rate": 0.0} | CORNER
FAR = PLENTY | {"nodes": ((1, 1),), "edge_snr": -40.0}
PAIR = {"grid": 2, "initial_data": 60.0, "arrival_rate": 0.2} | CORNER | {"nodes": ((0, 0), (1, 1))}
SEAS = {
    "a node with plenty": PLENTY,
    "two nodes": PAIR,
    "two nodes beside the zone": {
        **{"nodes": TWO, "edge_snr": -30.0, "arrival_rate": 0.2, "initial_data": 20.0},
    },
    # Here a UAV that charges finds more of what it can reach.
    "a node out of reach": {
        **{"grid": 10, "zone": (0, 0, 1, 1), "nodes": ((0, 0), (9, 9)), "edge_snr": -40.0},
        **{"arrival_rate": 1.0, "initial_data": (0.0, 40.0)},
    },
}

# A UAV flies as long as it can between its charges, and comes back on its last percent.
FULL_TRIPS = [
    pytest.param(battery(2, 10, 11, 1, quota=22, max_slots=60), id="one percent"),
    pytest.param(
        battery(2, 10, 13, 13, quota=26, max_slots=60), id="three percent", marks=pytest.mark.slow
    ),
]


def some_slow(names: Iterable[str], *slow: str) -> list:
    """Names for parameters, some of which are left to the longer proofs."""
    return [pytest.param(n, marks=pytest.mark.slow) if n in slow else n for n in names]


def shadings(space: dict) -> Iterator[tuple[ScenarioSpace, int]]:
    """Without and with shadowing; the values that it has."""
    for variance, count in ((0.0, 1), (9.0, 2)):
        yield shadowed(**space, shadowing_variance=variance), count


@pytest.mark.parametrize("sea", some_slow(SEAS, "two nodes beside the zone"))
@pytest.mark.parametrize("seed", [4, pytest.param(5, marks=pytest.mark.slow)])
def test_the_bound_is_above_the_optimum_where_uavs_charge(sea, seed):
    gaps = [
        check(space, seed, count)
        for values in CASES
        for space, count in shadings(SEAS[sea] | values)
    ]
    assert np.mean(gaps) <= 0.25


def test_the_bound_is_above_the_optimum_where_uavs_share_a_pad():
    pair = {"uavs": 2, "zone": (1, 1, 2, 1), "nodes": TWO, "pads": 1, "edge_snr": -30.0}
    sea = {"initial_data": 20.0, "arrival_rate": 0.2} | pair
    for end in (5, 3):
        for space, count in shadings(sea | battery(1, 10, 11, 10, quota=2, max_slots=end)):
            gap_of(space, 1, count)


@pytest.mark.parametrize("values", FULL_TRIPS)
def test_a_uav_that_charges_repeatedly_is_bounded_closely(values):
    assert check(shadowed(**FAR | values, shadowing_variance=0.0), 3, 1) <= 0.01


def test_an_early_end_is_bounded_closely():
    """Nearly all is collected, so each slot with new data lowers the ratio."""
    values = battery(10, 10, 20, 1, quota=12, max_slots=60)
    space = shadowed(
        **PLENTY | values | {"initial_data": 72.0, "arrival_rate": 0.5}, shadowing_variance=0.0
    )
    assert gap_of(space, 3) <= 0.02


# --- on seas with two zones, no-fly cells and unequal sides ---

# Batteries with which a UAV must charge within a few slots, and one that needs no charge.
TRIPS = (
    battery(3, 10, 12, 5, quota=5, max_slots=8),
    battery(12, 11, 13, 2, quota=5, max_slots=7),
    battery(4, 10, 14, 10, quota=6, max_slots=7),
    battery(40, 10, 50, 5, quota=5, max_slots=5),
)


def drawn_seas(seed: int) -> Iterator[dict]:
    """Seas of unequal sides, with two nodes; some have two zones, some no-fly cells."""
    draw = np.random.default_rng(seed)
    while True:
        sides = draw.choice([2, 3, 4, 5], 2, replace=False, p=[0.4, 0.4, 0.1, 0.1]).tolist()
        cells = draw.permutation(list(np.ndindex(*sides))).tolist()
        zones, closed = draw.integers(1, 3), draw.integers(3)
        sea = {
            "grid": sides[0], "rows": sides[1],
            "zone": (*cells[0], 1, 1),
            "zones": [{"cells": (*cell, 1, 1)} for cell in cells[1:zones]],
            "nodes": draw.permutation(cells[:4])[:2].tolist(),
            "no_fly": cells[4 : 4 + closed],
            "edge_snr": float(draw.choice([-40.0, -30.0, -20.0])),
            "initial_data": float(draw.choice([5.0, 20.0, 300.0])),
            "arrival_rate": float(draw.choice([0.0, 0.3])),
        }  # fmt: skip
        sea |= TRIPS[draw.integers(len(TRIPS))]
        try:
            shadowed(**sea)
        except InputError:  # no way leads to a node or a zone
            continue
        yield sea


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 8))]
)
def test_the_bound_is_above_the_optimum_on_drawn_seas(seed):
    seas = islice(drawn_seas(seed), 6)
    gaps = [check(space, seed, count) for sea in seas for space, count in shadings(sea)]
    assert np.mean(gaps) <= 0.1


def test_the_bound_is_above_the_optimum_where_two_uavs_have_two_zones():
    sea = {"grid": 3, "rows": 2, "zone": (0, 0, 1, 2), "zones": [{"cells": (2, 0, 1, 1)}]}
    team = {"uavs": 2, "pads": 1, "nodes": ((1, 0), (2, 1)), "edge_snr": -30.0}
    values = {"initial_data": 20.0, "arrival_rate": 0.2} | battery(1, 10, 11, 10, quota=2)
    for end in (5, 3):
        for space, count in shadings(sea | team | values | {"max_slots": end}):
            gap_of(space, 1, count)


LANE = {
    **{"grid": 4, "rows": 2, "zone": (0, 0, 1, 1), "nodes": ((3, 0),), "edge_snr": -40.0},
    **{"initial_data": 300.0, "arrival_rate": 0.0, "shadowing_variance": 0.0},
}


def both(**values: object) -> tuple[float, float]:
    """The data that a lone UAV collects at most on the lane, exactly and by its table."""
    space = shadowed(**LANE | values)
    return TinySea(space, 3, contraction(1)).most_collected, bound_of_data(space, 3)


def test_a_uav_that_charges_in_another_zone_is_bounded_exactly():
    """Its quota takes a charge, and it collects most if it charges at the node."""
    trip = battery(11, 10, 11, 1, quota=12, max_slots=20)
    best, bound = both(**trip, zones=[{"cells": (3, 0, 1, 1)}])
    assert bound == pytest.approx(best)
    assert max(both(**trip)) < 0.95 * best


def test_a_uav_that_flies_around_no_fly_cells_is_bounded_exactly():
    """A wall with a gap at its southern end: the way to the node is longer by two cells."""
    trip = battery(40, 10, 50, 5, quota=6, max_slots=6)
    (straight, _), (best, bound) = (both(**trip, no_fly=cells) for cells in ((), ((2, 0),)))
    assert bound == pytest.approx(best)
    assert bound < 0.9 * straight
