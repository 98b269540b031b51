"""The bound against the exact optimum on seas with two zones, no-fly cells and unequal sides."""

from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest

from dess.errors import InputError
from tests.analysis.bound.lone_uav import bound_of_data, check
from tests.analysis.bound.test_optimum import shadowed
from tests.analysis.bound.test_optimum_charging import battery, shadings
from tests.analysis.bound.tiny_sea import TinySea, contraction, gap_of

# Batteries with which a UAV must charge within a few slots, and one that needs no charge.
BATTERIES = (
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
        sea |= BATTERIES[draw.integers(len(BATTERIES))]
        try:
            shadowed(**sea)
        except InputError:  # no way leads to a node or a zone
            continue
        yield sea


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3))]
)
def test_the_bound_is_above_the_optimum_on_drawn_seas(seed):
    seas = islice(drawn_seas(seed), 12)
    gaps = [check(space, seed, count) for sea in seas for space, count in shadings(sea)]
    assert np.mean(gaps) <= 0.1


def test_the_bound_is_above_the_optimum_where_a_uav_may_charge_under_way():
    """Its battery does not last for the quota, and it cannot charge before it flies."""
    trip = battery(11, 10, 11, 1, quota=12, max_slots=20)
    plenty = {"initial_data": 300.0, "shadowing_variance": 0.0}
    small = (sea for sea in drawn_seas(7) if sea["zones"] and sea["grid"] * sea["rows"] == 6)
    for sea in islice(small, 3):
        check(shadowed(**sea | trip | plenty), 3, 1)


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
