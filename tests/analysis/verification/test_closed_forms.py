"""The closed forms agree with cases by hand, with other ways to compute them, and each other."""

from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from dess.analysis.stats.intervals import wilson
from dess.analysis.verification import closed_forms
from dess.scenario import Scenario

WORLD = Scenario()


def test_the_distance_is_that_of_a_box():
    world = Scenario.of(cell_size=4.0, altitude=12.0)
    assert closed_forms.distance(world, 1, 0) == pytest.approx(np.sqrt(16 + 144))
    assert closed_forms.distance(world, 3 / 4, -1) == pytest.approx(13)  # 3, 4, 12
    assert closed_forms.distance(world, 0, 0) == 12


def test_the_mean_snr_falls_from_the_edge_by_its_exponent():
    edge = np.sqrt(2) / 2 * WORLD.grid * WORLD.cell_size
    assert closed_forms.mean_snr(WORLD, edge) == pytest.approx(WORLD.edge_snr)
    decade = closed_forms.mean_snr(WORLD, edge / 10) - closed_forms.mean_snr(WORLD, edge)
    assert decade == pytest.approx(10 * WORLD.path_loss_exponent)


def test_the_rate_at_an_snr_by_hand():
    world = Scenario.of(slot_length=2.0, communication_slots=8)
    assert closed_forms.rate(world, 0.0) == pytest.approx(0.25)  # log2(1 + 1), a quarter long
    assert closed_forms.rate(world, 10 * np.log10(7)) == pytest.approx(0.75)


@pytest.mark.parametrize("distance", [10.0, 800.0, 20_000.0])
@pytest.mark.parametrize("variance", [2.0, 60.0])
def test_moments_of_the_rate_agree_with_a_quadrature_of_another_kind(distance, variance):
    world = Scenario.of(shadowing_variance=variance)
    nodes, weights = np.polynomial.hermite_e.hermegauss(80)
    weights = weights / weights.sum()
    rates = closed_forms.rate(
        world, closed_forms.mean_snr(world, distance) + np.sqrt(variance) * nodes
    )
    mean = weights @ rates
    moments = closed_forms.rate_moments(world, distance)
    assert moments.mean == pytest.approx(mean, rel=1e-8)
    assert moments.deviation == pytest.approx(np.sqrt(weights @ (rates - mean) ** 2), rel=1e-7)


def test_initial_data_of_few_nodes_by_hand():
    one = closed_forms.initial_total(Scenario.of(nodes=[[0, 0]]))
    assert one.cdf([5, 8.75, 20]) == pytest.approx([0, 0.25, 1])
    two = closed_forms.initial_total(Scenario.of(nodes=[[0, 0], [1, 1]]))
    assert two.cdf([10, 25, 40]) == pytest.approx([0, 0.5, 1])
    assert two.cdf(17.5) == pytest.approx(0.125)  # a triangle, a quarter of the way


@pytest.mark.parametrize("successes", [0, 2, 6, 9])
def test_coverage_of_wilson_counts_all_ways_to_draw_a_block(successes):
    missions = [1] * successes + [0] * (9 - successes)
    blocks = [sum(block) for block in combinations(missions, 4)]
    ends = [wilson(x, 4, 0.5) for x in blocks]
    held = np.mean([e.low <= successes / 9 <= e.high for e in ends])
    assert closed_forms.wilson_coverage(successes, 9, 4, 0.5) == pytest.approx(held)


def test_coverage_of_t_agrees_with_a_simulation():
    draws = np.random.default_rng(3).normal(size=(4000, 4, 5))
    mean = draws.mean((1, 2))
    first = draws[:, 0]
    low, high = stats.t.interval(0.8, 4, first.mean(1), stats.sem(first, axis=1))
    held = ((low <= mean) & (mean <= high)).mean()
    # The block is a part of all, so the spread within it is not independent of the mean of all.
    assert closed_forms.t_coverage(20, 5, 0.8) == pytest.approx(held, abs=0.03)
