"""The worth of a flying slot: above the true expectation, and close to it."""

import numpy as np
import pytest
from scipy.stats import norm

from dess import load_scenario
from dess.analysis.bound.service import POINTS, rates_of, spread_normal, step_takings, step_values
from dess.model.channel import world_of
from dess.model.state import EAST, HOVER, constants_of

NODES = ((1, 1), (3, 1))


def world() -> tuple:
    space = load_scenario("paper", grid=4, nodes=NODES, zone=(0, 0, 2, 2), edge_snr=0.0)
    mission = constants_of(space)[0]
    return space, rates_of(mission, world_of(space).mean_snr, POINTS)


def values_of(rates: np.ndarray, worth: list[float], local: list[float]) -> np.ndarray:
    values = np.empty((1, 5, 4, 4, len(local)))
    block = np.array([[0] * 4, [0] * 4, [0] * 4, [1] * 4])
    prices = np.tile(local, (2, 1)).astype(float)
    step_values(
        np.array([worth]), prices, np.array(NODES), block, rates, spread_normal(POINTS), values
    )
    return values[0]


def test_the_points_are_a_mean_preserving_spread():
    chances = np.diff(spread_normal(POINTS))
    assert chances.min() > 0
    assert chances.sum() == pytest.approx(1)
    assert chances @ POINTS == pytest.approx(0, abs=1e-9)
    for convex in (np.square, np.exp, np.abs, lambda z: np.maximum(z - 1.7, 0)):
        exact = norm.expect(convex, lb=-8, ub=8)
        assert exact - 1e-9 <= chances @ convex(POINTS) <= 1.15 * exact + 0.01


@pytest.mark.parametrize("worth", [[1.0, 1.0], [0.5, 1.0], [0.0, 0.3]])
def test_a_slot_is_worth_more_than_the_mean_of_the_best_node(worth):
    space, rates = world()
    x = 2  # between both nodes
    shadowing = np.random.default_rng(0).normal(0, np.sqrt(2), (200_000, 2))
    mean = world_of(space).mean_snr[0, 4]  # at a distance of one cell
    drawn = 0.25 * np.log2(1 + 10 ** ((mean + shadowing) / 10))
    best = 4 * (drawn * worth).max(axis=1)
    value = values_of(rates, worth, [0.0])[HOVER, x, 1, 0]
    assert best.mean() - 4 * best.std() / len(best) ** 0.5 <= value <= 1.01 * best.mean()


def test_takings_are_what_makes_up_the_worth():
    _, rates = world()
    worth, takings = np.array([0.7, 1.0]), np.zeros(2)
    step_takings(2, 1, EAST, worth, np.array(NODES), rates, spread_normal(POINTS), takings)
    value = values_of(rates, [0.7, 1.0], [0.0])[EAST, 2, 1, 0]
    assert worth @ takings == pytest.approx(value)
