"""The battery that the cheapest ways take.

The cost of a way depends on what slots take of the battery (``dess.physics.energy``) and on the
speed of the UAV. The missions of a batch may have different energies, each with a table of its
own::

    ways = Ways(starts.constants, chart)
    ways.reach[e, c, s - 1, y, x]   # to parking cell c, for a UAV that takes s slots per cell
    ways.home[e, s - 1, y, x]       # to the nearest zone cell

where ``e`` is the field ``energy`` of a mission. Costs are in thousandths of a percent. Where every
slot takes one percent, the return guard needs no table: distances tell the same.
"""

from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.model.state import ENERGY_PART, part_of
from dess.physics.chart import NO_FLY, Chart, read_only
from dess.physics.energy import ACTIONS, HOVERING, fill_move_costs

FAR = 2**30  # further than any cell
MOST_ENTRIES = 2**25  # of the tables of a batch: 128 MB


# The tables of extended missions in which every cell costs one percent, which need none.
_CALM = read_only(np.zeros((0, 0, 0, 0, 0), np.int32))


@inlined
def is_calm(reach):
    """Whether every cell costs one percent, by the tables of ``Ways.reach``."""
    return reach is None or len(reach) == 0


class Ways:
    """The tables of the missions of a batch, each of which is computed when it is first needed."""

    def __init__(self, missions: np.ndarray, chart: Chart):
        """Prepare the tables.

        Args:
            missions: ``MISSION`` records with each energy of the batch, which share their fleet.
            chart: Their chart.
        """
        self._missions, self._chart = missions, chart

    def __reduce__(self) -> tuple[Any, ...]:
        return Ways, (self._missions, self._chart)  # tables of a copy are read-only as well

    @cached_property
    def reach(self) -> np.ndarray | None:
        """(E, C, S, H, W) battery to each of C parking cells, for 1 to S slots per cell.

        If every cell costs one percent, E is 0, or the table is None in missions without sections,
        so that the compiler leaves out its code. If a table would be larger than 128 MB, S is 0:
        then every cell may cost the most.
        """
        if "is_plain" in (self._missions.dtype.names or ()):  # neither wind nor slow UAVs
            return None
        first = self._missions[0]
        if first["slowest"] == 1 and not first["has_costs"]:
            return _CALM
        return self._tables(len(self._chart.parking))

    @cached_property
    def home(self) -> np.ndarray:
        """(E, S, H, W) battery from each cell to the nearest zone cell."""
        return self._tables(1)[:, 0]

    def _tables(self, groups: int) -> np.ndarray:
        """(E, G, S, H, W) battery to the nearest of each of G groups of parking cells."""
        chart = self._chart
        sea = (chart.zones.shape, chart.zones.tobytes(), chart.parking.tobytes())
        slowest = int(self._missions[0]["slowest"])
        energies = self._missions["energy"]
        tables = []
        for number in range(int(energies.max()) + 1):
            first = np.argmax(energies == number)
            energy = part_of(self._missions[first : first + 1], ENERGY_PART)
            tables.append(_filled(*sea, groups, slowest, energy.tobytes()))
        if len(tables) == 1:
            return tables[0][None]
        return read_only(np.stack(tables))


@lru_cache(maxsize=16)
def _filled(
    shape: tuple[int, int], zones: bytes, parking: bytes, groups: int, slowest: int, energy: bytes
) -> np.ndarray:  # fmt: skip
    """(G, S, H, W) battery to the nearest of each of G groups of parking cells."""
    cells = np.frombuffer(zones, np.int8).reshape(shape)
    if groups * slowest * cells.size > MOST_ENTRIES:
        return read_only(np.zeros((groups, 0, 0, 0), np.int32))
    mission = np.frombuffer(energy, ENERGY_PART)[0]
    table = np.full((groups, slowest, *shape), FAR, np.int32)
    for s in range(slowest):
        moves = move_costs(mission, s + 1, shape)
        for group, homes in enumerate(np.frombuffer(parking, np.int64).reshape(groups, -1, 2)):
            table[group, s, homes[:, 1], homes[:, 0]] = 0
            relax(cells, moves, table[group, s], False)
    return read_only(table)


def move_costs(mission: np.void, slots_per_cell: int, shape: tuple[int, int]) -> np.ndarray:
    """(4, H, W) what the moves north, east, south and west into a cell take [% / 1000]."""
    moves = np.empty((HOVERING, *shape), np.int64)
    if mission["gusts"] > 0:
        fill_move_costs(mission, slots_per_cell, moves)
    else:
        costs = mission["slot_costs"].reshape(-1, ACTIONS)[slots_per_cell - 1, :HOVERING]
        moves[:] = slots_per_cell * costs.astype(np.int64)[:, None, None]
    return moves


@kernel
def relax(zones, moves, costs, outward):
    """Lower the costs of all cells to those of the cheapest ways.

    A cell whose cost has been lowered is put into a queue, and its neighbours are looked at when it
    comes out (Moore's algorithm). Most cells come there once, since ways of few cells cost least.

    Args:
        zones: (H, W) as in ``Chart``.
        moves: (4, H, W) what the moves north, east, south and west into a cell cost.
        costs: (H, W) the costs; 0 where the ways end and ``FAR`` elsewhere.
        outward: Whether the ways lead from there to the cells, and not back.
    """
    rows, columns = zones.shape
    queue = np.empty(zones.size, np.int32)
    waits = np.zeros(zones.size, np.bool_)
    first, count = 0, 0
    for cell in range(zones.size):
        if costs[cell // columns, cell % columns] == 0:
            queue[count] = cell
            waits[cell] = True
            count += 1
    while count > 0:
        cell = queue[first]
        first = first + 1 if first + 1 < zones.size else 0
        count -= 1
        waits[cell] = False
        y = cell // columns
        x = cell - y * columns
        for action, (step_x, step_y) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
            a = x + step_x if outward else x - step_x
            b = y + step_y if outward else y - step_y
            if not (0 <= a < columns and 0 <= b < rows) or zones[b, a] == NO_FLY:
                continue
            move = moves[action, b, a] if outward else moves[action, y, x]
            cost = min(costs[y, x] + move, FAR - 1)
            if cost >= costs[b, a]:
                continue
            costs[b, a] = cost
            beside = b * columns + a
            if not waits[beside]:
                waits[beside] = True
                last = first + count
                queue[last if last < zones.size else last - zones.size] = beside
                count += 1
