"""The battery that the ways home take.

The cost of a way depends on the wind, on the speed of the UAV and on what slots take of the
battery. A table has the cheapest way from every cell (Bellman and Ford's algorithm)::

    table = reach_of(view.state.missions, view.world.chart)
    table[c, s - 1, y, x]       # to parking cell c, for a UAV that takes s slots per cell

Costs are in percent, or in thousandths of a percent in missions whose slots have costs of their own
(``dess.physics.consumption``). Where every cell costs one percent, there is no table.
"""

from functools import lru_cache

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.physics import wind
from dess.physics.chart import NO_FLY, Chart, read_only
from dess.physics.consumption import ACTIONS

FAR = 2**30  # further than any cell
_MOST_ENTRIES = 2**25  # 128 MB


# The table of extended missions in which every cell costs one percent, which need none.
_CALM = read_only(np.zeros((0, 0, 0, 0), np.int32))


@inlined
def is_calm(reach):
    """Whether every cell costs one percent, by the table of ``reach_of``."""
    return reach is None or len(reach) == 0


def reach_of(missions: np.ndarray, chart: Chart) -> np.ndarray | None:
    """(C, S, H, W) battery to each of C parking cells, for 1 to S slots per cell.

    If every cell costs one percent, C is 0, or the table is None in missions without sections, so
    that the compiler leaves out its code. If it would be larger than 128 MB, S is 0: then every
    cell may cost the most.

    Args:
        missions: (B,) ``MISSION`` records of one batch, which share wind, consumption and fleet.
        chart: Their chart.
    """
    if "is_plain" in (missions.dtype.names or ()):  # neither wind nor slow UAVs
        return None
    first = missions[0]
    if first["wind_most"] == 0 and first["slowest"] == 1 and not first["has_consumption"]:
        return _CALM
    return _table(missions, chart, len(chart.parking))


def ways_home(missions: np.ndarray, chart: Chart) -> np.ndarray:
    """(S, H, W) battery from each cell to the nearest zone cell, for 1 to S slots per cell.

    Args:
        missions: (B,) ``MISSION`` records of one batch, which share wind, consumption and fleet.
        chart: Their chart.
    """
    return _table(missions, chart, 1)[0]


def _table(missions: np.ndarray, chart: Chart, groups: int) -> np.ndarray:
    """(G, S, H, W) battery to the nearest of each of G groups of parking cells."""
    sea = (chart.zones.shape, chart.zones.tobytes(), chart.parking.tobytes())
    first = missions[0]
    slowest = int(first["slowest"])
    moves = tuple(first[name].item() for name in wind.FIELDS)
    costs: tuple[int, ...] = ()
    if first["has_consumption"]:
        costs = tuple(first["slot_costs"].tolist())
    return _filled(*sea, groups, slowest, costs, *moves)


@lru_cache(maxsize=16)
def _filled(
    shape: tuple[int, int], zones: bytes, parking: bytes, groups: int, slowest: int,
    costs: tuple[int, ...], *of_wind
) -> np.ndarray:  # fmt: skip
    cells = np.frombuffer(zones, np.int8).reshape(shape)
    if groups * slowest * cells.size > _MOST_ENTRIES:
        return read_only(np.zeros((groups, 0, 0, 0), np.int32))
    table = np.full((groups, slowest, *shape), FAR, np.int32)
    surcharges = wind.surcharges(shape[::-1], *of_wind)
    for s in range(slowest):
        moves = surcharges + (s + 1)
        if costs:
            of_speed = np.array(costs[s * ACTIONS : (s + 1) * ACTIONS - 1])
            moves = np.broadcast_to(((s + 1) * of_speed)[:, None, None], surcharges.shape)
        moves = np.ascontiguousarray(moves)
        for group, homes in enumerate(np.frombuffer(parking, np.int64).reshape(groups, -1, 2)):
            table[group, s, homes[:, 1], homes[:, 0]] = 0
            relax(cells, moves, table[group, s])
    return read_only(table)


@kernel
def relax(zones, moves, costs):
    """Lower the costs of all cells to those of the cheapest ways to the cell that costs nothing.

    Args:
        zones: (H, W) as in ``Chart``.
        moves: (4, H, W) what the moves north, east, south and west into a cell cost.
        costs: (H, W) the costs; 0 where the ways end and ``FAR`` elsewhere.
    """
    rows, columns = zones.shape
    changed, forth = True, True
    while changed:
        changed = False
        for place in range(zones.size):
            cell = place if forth else zones.size - 1 - place
            y = cell // columns
            x = cell % columns
            if zones[y, x] == NO_FLY:
                continue
            for action, (step_x, step_y) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
                a = x + step_x
                b = y + step_y
                if 0 <= a < columns and 0 <= b < rows and costs[b, a] < FAR:
                    cost = min(costs[b, a] + moves[action, b, a], FAR - 1)
                    if cost < costs[y, x]:
                        costs[y, x] = cost
                        changed = True
        forth = not forth
