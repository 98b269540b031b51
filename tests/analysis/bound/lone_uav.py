"""What a lone UAV can collect, by the table of the bound alone.

In the bound of the ratio, an early end costs something, and what arrives after it counts as
collected (relaxation 2 of docs/concepts/bound.md). That can hide an error in the table.
"""

import numpy as np

from dess.analysis.bound import upper_bound
from dess.analysis.bound.paths import bound_paths
from dess.analysis.bound.prices import Bounds, Detail, known_of
from dess.scenario import ScenarioSpace
from tests.analysis.bound.tiny_sea import TinySea, contraction


def bound_of_data(space: ScenarioSpace, seed: int) -> float:
    """An upper bound on the data [data units] that a lone UAV is expected to collect."""
    known = known_of(space, seed, 0)
    bounds = Bounds(known, Detail(cuts=()))
    bounds.at(np.zeros((1, len(known.nodes))))  # sets the worth of the steps
    local = np.tile(bounds.parts, (len(known.nodes), 1))
    bound_paths(
        known.to_zone, known.phases, known.data, bounds.period, bounds.blocks, local,
        bounds.values, np.zeros(len(known.data)), bounds.ceilings,
    )  # fmt: skip
    x, y = known.starts[0]
    home = bounds.blocks.home[x, y]
    had = known.data[known.phases.clock[0, 0], home]
    return float((bounds.ceilings[0, 0, x, y, 0] + local[home] * had).min())


def check(space: ScenarioSpace, seed: int, count: int) -> float:
    """How far the bound is above the optimum; neither it nor the table is below."""
    exact = TinySea(space, seed, contraction(count))
    gap = upper_bound(space, seed, 0).ratio - exact.optimum
    assert gap >= -1e-12, space
    assert exact.most_collected <= bound_of_data(space, seed) + 1e-9, space
    return gap
