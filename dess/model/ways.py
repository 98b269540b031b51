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

from dess.base.kernels import inlined
from dess.model.state import ENERGY_PART, part_of
from dess.physics.chart import NO_FLY, Chart, neighbours_of, read_only, spread_costs
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
    homes = np.frombuffer(parking, np.int64).reshape(groups, -1, 2)
    if mission["gusts"] == 0 and not (cells == NO_FLY).any():
        ways = [_straight_ways(homes, _even_costs(mission, s + 1), shape) for s in range(slowest)]
        return read_only(np.stack(ways, axis=1))
    table = np.full((groups, slowest, cells.size), FAR, np.int32)
    neighbours, nearest = neighbours_of(cells), np.zeros(cells.size, np.int32)
    for s in range(slowest):
        moves = move_costs(mission, s + 1, shape).reshape(HOVERING, -1)
        for group, numbers in enumerate(homes[:, :, 1] * shape[1] + homes[:, :, 0]):
            spread_costs(neighbours, numbers, moves, False, FAR, table[group, s], nearest)
    return read_only(table.reshape(groups, slowest, *shape))


def _straight_ways(homes: np.ndarray, costs: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """(G, H, W) the battery to the nearest of (G, N, 2) cells, where no cell is closed.

    Moves have the same (4,) costs everywhere, so no way is cheaper than one without a detour.
    """
    north, east, south, west = costs
    to_east = homes[..., :1] - np.arange(shape[1])
    to_south = homes[..., 1:] - np.arange(shape[0])
    along = np.where(to_east > 0, to_east * east, -to_east * west)
    across = np.where(to_south > 0, to_south * south, -to_south * north)
    ways = across[..., :, None].astype(np.int32) + along[..., None, :].astype(np.int32)
    return np.asarray(ways.min(axis=1))


def move_costs(mission: np.void, slots_per_cell: int, shape: tuple[int, int]) -> np.ndarray:
    """(4, H, W) what the moves north, east, south and west into a cell take [% / 1000]."""
    moves = np.empty((HOVERING, *shape), np.int64)
    if mission["gusts"] > 0:
        fill_move_costs(mission, slots_per_cell, moves)
    else:
        moves[:] = _even_costs(mission, slots_per_cell)[:, None, None]
    return moves


def _even_costs(mission: np.void, slots_per_cell: int) -> np.ndarray:
    """(4,) what the moves north, east, south and west take, where there are no gusts [% / 1000]."""
    costs = mission["slot_costs"].reshape(-1, ACTIONS)[slots_per_cell - 1, :HOVERING]
    return np.asarray(slots_per_cell * costs.astype(np.int64))


class WaysOfPlaces:
    """The same tables where the missions of a batch change their energy one by one.

    Attributes:
        reach: (B, C, S, H, W) as ``Ways.reach``, whose missions have the number of their place.
        home: (B, S, H, W) as ``Ways.home``.
    """

    def __init__(self, places: int, slowest: int, chart: Chart):
        """Make room for so many places, whose fleets take at most ``slowest`` slots for a cell."""
        self._sea = (chart.zones.shape, chart.zones.tobytes(), chart.parking.tobytes())
        self._slowest = slowest
        cells, size = len(chart.parking), chart.zones.size
        speeds = slowest
        if cells * slowest * size > MOST_ENTRIES:
            speeds = 0
        self._reach = np.zeros((places, cells, speeds, *chart.zones.shape), np.int32)
        self._home = np.zeros((places, slowest, *chart.zones.shape), np.int32)
        # Of the types that those of ``Ways`` have, so that functions are compiled once for both.
        self.reach, self.home = read_only(self._reach[:]), read_only(self._home[:])

    def fill(self, b: int, missions: np.ndarray) -> None:
        """Compute the tables of place ``b`` for the energy of its mission, of (1,) records."""
        energy = part_of(missions, ENERGY_PART).tobytes()
        for table, groups in ((self._reach, self.reach.shape[1]), (self._home[:, None], 1)):
            table[b] = _filled(*self._sea, groups, self._slowest, energy)
