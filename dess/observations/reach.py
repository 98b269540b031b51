"""How much battery a UAV needs to reach the charging zone, where that is not one percent per cell.

    table = reach_of(view.state.missions)
    table[s - 1, y, x]          # [%] from a cell, for a UAV that takes s mission slots per cell

The cost of a way depends on the wind and on the speed of the UAV. A table has the cheapest way from
every cell (Dijkstra's algorithm). Without wind and slow UAVs there is no table.
"""

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from dess.sections.wind import surcharges
from dess.state import STEP_X, STEP_Y

# The fields of ``MISSION`` that a table depends on.
_FIELDS = (
    *("grid", "zone_x", "zone_y", "zone_width", "zone_height", "slowest"),
    *("wind_x", "wind_y", "wind_gusts", "wind_seed"),
)


def reach_of(missions: np.ndarray) -> np.ndarray | None:
    """(S, M, M) battery [%] to the nearest cell of the zone, for 1 to S slots per cell.

    None if every cell costs one percent; then the compiler leaves out the code for the table.

    Args:
        missions: (B,) ``MISSION`` records of one batch, which share grid, zone, wind and fleet.
    """
    mission = missions[0]
    if mission["wind_most"] == 0 and mission["slowest"] == 1:
        return None
    return _table(*(mission[field].item() for field in _FIELDS))


@lru_cache(maxsize=16)
def _table(grid, zone_x, zone_y, zone_width, zone_height, slowest, *wind) -> np.ndarray:
    extra = surcharges(grid, *wind)
    cells = np.arange(grid * grid).reshape(grid, grid)
    zone = cells[zone_y : zone_y + zone_height, zone_x : zone_x + zone_width].ravel()
    inner = slice(1, -1)
    table = np.empty((slowest, grid, grid), np.int64)
    for s in range(1, slowest + 1):
        costs, starts, ends = [], [], []
        for action in range(4):
            padded = np.pad(cells, 1, constant_values=-1)
            before = np.roll(padded, (STEP_Y[action], STEP_X[action]), (0, 1))[inner, inner]
            inside = before >= 0
            costs.append(s + extra[action][inside])
            starts.append(before[inside])
            ends.append(cells[inside])
        ways = (np.concatenate(ends), np.concatenate(starts))  # from the zone, backwards
        graph = csr_array((np.concatenate(costs), ways), (cells.size, cells.size))
        table[s - 1] = dijkstra(graph, indices=zone, min_only=True).reshape(grid, grid)
    table.flags.writeable = False
    return table
