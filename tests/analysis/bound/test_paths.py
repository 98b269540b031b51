"""The bound of one mission: what refinements do to it, and its derivatives."""

import numpy as np
import pytest

from dess import load_scenario
from dess.analysis.bound.prices import Bounds, Detail, improve_prices, known_of
from dess.scenario.scenario import ScenarioSpace
from tests.analysis.bound.tiny_sea import bound_of_data


def paper_like(**values: object) -> ScenarioSpace:
    """A lone UAV that flies 15 slots over nine nodes and must charge once."""
    nodes = tuple((x, y) for x in (1, 4, 7) for y in (1, 4, 7))
    battery = {"flying_time": 11, "charge_start": 10, "charge_complete": 13, "charge_rate": 5}
    space = {"grid": 9, "nodes": nodes, "zone": (3, 3, 2, 2), "quota": 60, "edge_snr": -15.0}
    return load_scenario("paper", uavs=1, **(space | battery | values))


def test_the_derivatives_are_those_of_the_bound():
    bounds = Bounds(known_of(paper_like(), 4, 0), Detail())
    generator = np.random.default_rng(0)
    prices = generator.uniform(0, 0.4, (2, 9))
    _, slope = bounds.at(prices)
    step = 1e-6 * generator.normal(size=prices.shape)
    change = bounds.at(prices + step)[0] - bounds.at(prices - step)[0]
    assert change == pytest.approx(2 * (slope * step).sum(), rel=1e-3)


def test_a_whole_rate_of_charging_has_a_bound_however_it_is_written():
    spaces = [paper_like(charge_rate=rate) for rate in (5, 5.0)]
    found = [Bounds(known_of(space, 4, 0), Detail()).at(np.full((2, 9), 0.3)) for space in spaces]
    assert found[0][0] == found[1][0]


def test_every_refinement_lowers_the_bound_at_the_same_prices():
    known = known_of(paper_like(), 4, 0)
    prices = np.full((1, 9), 0.3)
    coarse = Detail(cuts=(), local=(0.0,), levels=(0,))
    finer = coarse._replace(local=(0.0, 0.5, 1.0))
    finest = finer._replace(levels=(0, 1, 2))
    found = [Bounds(known, detail).at(prices)[0] for detail in (coarse, finer, finest)]
    assert found[0] > found[1] > found[2]


def test_a_uav_can_take_all_that_its_node_has_had():
    """Arrivals in a visit and during a charge, too; ending early has no advantage here."""
    space = paper_like(nodes=((3, 3),), initial_data=1.0, arrival_rate=20.0, edge_snr=45.0)
    known = known_of(space, 4, 0)
    assert np.diff(known.data, axis=0).min() > 0
    last = known.phases.clock[:, -1].max()
    assert last > known.phases.clock[0, -1]  # there is a charge
    assert bound_of_data(space, 4) == pytest.approx(known.data[last, 0])


def test_more_iterations_never_raise_the_bound():
    known = known_of(paper_like(), 4, 0)
    ratios = [improve_prices(known, iterations, Detail()).ratio for iterations in (0, 1, 5, 15)]
    assert ratios[0] == 1
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[-1] < ratios[1]
