"""The bound of a mission: prices of the nodes' data, improved step by step.

Data that the team takes from a node up to a cut are at most what the node has had by then. Each of
these constraints has a price. Every choice of prices gives an upper bound; subgradient steps look
for low ones, and the lowest bound found is kept.

The next prices to try are those of a proximal bundle method for convex functions. The bounds and
slopes found so far give a model of the bound, the largest of their tangents. The next prices
minimise the model plus the squared distance from the best prices so far (C. Lemarechal,
*Nondifferentiable optimization*, 1989). Whatever it returns, the bound at the prices is valid.

    bound = upper_bound(load_scenario("paper"), seed=1, replication=0)
    bound.ratio  # no policy has a higher expected collection ratio in this mission
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dess import InputError
from dess.analysis.bound import paths
from dess.analysis.bound.service import POINTS, add_slopes, rates_of, spread_normal, step_values
from dess.base.kernels import kernel
from dess.model import rules
from dess.model.channel import empty_scratch, world_of
from dess.model.state import sample_scenario, spaces_of, starts_of, state_of
from dess.physics import chart
from dess.scenario.scenario import AnyScenario, ScenarioSpace

_STEPS = 300


@kernel
def next_prices(centre, most, lowest, points, bounds, slopes, width):
    """The prices that minimise the model plus the squared distance from ``centre``.

    Args:
        centre: (V,) the best prices so far.
        most: (V,) the largest prices allowed; the smallest are 0.
        lowest: The bound at ``centre``.
        points: (N, V) prices tried.
        bounds: (N,) the bounds there.
        slopes: (N, V) the derivatives there.
        width: Twice the weight of the model against the squared distance.

    Returns:
        (V,) prices, and the bound that the model has there.
    """
    count = len(bounds)
    offsets, model = np.empty(count), np.empty(count)
    for i in range(count):  # rounding, and the finite number of local prices, can lift a tangent
        offsets[i] = min(bounds[i] + (slopes[i] * (centre - points[i])).sum(), lowest)
    weights = np.zeros(count)
    weights[np.argmax(offsets)] = 1.0
    for _ in range(_STEPS):  # of the dual problem, between two tangents at a time
        slope = np.zeros(len(centre))
        for i in range(count):
            slope += weights[i] * slopes[i]
        prices = np.minimum(np.maximum(centre - width * slope, 0.0), most)
        above = 0
        under = -1
        for i in range(count):
            model[i] = offsets[i] + (slopes[i] * (prices - centre)).sum()
            if model[i] > model[above]:
                above = i
            if weights[i] > 0.0 and (under < 0 or model[i] < model[under]):
                under = i
        gap = model[above] - model[under]
        if gap < 1e-7:
            break
        between = ((slopes[above] - slopes[under]) ** 2).sum()
        share = min(gap / (width * between), weights[under])
        weights[above] += share
        weights[under] -= share
    return prices, model.max()


ITERATIONS = 20
MOST_MEMORY = 4 * 2**30  # of the table of a mission [bytes]
_FIRST_DECREASE = 0.1  # of the bound, that the first step aims at
_HOPE = 4  # the search ends if a quarter of the iterations has found no bound below 1


class Detail(NamedTuple):
    """How finely the bound distinguishes states; every choice gives a valid bound.

    Attributes:
        cuts: Cuts before the end, as parts of the longest mission.
        local: Local prices, as parts of what a data unit is worth after the last of these cuts.
        levels: Indices of the local prices at which the block before is remembered.
        near: Neighbouring blocks that can be remembered.
    """

    cuts: tuple[float, ...] = (0.5,)
    local: tuple[float, ...] = (0.0, 0.12, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0)
    levels: tuple[int, ...] = (0, 4, 7)
    near: int = 4


_ROUNDING = 1e-6  # more than the rounding errors of the calculation


@dataclass(frozen=True)
class Bound:
    """An upper bound of one mission, whatever the policy.

    Attributes:
        ratio: Upper bound on the expected collection ratio, and so on the product; at most 1.
        prices: (S, K) prices of the cuts [share of a data unit's worth]. A data unit of node k
            in a slot is worth 1 less the prices of all cuts at this slot or later. With prices
            of 1 at the last cut the bound is 1.
        cuts: (S,) the last mission slot of each cut; the last cut is the end of the mission.
        iterations: The most prices that were to be tried.
    """

    ratio: float
    prices: np.ndarray
    cuts: np.ndarray
    iterations: int


class Known(NamedTuple):
    """What is known of a mission before its first slot, arrivals included."""

    starts: np.ndarray
    data: np.ndarray
    nodes: np.ndarray
    rates: np.ndarray
    below: np.ndarray
    phases: paths.Phases
    zones: np.ndarray
    to_zone: np.ndarray


def upper_bound(
    scenario: AnyScenario, seed: int, replication: int, *, iterations: int = ITERATIONS
) -> Bound:
    """An upper bound on the expected collection ratio of any policy in one mission.

    The mission's parameters, start cells, initial data and arrivals are given; the expectation is
    over the shadowing.

    Args:
        scenario: The scenario, without sections beyond the paper, or what ``load_scenario`` takes.
        seed: Seed of the mission.
        replication: Number of the replication.
        iterations: How many prices are tried.

    Raises:
        InputError: If the scenario has no bound, or the seed or the replication is out of range.
    """
    (space,) = spaces_of([scenario])
    check_scenario(space)
    return improve_prices(known_of(space, seed, replication), iterations, Detail())


def check_scenario(scenario: ScenarioSpace) -> None:
    """Refuse a scenario whose missions have no bound.

    Raises:
        InputError: If it has a section beyond the paper, or if a bound takes too much memory.
    """
    if scenario.is_extended:
        raise InputError("bound", "the scenario has sections beyond the paper", "none of them")
    memory = ceilings_memory(scenario, Detail())
    if memory > MOST_MEMORY:
        raise InputError(
            "bound",
            f"a mission takes {memory / 2**30:,.1f} GiB of memory",
            f"{MOST_MEMORY / 2**30:.0f} GiB at most, with fewer cells (grid) or slots "
            "(quota, max_slots)",
        )


def ceilings_memory(scenario: ScenarioSpace, detail: Detail) -> int:
    """The memory [bytes] of ``Bounds.ceilings`` in the mission that takes the most."""
    slots = paths.most_flying(scenario)
    near = min(detail.near, max(len(scenario.nodes) - 1, 1))
    battery = scenario.flying_time[0], scenario.charge_start[1], scenario.charge_complete[0]
    phases = 1
    if scenario.flight_cost:
        phases = 2 + len(paths.early_charges(slots, *battery))
    return (
        math.prod(_shape_of_ceilings(slots, phases, scenario.size, near, detail))
        * np.dtype(float).itemsize
    )


def _shape_of_ceilings(
    slots: int, phases: int, size: tuple[int, int], near: int, detail: Detail
) -> tuple[int, ...]:
    """The shape of ``Bounds.ceilings``, with ``near`` blocks that can be remembered."""
    memories = 1 + near * (len(detail.levels) - 1)
    return slots + 1, phases, *size, memories, len(detail.local)


def known_of(scenario: ScenarioSpace, seed: int, replication: int) -> Known:
    """What seed and replication tell of a mission."""
    sampled = sample_scenario(scenario, seed, replication)
    phases = paths.phases_of(sampled)
    state = state_of([scenario], 1)
    rules.launch(state, 0, starts_of([scenario], seed), 0, replication)
    record = state.missions[0]
    starts = np.stack([state.uavs[0][axis][: sampled.uavs] for axis in "xy"], axis=1)
    residual = state.residual[0]
    scratch = empty_scratch(1, len(residual))
    data = _data_by(record, residual, state.sensors[0], phases.slots, scratch)
    world = world_of(scenario)
    if scenario.shadowing_variance > 0:
        points = POINTS
    else:
        points = np.zeros(1)
    if scenario.shadowing_variance > 0:
        below = spread_normal(points)
    else:
        below = np.array([0.0, 1.0])
    rates = rates_of(record, world.mean_snr, points)
    zones = np.array(scenario.rectangles)
    cells = world.chart.zones
    ways = chart.spread(cells, world.chart.parking)[0].reshape(cells.shape)
    to_zone = ways.T.astype(np.int64, order="C")
    return Known(starts, data, world.nodes, rates, below, phases, zones, to_zone)


@kernel
def _data_by(mission, residual, sensors, slots, scratch):
    """(T + 1, K) the data that each node has had by the start of slot t = 0..T."""
    data = np.empty((slots + 1, len(residual)))
    had = residual.copy()
    for t in range(slots):
        data[t] = had
        mission.slot = t
        rules.arrive(mission, had, sensors, scratch)
    data[slots] = had
    return data


class Bounds:
    """The bound of one mission as a function of the prices."""

    def __init__(self, known: Known, detail: Detail):
        self.known = known
        size = known.to_zone.shape
        phases, slots = known.phases.clock.shape
        self.blocks = paths.blocks_of(known.nodes, size, detail.near, np.array(detail.levels))
        self.parts = np.array(detail.local)
        last = int(known.phases.clock.max())
        inner = np.array([int(part * last) for part in detail.cuts], np.int64)
        self.cuts = np.append(inner, last)
        times = np.arange(len(known.data))
        self.period = np.searchsorted(inner, times)
        self.values = np.empty((len(self.cuts), 5, *size, len(self.parts)))
        self.ceilings = np.empty(
            _shape_of_ceilings(slots, phases, size, self.blocks.near.shape[1], detail)
        )

    def at(self, prices: np.ndarray) -> tuple[float, np.ndarray]:
        """The bound at prices (S, K), as a share of all data, and its derivatives (S, K)."""
        mission = self.known
        cuts = self.cuts[:-1]
        team = len(mission.starts)
        data = mission.data
        total = mission.data[-1].sum()
        worth = np.maximum(1.0 - prices[::-1].cumsum(axis=0)[::-1], 0.0)
        local = worth[-1][:, None] * self.parts
        waiting = ((1.0 - prices[-1]) * data).sum(axis=1) / team
        service = (mission.nodes, mission.rates, mission.below)
        step_values(worth, local, mission.nodes, self.blocks.home, *service[1:], self.values)
        problem = paths.BoundProblem(
            mission.to_zone, mission.phases, data, self.period, self.blocks, local
        )
        paths.bound_paths(problem, self.values, waiting, self.ceilings)
        bound = total + (prices[:-1] * data[cuts]).sum()
        slope, takings = np.zeros(prices.shape), np.zeros(prices.shape)
        slope[:-1] = data[cuts]
        for x, y in mission.starts:
            most, end = add_slopes(
                problem, self.parts, self.values, waiting, self.ceilings, x, y, worth, *service,
                takings,
            )  # fmt: skip
            bound += most
            slope[-1] += data[end] / team
        takings[worth == 0] = 0.0
        return bound / total, (slope - takings.cumsum(axis=0)) / total


def improve_prices(known: Known, iterations: int, detail: Detail) -> Bound:
    """Search for prices with a low bound; the lowest bound found is kept."""
    bounds = Bounds(known, detail)
    shape = len(bounds.cuts), len(known.nodes)
    most = np.full(shape, np.inf)
    most[-1] = 1.0
    # with prices of 1 at the end
    kept = most
    lowest = 1.0
    if known.data[-1].sum() > 0 and iterations > 0:
        kept, lowest = _descend_to_minimum(bounds, _first_prices(known, shape), most, iterations)
    if lowest * (1.0 + _ROUNDING) >= 1.0:
        kept = np.where(np.isinf(most), 0.0, most)
        lowest = 1.0
    return Bound(min(lowest * (1.0 + _ROUNDING), 1.0), kept, bounds.cuts, iterations)


def _first_prices(known: Known, shape: tuple[int, int]) -> np.ndarray:
    """High prices near a zone, where data are easy to fetch, and low ones far away."""
    centres = known.zones[:, :2] + known.zones[:, 2:] / 2
    distance = np.abs(known.nodes[:, None] - centres).sum(axis=-1).min(axis=-1)
    prices = np.zeros(shape)
    prices[-1] = 1.0 - (1.0 - (1.0 - distance / (distance.max() + 1)) ** 2) / len(known.starts) ** 2
    return prices


def _descend_to_minimum(
    bounds: Bounds, prices: np.ndarray, most: np.ndarray, iterations: int
) -> tuple[np.ndarray, float]:
    """The prices with the lowest bound of those that the bundle method tries, and the bound."""
    points = np.empty((iterations, prices.size))
    values = np.empty(iterations)
    slopes = np.empty(points.shape)
    centre = prices
    lowest = np.inf
    width = 0.0
    predicted = np.inf
    for i in range(iterations):
        values[i], slope = bounds.at(prices)
        points[i] = prices.ravel()
        slopes[i] = slope.ravel()
        if i == 0:
            width = 1.0
            if slope.any():
                width = _FIRST_DECREASE / (slope**2).sum()
        elif values[i] < lowest - 0.5 * (lowest - predicted):
            width *= 2.0
        elif values[i] > lowest + (lowest - predicted):
            width *= 0.6
        if values[i] < lowest:
            centre = prices
            lowest = float(values[i])
        if lowest > 1.0 and i >= iterations // _HOPE:
            break  # a bound of 1 is known already
        if i + 1 < iterations:
            chosen, predicted = next_prices(
                centre.ravel(), most.ravel(), lowest, points[: i + 1], values[: i + 1],
                slopes[: i + 1], width,
            )  # fmt: skip
            prices = _at_most_one(chosen.reshape(prices.shape))
    return centre, lowest


def _at_most_one(prices: np.ndarray) -> np.ndarray:
    """Prices whose sum over the cuts is at most 1; more raises the bound and changes no worth."""
    sums = np.minimum(prices[::-1].cumsum(axis=0)[::-1], 1.0)
    return sums - np.vstack([sums[1:], np.zeros(prices.shape[1])])
