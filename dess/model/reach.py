"""Which nodes a lone UAV can serve, from a full battery and back within the horizon.

    >>> reach = reach_of_nodes(load_scenario("paper"))
    >>> reach.lost      # the nodes that no UAV of the fleet can serve
    ()

A node is in range of a cell if its mean SNR there, without shadowing, reaches the lowest rate, and
it lies within the range of the radio. A UAV flies from some zone to a cell where the node is in
range, hovers there for a slot, and flies to some zone, where it has to stand in the last slot.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from dess.model.guard.battery import margin
from dess.model.link import Link, least_snr, mean_snr_at
from dess.model.state import constants_of, types_of
from dess.model.ways import FAR as WAYS_FAR
from dess.model.ways import move_costs
from dess.physics import fleet
from dess.physics.chart import (
    FAR,
    Cell,
    neighbours_of,
    parking_of,
    read_only,
    spread,
    spread_costs,
    zones_of,
)
from dess.physics.energy import ACTIONS, HOVERING, PERCENT, waiting_slot
from dess.scenario.scenario import ScenarioSpace


class SlotCosts(NamedTuple):
    """What a UAV takes of its battery in the air [% / 1000].

    Attributes:
        moves: (4, H, W) a move into a cell: to the north, east, south and west.
        hover: A slot of hovering.
    """

    moves: np.ndarray
    hover: int


class Reach(NamedTuple):
    """The nodes that cannot be served.

    Attributes:
        lost: The nodes that no UAV can serve, by their numbers.
        margins: The further nodes to which the return guard lets no UAV of the fleet fly, because
            of the margins that it keeps for teammates.
        largest_ratio: The share of all data that the other nodes have.
        cells: How far a UAV can fly along a line and back [cells], the more expensive of both axes.
        has_limit: Whether there is a range or a lowest rate; otherwise every node is in range.
    """

    lost: tuple[int, ...]
    margins: tuple[int, ...]
    largest_ratio: float
    cells: int
    has_limit: bool


def reach_of_nodes(space: ScenarioSpace) -> Reach:
    """What the UAVs of the largest fleet of a scenario can serve."""
    uavs = space.uavs[1]
    nodes = range(len(space.nodes))
    served_alone: set[int] = set()
    served_in_fleet: set[int] = set()
    cells = 0
    for number in range(min(uavs, max(len(space.fleet), 1))):
        costs = costs_of(space, number)
        battery = PERCENT * _full_battery(space, number)
        kept = _battery_of_guard(space, number)
        trips = battery_of_trips(space, costs)
        slots = _slots_of_trips(space, number)
        is_lasting = slots < space.max_slots
        served_alone |= _served(space, is_lasting & (trips < battery))
        served_in_fleet |= _served(space, is_lasting & (trips <= battery - kept))
        cells = max(cells, _cells_along_a_line(costs, battery))
    lost = tuple(k for k in nodes if k not in served_alone)
    margins = tuple(k for k in nodes if k in served_alone and k not in served_in_fleet)
    return Reach(
        lost, margins, _share_of_others(space, {*lost, *margins}), cells, _has_limit(space)
    )


def costs_of(space: ScenarioSpace, uav: int) -> SlotCosts:
    """What a UAV takes of its battery, by its number in the fleet."""
    constants = constants_of(space)[0]
    slots = fleet.type_of(space.fleet, uav).slots_per_cell
    columns, rows = space.size
    hovering = constants["slot_costs"].reshape(-1, ACTIONS)[slots - 1, HOVERING]
    return SlotCosts(move_costs(constants, slots, (rows, columns)), int(hovering))


def battery_of_trips(space: ScenarioSpace, costs: SlotCosts) -> np.ndarray:
    """(H, W) the battery [% / 1000] to a cell, for a slot there, and to a zone.

    It is infinite where no trip leads, and in zones, where a UAV that hovers is on the ground.
    """
    zones = zones_of(*space.size, space.rectangles, space.no_fly)
    out = _cheapest(zones, costs.moves, outward=True)
    back = _cheapest(zones, costs.moves, outward=False)
    return np.where(zones >= 0, math.inf, out + costs.hover + back)


def _window(about: np.ndarray, node: Cell) -> np.ndarray:
    """(H, W) what a table by the place of a UAV about a node has for the cells of the grid."""
    rows, columns = (np.array(about.shape) + 1) // 2
    x, y = node
    return about[rows - 1 - y : 2 * rows - 1 - y, columns - 1 - x : 2 * columns - 1 - x]


def _in_range_about(space: ScenarioSpace) -> np.ndarray:
    """(2 H - 1, 2 W - 1) whether a node is in range, by where the UAV is about it."""
    return _in_range_of(Link.of(space), space.cell_size, space.size, least_snr(space))


@lru_cache(maxsize=8)
def _in_range_of(link: Link, cell_size: float, size: tuple[int, int], least: float) -> np.ndarray:
    """As ``_in_range_about``, for an SNR that is high enough."""
    columns, rows = size
    across = np.arange(1 - columns, columns)
    down = np.arange(1 - rows, rows)[:, None]
    snr = mean_snr_at(link, cell_size * np.sqrt(across * across + down * down))
    return read_only((snr > -math.inf) & (snr >= least))


def _has_limit(space: ScenarioSpace) -> bool:
    return bool(space.radio.range or space.radio.steps)


def _served(space: ScenarioSpace, is_reached: np.ndarray) -> set[int]:
    """The nodes that are in range of some of these cells."""
    about = _in_range_about(space)
    nodes = enumerate(space.nodes)
    return {k for k, node in nodes if (is_reached & _window(about, node)).any()}


def _cheapest(zones: np.ndarray, moves: np.ndarray, outward: bool) -> np.ndarray:
    """(H, W) the cheapest ways from some zone to each cell, or from each cell to some zone."""
    costs = np.full(zones.size, WAYS_FAR, np.int32)
    nearest = np.zeros(zones.size, np.int32)
    sources = np.flatnonzero(zones >= 0)
    table = moves.reshape(len(moves), -1)
    spread_costs(neighbours_of(zones), sources, table, outward, WAYS_FAR, costs, nearest)
    return np.where(costs == WAYS_FAR, math.inf, costs).reshape(zones.shape)


def _slots_of_trips(space: ScenarioSpace, uav: int) -> np.ndarray:
    """(H, W) the slots of the shortest way to a cell, of a slot there, and of the way back."""
    zones = zones_of(*space.size, space.rectangles, space.no_fly)
    ways, _ = spread(zones, np.array(parking_of(space.rectangles)))
    slots = fleet.type_of(space.fleet, uav).slots_per_cell
    cells = np.where(ways == FAR, math.inf, ways).reshape(zones.shape)
    return 2 * cells * slots + 1


def _full_battery(space: ScenarioSpace, uav: int) -> int:
    """The most battery with which a UAV leaves a zone [%]: at the start, or when it is charged."""
    kind = fleet.type_of(space.fleet, uav)
    start = kind.flying_time or max(space.flying_time)
    full = max(start, *space.charge_complete)
    return min(full, space.battery_of_type(kind) or full)


def _battery_of_guard(space: ScenarioSpace, uav: int) -> int:
    """What the return guard keeps of the battery [% / 1000]: its margins, and the last slot."""
    mission = constants_of(space).view(np.recarray)[0]
    mission.active = space.uavs[1]
    u = types_of(space).view(np.recarray)[uav]
    return int(margin(mission, u) + waiting_slot(mission))


def _cells_along_a_line(costs: SlotCosts, battery: int) -> int:
    """The cells along a line for which a battery lasts there and back, with a slot there."""
    north, east, south, west = (int(move.max()) for move in costs.moves)
    most_expensive = max(north + south, east + west)
    return max((battery - costs.hover - 1) // most_expensive, 0)


def _share_of_others(space: ScenarioSpace, nodes: set[int]) -> float:
    """The share that the other nodes have of all data of a mission; 1 if there are none."""
    amounts = [
        (low + high) / 2 + rate * space.max_slots
        for (low, high), rate in zip(space.node_data, space.node_rates, strict=True)
    ]
    total = math.fsum(amounts)
    if total == 0:
        return 1.0
    return math.fsum(amount for k, amount in enumerate(amounts) if k not in nodes) / total
