"""The bound against the exact optimum of missions with charges, which end by quota or are cut."""

from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np
import pytest

from dess.scenario import ScenarioSpace
from tests.analysis.bound.lone_uav import check
from tests.analysis.bound.test_optimum import TWO, shadowed
from tests.analysis.bound.tiny_sea import gap_of


def battery(start: int, low: int, full: int, rate: int, **values: object) -> dict:
    limits = {"flying_time": start, "charge_start": low, "charge_complete": full}
    return limits | {"charge_rate": rate} | values


# With values of max_slots: one that leaves time to fill the quota, and some that cut off the
# mission, most of them during a charge.
BATTERIES = [
    (battery(10, 10, 18, 1, flight_cost=0, quota=4), (20, 9, 7)),  # no battery decrease
    (battery(2, 10, 12, 1, quota=4), (16, 12, 6)),  # no flight before the charge
    (battery(2, 10, 12, 5, quota=4), (10, 5, 3)),  # a short charge
    (battery(12, 11, 14, 1, quota=4), (12, 6)),  # not low at first
    (battery(3, 10, 11, 1, quota=5), (20, 12, 7)),  # up to the next percent
    (battery(11, 10, 11, 1, quota=4), (7, 4)),  # one percent
    (battery(2, 10, 12, 5, quota=5, communication_slots=2), (9, 4)),  # half a slot left
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
def test_the_bound_is_above_the_optimum_where_uavs_charge(sea):
    gaps = [
        check(space, seed, count)
        for values, seed in product(CASES, (4, 5))
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
