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
from dess.physics.energy import move_cost

Cell = tuple[int, int]
Rectangle = tuple[int, int, int, int]  # x, y, width and height

# Cells in ``Chart.zones`` that are in no zone.
OPEN = -1
NO_FLY = -2
FAR = 2**15 - 1  # [cells]: there is no way

_STEPS = ((0, -1), (1, 0), (0, 1), (-1, 0))  # to the cells north, east, south and west

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
    return read_only(cells)


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
    fill_ways(cells, numbers, ways)
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
    spread_costs(neighbours_of(zones), cells[is_open], None, True, FAR, lengths, nearest)
    return lengths, nearest


@kernel
def neighbours_of(zones):
    """(H * W, 4) the numbers of the cells north, east, south and west of a cell; -1 where none."""
    height, width = zones.shape
    neighbours = np.full((zones.size, 4), -1, np.int32)
    for y in range(height):
        for x in range(width):
            for side, (step_x, step_y) in enumerate(_STEPS):
                to_x = x + step_x
                to_y = y + step_y
                if is_open(zones, to_x, to_y):
                    neighbours[y * width + x, side] = to_y * width + to_x
    return neighbours


@kernel
def spread_costs(neighbours, sources, moves, outward, far, costs, nearest):
    """Lower the costs of cells to those of the cheapest ways between them and the nearest source.

    The cells are looked at in the order in which they are first reached, and all of them again
    where a cost has been lowered later. Where moves cost one, this is a breadth-first search.

    Args:
        neighbours: As ``neighbours_of``.
        sources: (S,) the numbers of cells.
        moves: (4, W * H) what the moves north, east, south and west into a cell cost; None if each
            costs one.
        outward: Whether the ways lead from the sources to the cells, and not back.
        far: More than any way costs.
        costs: (W * H,) the costs; ``far`` before, and where there is no way.
        nearest: (W * H,) the number that the nearest source has in ``nearest``; where moves cost
            one, the first source on a tie.
    """
    queue = np.empty(len(costs), np.int32)
    last = len(sources)
    for number in range(last):
        queue[number] = sources[number]
        costs[sources[number]] = 0
    is_lowered = True
    while is_lowered:
        is_lowered = False
        first = 0
        while first < last:
            cell = queue[first]
            first += 1
            spent = np.int64(costs[cell])
            source = nearest[cell]
            for side in range(4):
                to = neighbours[cell, side]
                if to < 0:
                    continue
                if outward:
                    cost = spent + _listed_cost(moves, side, to)
                else:
                    cost = spent + _listed_cost(moves, (side + 2) % 4, cell)
                if cost >= costs[to]:
                    continue
                if costs[to] == far:
                    queue[last] = to
                    last += 1
                else:
                    is_lowered = True
                costs[to] = cost
                nearest[to] = source


@inlined
def _listed_cost(moves, action, cell):
    if moves is None:
        return 1
    return moves[action, cell]


@kernel
def fill_ways(zones, places, ways):
    """Write the ways from these cells to all others, where ``FAR`` stands before, row by row."""
    width = zones.shape[1]
    neighbours = neighbours_of(zones)
    nearest = np.zeros(zones.size, np.int32)
    for number in range(len(places)):
        if zones[places[number] // width, places[number] % width] != NO_FLY:
            source = places[number : number + 1]
            spread_costs(neighbours, source, None, True, FAR, ways[number], nearest)


@shared_kernel
def length_around(zones, ways, rows, closed, x, y, to_x, to_y):
    """The cells on the shortest way between two cells that avoids closed cells, or ``FAR``.

    Args:
        zones, ways, rows: As in ``Chart``.
        closed: (N,) the numbers of cells that the way must not enter, counted row by row.
        x, y: Where the way begins.
        to_x, to_y: Where it ends.
    """
    row = -1
    if ways.size > 0:
        row = to_y * zones.shape[1] + to_x
        if rows is not None:
            row = rows[row]
    lengths = np.full(zones.size, FAR, np.int16)
    lengths[closed] = -1
    return cost_around(zones, None, 1, ways, row, lengths, x, y, to_x, to_y, FAR)


@shared_kernel
def cost_around(zones, mission, slots, least, row, costs, x, y, to_x, to_y, limit):
    """The cost of the cheapest way between two cells around closed cells, or a limit if it is less.

    This is A*. The cost without closed cells is a lower bound, and the next cell is one with the
    lowest bound: the last of ``near`` while there is one. So few cells beside the way are looked
    at.

    Args:
        zones: As in ``Chart``.
        mission: ``MISSION`` record, whose moves cost battery [% / 1000]; None to count cells.
        slots: The slots that the UAV takes for a cell.
        least: (R, W * H) rows of the costs to a cell without closed cells.
        row: That of the last cell; with -1, the cells along both axes are in its place.
        costs: (W * H,) -1 for closed cells, the limit for others; overwritten.
        x, y: Where the way begins.
        to_x, to_y: Where it ends.
        limit: The limit.
    """
    height, width = zones.shape
    places = np.empty((2, 4 * zones.size), np.int32)  # each neighbour of a cell may put it there
    near, far = places[0], places[1]
    near[0] = y * width + x
    nears, fars = 1, 0
    costs[near[0]] = 0
    bound = _at_least(least, row, x, y, to_x, to_y, width)
    while bound < limit:
        if nears == 0:
            nears, fars, bound = _raise_bound(
                least, row, costs, near, far, fars, to_x, to_y, width, bound, limit
            )
            continue
        nears -= 1
        cell = np.int64(near[nears])
        x = cell % width
        y = cell // width
        cost = np.int64(costs[cell])
        left = _at_least(least, row, x, y, to_x, to_y, width)
        if left == 0:
            return cost
        if cost + left < bound:
            continue  # a cheaper way to this cell has been found since it was put there
        for action, (step_x, step_y) in enumerate(_STEPS):
            next_x = x + step_x
            next_y = y + step_y
            if not (0 <= next_x < width and 0 <= next_y < height):
                continue
            to = next_y * width + next_x
            if zones[next_y, next_x] == NO_FLY:
                continue
            next_cost = cost + _cost_of_move(mission, slots, action, next_x, next_y)
            if next_cost >= costs[to]:
                continue
            costs[to] = next_cost
            if next_cost + _at_least(least, row, next_x, next_y, to_x, to_y, width) <= bound:
                near[nears] = to
                nears += 1
            else:
                far[fars] = to
                fars += 1
    return np.int64(limit)


@shared_kernel
def _raise_bound(least, row, costs, near, far, fars, to_x, to_y, width, bound, limit):
    """Move the cells with the next bound from ``far`` to ``near``; return both numbers and it."""
    raised = np.int64(limit)
    for place in range(fars):
        cell = np.int64(far[place])
        total = costs[cell] + _at_least(least, row, cell % width, cell // width, to_x, to_y, width)
        if bound < total < raised:
            raised = total
    nears = 0
    left = 0
    for place in range(fars):
        cell = np.int64(far[place])
        total = costs[cell] + _at_least(least, row, cell % width, cell // width, to_x, to_y, width)
        if total == raised:
            near[nears] = cell
            nears += 1
        elif total > raised:
            far[left] = cell
            left += 1
    return nears, left, raised


@inlined
def _cost_of_move(mission, slots, action, x, y):
    if mission is None:
        return 1
    return move_cost(mission, slots, action, x, y)


@inlined
def _at_least(least, row, x, y, to_x, to_y, width):
    """A lower bound of the cost from a cell to the last cell of a way."""
    if row < 0:
        return np.int64(abs(x - to_x) + abs(y - to_y))
    return np.int64(least[row, y * width + x])


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
