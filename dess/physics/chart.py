"""The chart of a sea: its charging zones, its no-fly cells and the ways between its cells.

>>> chart = load_scenario("bay").chart
>>> int(chart.zones[12, 10]) == OPEN    # a cell has the number of its zone, OPEN or NO_FLY
True
>>> distance(chart, 3, 4, 10, 12)       # cells on the shortest way
15
"""

from collections.abc import Iterable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel, shared_kernel

Cell = tuple[int, int]
Rectangle = tuple[int, int, int, int]  # x, y, width and height

# Cells in ``Chart.zones`` that are in no zone.
OPEN = -1
NO_FLY = -2
FAR = 2**15 - 1  # [cells]: there is no way

# The most cells of a grid of which the ways between all are kept: 200 MB.
MOST_CHARTED = 10_000


class Chart(NamedTuple):
    """The geometry that all missions of a batch share, for a grid of H rows and W columns.

    Its arrays are read-only; a copy shares them.

    Attributes:
        zones: (H, W) the number of the charging zone of a cell, ``OPEN`` or ``NO_FLY``.
        parking: (C, 2) the cells of the zones, zone by zone and row by row.
        sizes: (Z,) how many cells each zone has.
        nearest: (H, W) the number of the parking cell that is nearest to a cell.
        ways: (W * H, W * H) cells on the shortest way between two cells, numbered row by row, or
            ``FAR``; empty without no-fly cells.
        rows: (W * H,) the row of ``ways`` that a cell has, or -1: on a large grid, only parking
            cells and nodes have one; None where all cells have.
    """

    zones: np.ndarray
    parking: np.ndarray
    sizes: np.ndarray
    nearest: np.ndarray
    ways: np.ndarray
    rows: np.ndarray | None

    def __deepcopy__(self, memo: dict[int, Any]) -> "Chart":
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _chart_of, tuple(self)


def _chart_of(*arrays: Any) -> Chart:
    return Chart(*map(read_only, arrays))


def read_only(array: Any) -> Any:
    """An array, or None, which from now on cannot be written to.

    To numba, it has another type than an array that can; so this is done before its first use.
    """
    if array is not None:
        array.flags.writeable = False
    return array


def zones_of(
    width: int, height: int, zones: Iterable[Rectangle], no_fly: Iterable[Cell]
) -> np.ndarray:
    """``Chart.zones`` of zones and no-fly cells that lie on the grid."""
    cells = np.full((height, width), OPEN, np.int8)
    x, y = np.array([*no_fly], np.int64).reshape(-1, 2).T
    cells[y, x] = NO_FLY
    for number, (left, top, columns, rows) in enumerate(zones):
        cells[top : top + rows, left : left + columns] = number
    return cells


def parking_of(zones: Iterable[Rectangle]) -> list[Cell]:
    """The cells of zones, zone by zone and row by row."""
    return [
        (left + i % width, top + i // width)
        for left, top, width, height in zones
        for i in range(width * height)
    ]


@lru_cache(maxsize=16)
def chart_at(
    width: int,
    height: int,
    zones: tuple[Rectangle, ...],
    no_fly: tuple[Cell, ...],
    nodes: tuple[Cell, ...] = (),
) -> Chart:
    """The chart of a grid with these zones and no-fly cells; only a large grid needs its nodes."""
    cells = zones_of(width, height, zones, no_fly)
    parking = np.array(parking_of(zones), np.int64)
    sizes = np.array([columns * rows for _, _, columns, rows in zones], np.int64)
    nearest = spread(cells, parking)[1].reshape(cells.shape)
    if not no_fly:
        return _chart_of(cells, parking, sizes, nearest, np.empty((0, 0), np.int16), None)
    places = [(x, y) for y, x in np.ndindex(cells.shape)]
    rows = None
    if cells.size > MOST_CHARTED:
        places = [*{*parking_of(zones), *nodes}]
        rows = np.full(cells.size, -1, np.int64)
        rows[[y * width + x for x, y in places]] = np.arange(len(places))
    ways = np.full((len(places), cells.size), FAR, np.int16)
    numbers = np.array([y * width + x for x, y in places])
    fill_ways(cells.reshape(-1), neighbours_of(cells), numbers, ways)
    return _chart_of(cells, parking, sizes, nearest, ways, rows)


def geometry(chart: Chart) -> dict[str, Any]:
    """The fields of a scenario that have this chart, but for the pads of the zones."""
    rows, columns = chart.zones.shape
    corners = [np.argwhere(zone == chart.zones.T) for zone in range(chart.zones.max() + 1)]
    zones = [[*cells[0].tolist(), *np.ptp(cells, 0).tolist()] for cells in corners]
    rectangles = [[x, y, width + 1, height + 1] for x, y, width, height in zones]
    return {
        "grid": columns,
        "rows": None if rows == columns else rows,
        "zone": rectangles[0],
        "zones": [{"cells": cells} for cells in rectangles[1:]],
        "no_fly": np.argwhere(chart.zones.T == NO_FLY).tolist(),
    }


def spread(zones: np.ndarray, sources: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The shortest ways from all cells to the nearest of some cells (breadth-first search).

    Args:
        zones: (H, W) as in ``Chart``.
        sources: (S, 2) cells.

    Returns:
        (H * W,) the cells on the way, ``FAR`` where there is none, and (H * W,) the number of the
        nearest source, the lowest on a tie.
    """
    lengths = np.full(zones.size, FAR, np.int16)
    nearest = np.zeros(zones.size, np.int32)
    cells = sources[:, 1] * zones.shape[1] + sources[:, 0]
    is_open = zones.reshape(-1)[cells] != NO_FLY
    nearest[cells[is_open]] = np.flatnonzero(is_open)
    _spread(neighbours_of(zones), cells[is_open], lengths, nearest)
    return lengths, nearest


def neighbours_of(zones: np.ndarray) -> np.ndarray:
    """(H * W, 4) the numbers of the cells north, east, south and west of a cell; -1 where none."""
    cells = np.full(np.add(zones.shape, 2), -1, np.int32)
    cells[1:-1, 1:-1] = np.where(zones == NO_FLY, -1, np.arange(zones.size).reshape(zones.shape))
    around = cells[:-2, 1:-1], cells[1:-1, 2:], cells[2:, 1:-1], cells[1:-1, :-2]
    return np.stack(around, -1).reshape(-1, 4)


@kernel
def _spread(neighbours, sources, lengths, nearest):
    queue = np.empty(len(lengths), np.int32)
    first = 0
    last = len(sources)
    for number in range(last):
        queue[number] = sources[number]
        lengths[sources[number]] = 0
    while first < last:
        cell = queue[first]
        first += 1
        for side in range(4):
            to = neighbours[cell, side]
            if to >= 0 and lengths[to] == FAR:
                queue[last] = to
                lengths[to] = lengths[cell] + 1
                nearest[to] = nearest[cell]
                last += 1


@kernel
def fill_ways(zones, neighbours, places, ways):
    """Write the ways from these cells to all others, where ``FAR`` stands before, row by row."""
    nearest = np.zeros(len(zones), np.int32)
    for number in range(len(places)):
        if zones[places[number]] != NO_FLY:
            _spread(neighbours, places[number : number + 1], ways[number], nearest)


@shared_kernel
def length_around(zones, ways, rows, closed, x, y, to_x, to_y):
    """The cells on the shortest way between two cells that avoids closed cells, or ``FAR``.

    This is A*. The way without closed cells is a lower bound, which each step from a cell keeps or
    misses by two cells. So the next cell is the last of ``near`` while there is one, and few cells
    beside the way are looked at.

    Args:
        zones, ways, rows: As in ``Chart``.
        closed: (N,) the numbers of cells that the way must not enter, counted row by row.
        x, y: Where the way begins.
        to_x, to_y: Where it ends.
    """
    height, width = zones.shape
    lengths = np.full(zones.size, FAR, np.int16)
    lengths[closed] = -1
    near, far = np.empty(zones.size, np.int64), np.empty(zones.size, np.int64)
    near[0] = y * width + x
    nears = 1
    fars = 0
    lengths[near[0]] = 0
    bound = _at_least(ways, rows, width, x, y, to_x, to_y)
    while nears + fars > 0:
        if nears == 0:
            near, far, nears, fars, bound = far, near, fars, 0, bound + 2
        nears -= 1
        x = near[nears] % width
        y = near[nears] // width
        length = lengths[near[nears]]
        left = _at_least(ways, rows, width, x, y, to_x, to_y)
        if left == 0:
            return np.int64(length)
        if length + left < bound:
            continue  # a shorter way to this cell has been found since it was put there
        for step_x, step_y in ((0, -1), (1, 0), (0, 1), (-1, 0)):
            next_x = x + step_x
            next_y = y + step_y
            if not (0 <= next_x < width and 0 <= next_y < height):
                continue
            to = next_y * width + next_x
            if zones[next_y, next_x] == NO_FLY or length + 1 >= lengths[to]:
                continue
            lengths[to] = length + 1
            if _at_least(ways, rows, width, next_x, next_y, to_x, to_y) < left:
                near[nears] = to
                nears += 1
            else:
                far[fars] = to
                fars += 1
    return np.int64(FAR)


@inlined
def _at_least(ways, rows, width, x, y, to_x, to_y):
    """The cells on the way between two cells or, on a large grid, a lower bound of them."""
    if ways.size == 0 or (rows is not None and rows[to_y * width + to_x] < 0):
        return abs(x - to_x) + abs(y - to_y)
    to = to_y * width + to_x
    return np.int64(ways[to if rows is None else rows[to], y * width + x])


@inlined
def is_open(zones, x, y):
    """Whether cell ``x, y`` is on the grid, and no no-fly cell, by ``Chart.zones``."""
    height, width = zones.shape
    return 0 <= x < width and 0 <= y < height and zones[y, x] != NO_FLY


@inlined
def in_zone(chart, x, y):
    """Whether cell ``x, y`` of the grid is in a charging zone."""
    return chart.zones[y, x] >= 0


@inlined
def distance(chart, x, y, to_x, to_y):
    """The cells on the shortest way between two cells of the grid."""
    return _distance(chart.ways, chart.rows, chart.zones, x, y, to_x, to_y)


@inlined
def _distance(ways, rows, zones, x, y, to_x, to_y):
    if ways.size == 0:
        return abs(x - to_x) + abs(y - to_y)
    cell = y * zones.shape[1] + x
    to = to_y * zones.shape[1] + to_x
    if rows is None:
        return np.int64(ways[to, cell])
    return _distance_on_large_grid(ways, rows, zones, cell, to)


@shared_kernel
def _distance_on_large_grid(ways, rows, zones, cell, to):
    if rows[to] >= 0:
        return np.int64(ways[rows[to], cell])
    if rows[cell] >= 0:
        return np.int64(ways[rows[cell], to])
    width = zones.shape[1]
    none = np.empty(0, np.int64)
    x = cell % width
    y = cell // width
    to_x = to % width
    to_y = to // width
    return length_around(zones, ways, rows, none, x, y, to_x, to_y)
