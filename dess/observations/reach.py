"""How much battery a UAV needs to reach a parking cell, where that is not one percent per cell.

    table = reach_of(view.state.missions, view.world.chart)
    table[c, s - 1, y, x]       # [%] to parking cell c, for a UAV that takes s slots per cell

The cost of a way depends on the wind and on the speed of the UAV. A table has the cheapest way from
every cell (Bellman and Ford's algorithm). Without wind and slow UAVs there is no table.
"""

from functools import lru_cache

import numpy as np

from dess.code.kernels import kernel
from dess.sea.chart import NO_FLY, Chart
from dess.sections.wind import surcharges
from dess.state import PLAIN_MISSION

FAR = 2**15 - 1  # [%]: further than any cell
_MOST_ENTRIES = 2**26  # 128 MB

# The fields of ``MISSION`` that a table depends on.
_FIELDS = ("slowest", "wind_x", "wind_y", "wind_gusts", "wind_seed")


def reach_of(missions: np.ndarray, chart: Chart) -> np.ndarray | None:
    """(C, S, H, W) battery [%] to each of C parking cells, for 1 to S slots per cell.

    None if every cell costs one percent; then the compiler leaves out the code for the table. A
    table that would be larger than 128 MB is empty: then every cell may cost the most.

    Args:
        missions: (B,) ``MISSION`` records of one batch, which share wind and fleet.
        chart: Their chart.
    """
    if missions.dtype == PLAIN_MISSION:  # no section is on, so neither wind nor slow UAVs
        return None
    mission = missions[0]
    if mission["wind_most"] == 0 and mission["slowest"] == 1:
        return None
    sea = (chart.zones.shape, chart.zones.tobytes(), chart.parking.tobytes())
    return _table(*sea, *(mission[field].item() for field in _FIELDS))


@lru_cache(maxsize=16)
def _table(shape: tuple[int, int], zones: bytes, parking: bytes, slowest: int, *wind) -> np.ndarray:
    cells, (rows, columns) = np.frombuffer(zones, np.int8).reshape(shape), shape
    homes = np.frombuffer(parking, np.int64).reshape(-1, 2)
    if len(homes) * slowest * cells.size > _MOST_ENTRIES:
        return np.zeros((0, 0, 0, 0), np.int16)
    table = np.full((len(homes), slowest, *shape), FAR, np.int16)
    extras = surcharges((columns, rows), *wind)
    for c, (x, y) in enumerate(homes):
        for s in range(slowest):
            table[c, s, y, x] = 0
            _relax(cells, extras, s + 1, table[c, s])
    table.flags.writeable = False
    return table


@kernel
def _relax(zones, extras, slots, costs):
    """Lower the costs of all cells to those of the cheapest ways to the cell that costs nothing."""
    rows, columns = zones.shape
    changed, forth = True, True
    while changed:
        changed = False
        for place in range(zones.size):
            cell = place if forth else zones.size - 1 - place
            y, x = cell // columns, cell % columns
            if zones[y, x] == NO_FLY:
                continue
            for action, (step_x, step_y) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
                a, b = x + step_x, y + step_y
                if 0 <= a < columns and 0 <= b < rows and costs[b, a] < FAR:
                    cost = min(costs[b, a] + slots + extras[action, b, a], FAR - 1)
                    if cost < costs[y, x]:
                        costs[y, x] = cost
                        changed = True
        forth = not forth
