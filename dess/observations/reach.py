"""How much battery a UAV needs to reach the charging zone, where that is not one percent per cell.

    table = reach_of(view.state.missions)
    table[s - 1, y, x]          # [%] from a cell, for a UAV that takes s mission slots per cell

The cost of a way depends on the wind and on the speed of the UAV. A table has the cheapest way from
every cell (Bellman and Ford's algorithm). Without wind and slow UAVs there is no table.
"""

from functools import lru_cache

import numpy as np

from dess.sections.wind import surcharges
from dess.state import STEP_X, STEP_Y

_FAR = 2**62  # further than any cell

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
    table = np.full((slowest, grid, grid), _FAR)
    table[:, zone_y : zone_y + zone_height, zone_x : zone_x + zone_width] = 0
    for s, costs in enumerate(table, 1):
        before = np.zeros(0)
        while not np.array_equal(before, costs):
            before = costs.copy()
            for extra, x, y in zip(surcharges(grid, *wind), 1 + STEP_X, 1 + STEP_Y, strict=False):
                onto = np.pad(np.minimum(costs + s + extra, _FAR), 1, constant_values=_FAR)
                np.minimum(costs, onto[y : y + grid, x : x + grid], out=costs)
    table.flags.writeable = False
    return table
