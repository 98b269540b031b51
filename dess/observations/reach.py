"""How much battery a UAV needs to reach the charging zone, where that is not one percent per cell.

    table = reach_of(view.state.missions, view.world.chart)
    table[0, s - 1, y, x]       # [%] from a cell, for a UAV that takes s mission slots per cell

The cost of a way depends on the wind and on the speed of the UAV. A table has the cheapest way from
every cell (Bellman and Ford's algorithm). Without wind and slow UAVs there is no table.
"""

from functools import lru_cache
from itertools import product

import numpy as np

from dess.sea.chart import NO_FLY, Chart
from dess.sections.wind import surcharges
from dess.state import STEP_X, STEP_Y

_FAR = 2**62  # further than any cell

# The fields of ``MISSION`` that a table depends on.
_FIELDS = ("slowest", "wind_x", "wind_y", "wind_gusts", "wind_seed")


def reach_of(missions: np.ndarray, chart: Chart) -> np.ndarray | None:
    """(1 + Z, S, H, W) battery [%] to any zone and to each of Z zones, for 1 to S slots per cell.

    A single zone has only the first of these. None if every cell costs one percent; then the
    compiler leaves out the code for the table.

    Args:
        missions: (B,) ``MISSION`` records of one batch, which share wind and fleet.
        chart: Their chart.
    """
    mission = missions[0]
    if mission["wind_most"] == 0 and mission["slowest"] == 1:
        return None
    zones = chart.zones
    return _table(zones.shape, zones.tobytes(), *(mission[field].item() for field in _FIELDS))


@lru_cache(maxsize=16)
def _table(shape: tuple[int, int], zones: bytes, slowest: int, *wind) -> np.ndarray:
    cells, (rows, columns) = np.frombuffer(zones, np.int8).reshape(shape), shape
    count = int(cells.max()) + 1
    table = np.full((1 + count if count > 1 else 1, slowest, *shape), _FAR)
    for number, s in product(range(len(table)), range(1, slowest + 1)):
        costs = table[number, s - 1]
        costs[cells == number - 1 if number else cells >= 0] = 0
        before = np.zeros(0)
        while not np.array_equal(before, costs):
            before = costs.copy()
            extras = surcharges((columns, rows), *wind)
            for extra, x, y in zip(extras, 1 + STEP_X, 1 + STEP_Y, strict=False):
                onto = np.pad(np.minimum(costs + s + extra, _FAR), 1, constant_values=_FAR)
                onto = onto[y : y + rows, x : x + columns]
                costs[cells != NO_FLY] = np.minimum(costs, onto)[cells != NO_FLY]
    table.flags.writeable = False
    return table
