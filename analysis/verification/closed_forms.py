"""What is known of a mission without simulating it: the channel, the draws, what intervals cover.

Written from the equations with numpy and scipy; no code of the simulator has a part in it.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import integrate, stats

from analysis.stats.intervals import LEVEL, wilson
from dess.scenario import Scenario, ScenarioSpace

World = Scenario | ScenarioSpace

_FAR = 10.0  # standard deviations: no mass beyond, to the last digit
_MANY = 50  # nodes from which the sum of their initial data is as good as normal


class Moments(NamedTuple):
    """Mean and standard deviation."""

    mean: float
    deviation: float


def distance(scenario: World, dx: Any, dy: Any) -> Any:
    """Distance [m] between a node and a UAV that is ``dx, dy`` cells from above it."""
    across = scenario.cell_size * np.hypot(dx, dy)
    return np.hypot(across, scenario.altitude)


def mean_snr(scenario: World, distance: Any) -> Any:
    """Mean SNR [dB] at a distance [m] (eq. 10)."""
    edge = np.sqrt(2) / 2 * scenario.grid * scenario.cell_size
    return scenario.edge_snr - 10 * scenario.path_loss_exponent * np.log10(distance / edge)


def rate(scenario: World, snr: Any) -> Any:
    """Data units per communication slot at an SNR [dB] (eq. 9)."""
    length = scenario.slot_length / scenario.communication_slots
    return length * np.log1p(10 ** (np.asarray(snr) / 10)) / np.log(2)


def snr_of(scenario: World, rate: Any) -> Any:
    """The SNR [dB] at which a communication slot carries that many data units (eq. 9, solved)."""
    length = scenario.slot_length / scenario.communication_slots
    return 10 * np.log10(np.expm1(np.asarray(rate) / length * np.log(2)))


def rate_moments(scenario: World, distance: float) -> Moments:
    """The rate of one communication slot over all shadowing, by numerical integration.

    ``E[delta_n log2(1 + SNR(d, eta))]`` and its standard deviation, ``eta`` being normal [dB].
    """
    mean_db, spread = mean_snr(scenario, distance), np.sqrt(scenario.shadowing_variance)

    def expectation(function: Any) -> float:
        def weighed(z: float) -> float:
            density = np.exp(-z * z / 2) / np.sqrt(2 * np.pi)
            return float(function(rate(scenario, mean_db + spread * z)) * density)

        return float(integrate.quad(weighed, -_FAR, _FAR, limit=200, epsabs=0)[0])

    mean = expectation(lambda r: r)
    return Moments(mean, float(np.sqrt(expectation(lambda r: (r - mean) ** 2))))


def initial_total(scenario: World) -> Any:
    """The distribution of all nodes' initial data together: a scaled Irwin-Hall distribution."""
    low, high = scenario.initial_data
    count = len(scenario.nodes)
    if count <= _MANY:
        return stats.irwinhall(count, loc=count * low, scale=high - low)
    return stats.norm(count * (low + high) / 2, (high - low) * np.sqrt(count / 12))


def wilson_coverage(successes: int, missions: int, block: int, level: float = LEVEL) -> float:
    """How often the Wilson interval of a block holds the share of successes of all missions.

    Exact: the successes in a block of missions that were split at random are hypergeometric.

    Args:
        successes: Of all missions.
        missions: How many there are.
        block: How many a block has.
        level: Of the interval.
    """
    numbers = np.arange(block + 1)
    ends = [wilson(x, block, level) for x in range(block + 1)]
    holds = np.array([e.low <= successes / missions <= e.high for e in ends])
    return float(stats.hypergeom(missions, successes, block).pmf(numbers)[holds].sum())


def t_coverage(missions: int, block: int, level: float = LEVEL) -> float:
    """How often Student's t interval of a block holds the mean of all missions.

    A little more often than ``level``, since the block is itself a part of all; for values so many
    that the mean of a block is normal.
    """
    end = stats.t.ppf((1 + level) / 2, block - 1) / np.sqrt(1 - block / missions)
    return float(1 - 2 * stats.t.sf(end, block - 1))
