"""The closed forms agree with cases by hand, with other ways to compute them, and each other."""

from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from dess.analysis.stats.intervals import share_interval
from dess.scenario.scenario import Scenario
from tests.verification import closed_forms


def test_initial_data_of_few_nodes_by_hand():
    one = closed_forms.initial_total(Scenario.of(nodes=[[0, 0]]))
    assert one.cdf([5, 8.75, 20]) == pytest.approx([0, 0.25, 1])
    two = closed_forms.initial_total(Scenario.of(nodes=[[0, 0], [1, 1]]))
    assert two.cdf([10, 25, 40]) == pytest.approx([0, 0.5, 1])
    # A triangle, a quarter of the way.
    assert two.cdf(17.5) == pytest.approx(0.125)


@pytest.mark.parametrize("successes", [0, 2, 6, 9])
def test_coverage_of_wilson_counts_all_ways_to_draw_a_block(successes):
    missions = [1] * successes + [0] * (9 - successes)
    blocks = [sum(block) for block in combinations(missions, 4)]
    ends = [share_interval(x, 4, 0.5) for x in blocks]
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
