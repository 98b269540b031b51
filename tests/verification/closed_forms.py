"""Closed forms of what a simulation estimates: channel, draws, coverage of intervals.

The functions are written from the equations with numpy and scipy; they use no code of the
simulator.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import integrate, stats

from dess.analysis.stats.intervals import share_interval
from dess.analysis.stats.kinds import LEVEL
from dess.scenario.scenario import Scenario, ScenarioSpace

World = Scenario | ScenarioSpace

_FAR = 10.0  # standard deviations; the probability beyond is below the rounding error
_MANY = 50  # with this many nodes or more, the sum of their initial data is taken as normal


class MeanAndDeviation(NamedTuple):
    """Mean and standard deviation."""

    mean: float
    deviation: float


def distance_to_node(scenario: World, dx: Any, dy: Any) -> Any:
    """Distance [m] between a node and a UAV that is ``dx, dy`` cells from above it."""
    across = scenario.cell_size * np.hypot(dx, dy)
    return np.hypot(across, scenario.altitude)


def mean_snr(scenario: World, distance: Any) -> Any:
    """Mean SNR [dB] at a distance [m] (eq. 10) that is in range."""
    edge = scenario.radio.anchor or np.hypot(*scenario.size) / 2 * scenario.cell_size
    return scenario.edge_snr - 10 * scenario.path_loss_exponent * np.log10(distance / edge)


def rate_at_snr(scenario: World, snr: Any) -> Any:
    """Data units per communication slot at an SNR [dB] (eq. 9)."""
    radio = scenario.radio
    length = scenario.slot_length / scenario.communication_slots * radio.duty_cycle
    if radio.steps:
        least, efficiencies = np.transpose(radio.steps)
        reached = np.searchsorted(least, snr, side="right")
        return length * np.concatenate(([0.0], efficiencies))[reached]
    efficiency = np.log1p(10 ** (np.asarray(snr) / 10)) / np.log(2)
    return length * np.minimum(efficiency, radio.max_rate or np.inf)


def snr_of(scenario: World, rate: Any) -> Any:
    """The SNR [dB] at which a communication slot carries that many data units (eq. 9, solved)."""
    length = scenario.slot_length / scenario.communication_slots
    return 10 * np.log10(np.expm1(np.asarray(rate) / length * np.log(2)))


def rate_moments(scenario: World, distance: float) -> MeanAndDeviation:
    """The rate of one communication slot over all shadowing, by numerical integration.

    ``E[delta_n log2(1 + SNR(d, eta))]`` and its standard deviation, ``eta`` being normal [dB].
    """
    mean_db = mean_snr(scenario, distance)
    spread = np.sqrt(scenario.shadowing_variance)

    def expectation(function: Any) -> float:
        def weighed(z: float) -> float:
            density = np.exp(-z * z / 2) / np.sqrt(2 * np.pi)
            return float(function(rate_at_snr(scenario, mean_db + spread * z)) * density)

        return float(integrate.quad(weighed, -_FAR, _FAR, limit=200, epsabs=0)[0])

    mean = expectation(lambda r: r)
    return MeanAndDeviation(mean, float(np.sqrt(expectation(lambda r: (r - mean) ** 2))))


def initial_total(scenario: World) -> Any:
    """The distribution of all nodes' initial data together: a scaled Irwin-Hall distribution."""
    low, high = scenario.initial_data
    count = len(scenario.nodes)
    if count <= _MANY:
        return stats.irwinhall(count, loc=count * low, scale=high - low)
    return stats.norm(count * (low + high) / 2, (high - low) * np.sqrt(count / 12))


def wilson_coverage(successes: int, missions: int, block: int, level: float = LEVEL) -> float:
    """The probability that the Wilson interval of a block contains the share of all missions.

    It is exact, since the number of successes in a random block is hypergeometric.

    Args:
        successes: Number of successful missions.
        missions: Number of all missions.
        block: Number of missions in a block.
        level: Confidence level of the interval.
    """
    numbers = np.arange(block + 1)
    ends = [share_interval(x, block, level) for x in range(block + 1)]
    holds = np.array([e.low <= successes / missions <= e.high for e in ends])
    return float(stats.hypergeom(missions, successes, block).pmf(numbers)[holds].sum())


def t_coverage(missions: int, block: int, level: float = LEVEL) -> float:
    """The probability that Student's t interval of a block contains the mean of all missions.

    It is a little above ``level``, because the block is itself a part of all missions. The formula
    assumes blocks that are large enough for a normally distributed mean.
    """
    end = stats.t.ppf((1 + level) / 2, block - 1) / np.sqrt(1 - block / missions)
    return float(1 - 2 * stats.t.sf(end, block - 1))
