"""The bound of a mission: prices of the nodes' data, improved step by step.

Data that the team takes from a node up to a cut are at most what the node has had by then. Each of
these constraints has a price. Every choice of prices gives an upper bound; subgradient steps look
for low ones, and the lowest bound found is kept.

    bound = upper_bound(load_scenario("paper"), seed=1, replication=0)
    bound.ratio  # no policy has a higher expected collection ratio in this mission
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from analysis.bound.energy import Phases, phases_of
from analysis.bound.paths import add_takings, bound_paths
from analysis.bound.service import POINTS, rates_of, spread, step_values
from dess import rules
from dess.channel import world_of
from dess.code.kernels import kernel
from dess.errors import InputError
from dess.scenario import ScenarioSpace
from dess.state import constants_of, empty_state, ranges_of, sample_scenario, types_of

ITERATIONS = 25
_CUTS = 4
_MOMENTUM = 0.7  # part of the direction of the step before that a step keeps
# Local prices, as parts of what a data unit is worth after the last but one cut.
_LOCAL = np.array([0.0, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0])
_ROUNDING = 1e-6  # more than the rounding errors of the calculation


@dataclass(frozen=True)
class Bound:
    """An upper bound of one mission, whatever the policy.

    Attributes:
        ratio: Upper bound on the expected collection ratio, and so on the product; at most 1.
        prices: (S, K) prices of the cuts [data units per data unit].
        cuts: (S,) the last mission slot of each cut.
        iterations: Number of prices tried.
    """

    ratio: float
    prices: np.ndarray
    cuts: np.ndarray
    iterations: int


class _Mission(NamedTuple):
    """What is known of a mission before its first slot, arrivals included."""

    record: np.ndarray
    starts: np.ndarray
    data: np.ndarray
    nodes: np.ndarray
    rates: np.ndarray
    below: np.ndarray
    block: np.ndarray
    phases: Phases


def upper_bound(
    scenario: ScenarioSpace, seed: int, replication: int, *, iterations: int = ITERATIONS
) -> Bound:
    """An upper bound on the expected collection ratio of any policy in one mission.

    The mission's parameters, start cells, initial data and arrivals are given; the expectation is
    over the shadowing.

    Args:
        scenario: The scenario, without sections beyond the paper.
        seed: Seed of the mission.
        replication: Number of the replication.
        iterations: How many prices are tried.

    Raises:
        InputError: If the scenario has a section, or the seed or the replication is out of range.
    """
    check_scenario(scenario)
    mission = _mission_of(scenario, seed, replication)
    return _improve(mission, iterations)


def check_scenario(scenario: ScenarioSpace) -> None:
    """Refuse a scenario whose missions have no bound.

    Raises:
        InputError: If it has a section beyond the paper.
    """
    if scenario.is_extended:
        raise InputError("bound: the scenario has sections beyond the paper; allowed: none of them")


def _mission_of(scenario: ScenarioSpace, seed: int, replication: int) -> _Mission:
    sampled = sample_scenario(scenario, seed, replication)
    phases = phases_of(sampled)
    state = empty_state(1, scenario.uavs[1], len(scenario.nodes))
    record = state.missions[0]
    state.missions[:] = constants_of(scenario)
    record["seed"], record["replication"] = seed, replication
    rules.launch(
        record, ranges_of(scenario), types_of(scenario),
        state.uavs[0], state.residual[0], state.sensors[0], state.teeth[0],
    )  # fmt: skip
    starts = np.stack([state.uavs[0][axis][: sampled.uavs] for axis in "xy"], axis=1)
    data = _data_by(record, state.residual[0], phases.slots)
    world = world_of(scenario)
    points = POINTS if scenario.shadowing_variance > 0 else np.zeros(1)
    below = spread(points) if scenario.shadowing_variance > 0 else np.array([0.0, 1.0])
    rates = rates_of(record, world.mean_snr, points)
    block = _blocks(world.nodes, scenario.grid)
    return _Mission(record, starts, data, world.nodes, rates, below, block, phases)


@kernel
def _data_by(mission, residual, slots):
    """(T + 1, K) the data that each node has had by the start of slot t = 0..T."""
    data = np.empty((slots + 1, len(residual)))
    arrivals = np.empty(len(residual), np.int64)
    had = residual.copy()
    for t in range(slots):
        data[t] = had
        mission.slot = t
        rules.arrive(mission, had, arrivals)
    data[slots] = had
    return data


def _blocks(nodes: np.ndarray, grid: int) -> np.ndarray:
    """(M, M) the node that is nearest to each cell; the first of several."""
    cells = np.stack(np.meshgrid(np.arange(grid), np.arange(grid), indexing="ij"), axis=-1)
    distance = ((cells[:, :, None] - nodes) ** 2).sum(axis=-1)
    return np.argmin(distance, axis=-1)


def _improve(mission: _Mission, iterations: int) -> Bound:
    """Search for low prices by subgradient steps; the lowest bound found is kept."""
    record, starts, data, nodes, rates, below, block, phases = mission
    slots, count, grid = len(phases.after), len(phases.deadline), len(block)
    total = data.sum(axis=1)
    last = int(phases.clock.max())
    cuts = np.unique(np.ceil(np.arange(1, _CUTS + 1) * last / _CUTS).astype(np.int64))
    period = np.minimum(np.searchsorted(cuts, np.arange(len(data))), len(cuts) - 1)
    waiting = total / len(starts)
    values = np.empty((len(cuts), 5, grid, grid, len(_LOCAL)))
    ceilings = np.empty((slots + 1, count, grid, grid, len(_LOCAL)))
    prices = np.zeros((len(cuts), len(nodes)))
    lowest, kept, direction = np.inf, prices, np.zeros(prices.shape)
    for _ in range(iterations):
        worth = np.maximum(1.0 - prices[::-1].cumsum(axis=0)[::-1], 0.0)
        local = worth[-1][:, None] * _LOCAL
        step_values(worth, local, nodes, block, rates, below, values)
        bound_paths(record, phases, data, period, block, local, values, waiting, ceilings)
        takings = np.zeros(prices.shape)
        bound = total[-1] + (prices * data[cuts]).sum()
        for x, y in starts:
            bound += add_takings(
                record, phases, data, period, block, local, values, waiting, ceilings,
                x, y, worth, nodes, rates, below, takings,
            )  # fmt: skip
        if bound < lowest:
            lowest, kept = bound, prices
        slope = data[cuts] - takings.cumsum(axis=0)
        slope[(prices == 0) & (slope > 0)] = 0.0
        direction = slope + _MOMENTUM * direction
        if not direction.any():
            break
        size = max(bound - 0.98 * lowest, 0.0) / (direction**2).sum()
        prices = np.maximum(prices - size * direction, 0.0)
    ratio = lowest / total[-1] * (1 + _ROUNDING) if total[-1] > 0 else 1.0
    return Bound(min(ratio, 1.0), kept, cuts, iterations)
