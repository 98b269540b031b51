"""Families of generated seas: a name and a seed make a scenario, the same on every machine.

    >>> space = load_scenario("archipelago:7")
    >>> len(seas_of("test")) // len(SET_FAMILIES)       # seas of each family
    60

Each sea has the ranges of the paper's Table II and its channel: a node some cells away is received
as well as there. Sizes, numbers of nodes, charging zones, pads and UAVs differ. Seeds one after the
other have 1 or 2, 3 or 4, and 5 or 6 UAVs, so that a set of seas has each number equally often. A
charged battery lasts for the way from a charging zone to any node and back, with a fifth to spare.
"""

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import count, product
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from dess.base.elementary import log10
from dess.base.errors import InputError, check_known, shown, unknown_name
from dess.physics import streams
from dess.physics.chart import FAR, NO_FLY, OPEN, Cell, Rectangle, parking_of, spread, zones_of

T = TypeVar("T")


class Draws:
    """Random integers, one after another, of one attempt to draw a sea.

    Args:
        seed: Of the sea.
        family: Number of its family.
        attempt: Number of the attempt.
    """

    def __init__(self, seed: int, family: int, attempt: int) -> None:
        self._of = np.uint64(seed), family, streams.SEA, 0, attempt
        self._drawn = 0

    def integer(self, low: int, high: int) -> int:
        """A uniform integer in ``low..high``, both included."""
        words = streams.block(*self._of, self._drawn // 4)
        word = words[self._drawn % 4]
        self._drawn += 1
        return int(streams.integer(np.uint64(word), low, high))

    def one_of(self, items: Sequence[T]) -> T:
        """One of some items."""
        return items[self.integer(0, len(items) - 1)]

    def some_of(self, items: Sequence[T], number: int) -> list[T]:
        """A number of different items, in the order in which they are drawn."""
        left = [*items]
        for i in range(number):
            j = self.integer(i, len(left) - 1)
            left[i], left[j] = left[j], left[i]
        return left[:number]


def grow_island(draws: Draws, land: np.ndarray, start: Cell, size: int) -> None:
    """Make an island about a cell: one neighbour of the island after another becomes land."""
    rows, columns = land.shape
    border = [start]
    while size and border:
        number = draws.integer(0, len(border) - 1)
        border[number], border[-1] = border[-1], border[number]
        x, y = border.pop()
        if land[y, x]:
            continue
        land[y, x] = True
        size -= 1
        beside = ((x, y - 1), (x + 1, y), (x, y + 1), (x - 1, y))
        border += [(i, j) for i, j in beside if 0 <= i < columns and 0 <= j < rows]


def make_islands(draws: Draws, land: np.ndarray, number: int, largest: int) -> None:
    """Make islands of 3 to ``largest`` cells each, anywhere on the grid."""
    rows, columns = land.shape
    for _ in range(number):
        start = draws.integer(0, columns - 1), draws.integer(0, rows - 1)
        grow_island(draws, land, start, draws.integer(3, largest))


def make_coast(draws: Draws, land: np.ndarray) -> None:
    """Make land along one of the four sides, with a shore that goes to and fro."""
    turned = np.rot90(land, draws.integer(0, 3))  # a view: what is made there is made in ``land``
    depth, columns = turned.shape
    shore = draws.integer(depth // 8, depth // 5)
    for x in range(columns):
        shore = min(max(shore + draws.integer(-1, 1), 1), depth // 4)
        turned[:shore, x] = True


def make_lane(draws: Draws, land: np.ndarray) -> None:
    """Make a shipping lane of two rows along the grid, which UAVs may only cross at some gates."""
    rows, columns = land.shape
    top = rows // 2 + draws.integer(-2, 1)
    width = draws.integer(3, 4)
    gates = draws.integer(2, 4)
    land[top : top + 2] = True
    for gate in range(gates):
        part = columns // gates
        left = gate * part + draws.integer(0, part - width)
        land[top : top + 2, left : left + width] = False


MOST_SEED = 10**9 - 1

# The seeds of each set of seas, for every family. Seeds below 1000 are for examples.
SETS = {"train": range(1000, 1300), "validation": range(2000, 2010), "test": range(3000, 3060)}
# The families of these sets. A new family is none of them, so that studies and trainings of before
# keep their seas.
SET_FAMILIES = ("scattered", "clustered", "coast", "archipelago", "corridor", "dense", "large")

# The least battery of a charged UAV, and that on seas of more rows and columns together than these.
_LEAST, _LEAST_FAR, _FAR = 60, 80, 80


class _Sea(NamedTuple):
    """The geometry of a sea.

    Attributes:
        land: (H, W) whether a cell is a no-fly cell.
        sites: Cells that may become nodes.
        nodes: The number of nodes.
    """

    land: np.ndarray
    sites: list[Cell]
    nodes: int


class Family(NamedTuple):
    """A family of seas.

    Attributes:
        number: Part of what random numbers are drawn for; never changed.
        description: What its seas are like.
        sea: Draws the geometry of a sea.
    """

    number: int
    description: str
    sea: Callable[[Draws], _Sea]


def is_generated(name: str) -> bool:
    """Whether a name is that of a generated sea, be its family and seed right or wrong."""
    return name.partition(":")[0] in FAMILIES or bool(re.fullmatch("[a-z]{2,}:[0-9]+", name))


# The fields of a generated sea in the place of which a data sheet stands: batteries, workload and
# channel.
_WITHOUT_SHEET = (
    *("flying_time", "charge_start", "charge_complete"),
    *("quota", "initial_data", "arrival_rate", "edge_snr"),
)


def sea_of(name: str, has_sheet: bool = False) -> dict[str, Any]:
    """The fields of a generated sea, with its description.

    Args:
        name: ``FAMILY:SEED``.
        has_sheet: Whether a data sheet says what the UAVs, the radio and the data are, so that only
            the sea and its fleet are drawn.

    Raises:
        InputError: If there is no such family or seed.
    """
    family, _, seed = name.partition(":")
    if family not in FAMILIES:
        raise unknown_name(name, "no such family of seas", family, FAMILIES)
    if not re.fullmatch("0|[1-9][0-9]{0,8}", seed):
        wrong = "has no seed"
        if seed:
            wrong = f"has the seed {shown(seed)}"
        raise InputError(family, wrong, f"{family}:0..{family}:{MOST_SEED}")
    fields = _fields_of(family, int(seed))
    return {n: value for n, value in fields.items() if not (has_sheet and n in _WITHOUT_SHEET)}


def seas_of(name: str) -> list[str]:
    """The names of the seas of a set, family by family: ``train``, ``validation`` or ``test``.

    Raises:
        InputError: If there is no such set.
    """
    check_known("set of seas", name, SETS)
    return [f"{family}:{seed}" for family in SET_FAMILIES for seed in SETS[name]]


# --- the families ---


def _scattered(draws: Draws) -> _Sea:
    land = _water(draws, 16, 40)
    return _Sea(land, _cells(~land), _number(draws, land, 15, 50))


def _clustered(draws: Draws) -> _Sea:
    land = _water(draws, 20, 48)
    rows, columns = land.shape
    near = np.zeros_like(land)
    for _ in range(draws.integer(2, 6)):
        x, y, reach = (draws.integer(0, most) for most in (columns - 1, rows - 1, 2))
        reach += 2
        near[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1] = True
    return _Sea(land, _cells(near), _number(draws, land, 30, 90))


def _coast(draws: Draws) -> _Sea:
    land = _water(draws, 24, 56)
    make_coast(draws, land)
    make_islands(draws, land, draws.integer(2, 6), max(land.size // 60, 8))
    return _Sea(land, _cells(~land), _number(draws, land, 30, 80))


def _archipelago(draws: Draws) -> _Sea:
    land = _water(draws, 24, 56)
    make_islands(draws, land, land.size // draws.integer(60, 120), max(land.size // 50, 12))
    return _Sea(land, _cells(~land), _number(draws, land, 30, 80))


def _corridor(draws: Draws) -> _Sea:
    """Turbines in rows, each with a node at it or, where UAVs must fly around it, beside it."""
    length = draws.integer(40, 64)
    width = draws.integer(16, 20)
    along, across = draws.integer(5, 6), draws.integer(5, 6)
    land = np.zeros((width, length), np.bool_)
    first, top = draws.integer(1, 3), draws.integer(1, 3)
    turbines = [*product(range(first, length - 1, along), range(top, width - 1, across))]
    if draws.integer(0, 1):
        make_lane(draws, land)
        sites = [cell for cell in turbines if not land[cell[::-1]]]
    else:
        for x, y in turbines:
            land[y, x] = True
        sites = [(x, y + 1) for x, y in turbines]
    nodes = max(len(sites) * draws.integer(50, 90) // 100, 6)
    if draws.integer(0, 1):
        land = land.T.copy()
        sites = [(y, x) for x, y in sites]
    return _Sea(land, sites, nodes)


def _dense(draws: Draws) -> _Sea:
    land = _water(draws, 24, 48)
    return _Sea(land, _cells(~land), draws.integer(61, 100))


def _large(draws: Draws) -> _Sea:
    land = _water(draws, 56, 64)
    if draws.integer(0, 1):
        for _ in range(draws.integer(2, 5)):
            rows, columns = land.shape
            start = draws.integer(0, columns - 1), draws.integer(0, rows - 1)
            grow_island(draws, land, start, draws.integer(10, 80))
    return _Sea(land, _cells(~land), draws.integer(30, 60))


FAMILIES = {
    "scattered": Family(0, "nodes anywhere", _scattered),
    "clustered": Family(1, "nodes in clusters", _clustered),
    "coast": Family(2, "land along one side, and islands off it", _coast),
    "archipelago": Family(3, "many islands", _archipelago),
    "corridor": Family(
        4, "a long wind farm: rows of turbines to fly around, or a shipping lane", _corridor
    ),
    "dense": Family(5, "many nodes, 61 to 100", _dense),
    "large": Family(6, "56 to 64 cells a side, some with islands", _large),
}


def _water(draws: Draws, least: int, most: int) -> np.ndarray:
    """A grid without land whose sides are drawn from a range [cells]."""
    return np.zeros((draws.integer(least, most), draws.integer(least, most)), np.bool_)


def _number(draws: Draws, land: np.ndarray, least: int, most: int) -> int:
    """A number of nodes, 6 to 60, one for so many cells."""
    return min(max(land.size // draws.integer(least, most), 6), 60)


def _cells(mask: np.ndarray) -> list[Cell]:
    return [*map(tuple, np.argwhere(mask)[:, ::-1].tolist())]


# --- a sea with its zones, nodes and limits ---


@lru_cache(maxsize=1024)
def _fields_of(name: str, seed: int) -> dict[str, Any]:
    family = FAMILIES[name]
    for attempt in count():
        if fields := _attempt(Draws(seed, family.number, attempt), family, seed):
            break
    size = f"{fields['grid']} x {fields['rows'] or fields['grid']} cells"
    return fields | {"description": f"{family.description}: {size}, drawn with seed {seed}"}


def _attempt(draws: Draws, family: Family, seed: int) -> dict[str, Any]:
    """The fields of a sea, or none if nodes or zones are too far apart."""
    sea = family.sea(draws)
    most_uavs = 2 + 2 * (seed % 3)
    rows, columns = sea.land.shape
    least = _LEAST
    if rows + columns > _FAR:
        least = _LEAST_FAR
    reach = 2 * least // 5  # as far as nodes may be: there and back with a fifth to spare
    zones = _zones(draws, sea.land, most_uavs, reach)
    if not zones:
        return {}
    to_start = _ways(sea.land, parking_of(zones[:1]))
    land = sea.land | (to_start == FAR)  # lakes within islands are land
    near = _ways(land, parking_of(zones)) <= reach
    open_water = zones_of(columns, rows, zones, _cells(land)) == OPEN
    sites = [(x, y) for x, y in sea.sites if open_water[y, x] and near[y, x]]
    if len(sites) < sea.nodes or 2 * near.sum() < (~land).sum():
        return {}
    nodes = sorted(draws.some_of(sites, sea.nodes), key=lambda cell: cell[::-1])
    return {
        "grid": columns,
        "rows": None if rows == columns else rows,
        "nodes": nodes,
        "no_fly": _cells(land),
        "uavs": (most_uavs - 1, most_uavs),
        "flying_time": (70, 80),
        "charge_start": (10, 50),
        "charge_complete": (least, 100),
        **_pads(draws, zones, most_uavs),
        **_workload(draws, rows, columns, len(nodes), most_uavs),
    }


def _ways(land: np.ndarray, cells: list[Cell]) -> np.ndarray:
    """(H, W) the cells on the way to the nearest of some cells."""
    zones = np.where(land, NO_FLY, OPEN).astype(np.int8)
    return spread(zones, np.array(cells))[0].reshape(land.shape)


def _zones(draws: Draws, land: np.ndarray, uavs: int, reach: int) -> list[Rectangle]:
    """One to three charging zones of 2 x 2 to 4 x 4 cells, or none if they do not fit.

    The first has room for all UAVs. The others are at least ``reach`` cells away from it on the
    shortest way, and at most twice as many, which a charged battery allows.
    """
    sides = [*product((2, 3, 4), repeat=2)]
    number = draws.one_of((1, 1, 1, 2, 2, 2, 3))
    width, height = draws.one_of([(w, h) for w, h in sides if w * h >= uavs])
    places = _places(land, width, height)
    if not places:
        return []
    zones = [(*draws.one_of(places), width, height)]
    for _ in range(number - 1):
        ways = _ways(land, parking_of(zones))
        from_start = _ways(land, parking_of(zones[:1]))
        width, height = draws.one_of(sides)
        nearest = sliding_window_view(ways, (height, width)).min((2, 3))
        fit = [
            (x, y)
            for x, y in _places(land, width, height)
            if nearest[y, x] >= min(reach, min(land.shape) // 2) and from_start[y, x] <= 2 * reach
        ]
        if not fit:
            return []
        zones.append((*draws.one_of(fit), width, height))
    return zones


def _places(land: np.ndarray, width: int, height: int) -> list[Cell]:
    """The cells whose rectangle of this size, to the east and south, has no land."""
    windows = sliding_window_view(land, (height, width))
    return _cells(windows.sum((2, 3)) == 0)


def _pads(draws: Draws, zones: list[Rectangle], uavs: int) -> dict[str, Any]:
    """The zones with their pads: a pad for three UAVs and more in the start zone."""
    least = [-(-uavs // 3), *[1] * (len(zones) - 1)]
    pads = [draws.integer(n, z[2] * z[3]) for n, z in zip(least, zones, strict=True)]
    others = zip(zones[1:], pads[1:], strict=True)
    return {
        "zone": zones[0],
        "pads": pads[0],
        "zones": [{"cells": cells, "pads": n} for cells, n in others],
    }


def _workload(draws: Draws, rows: int, columns: int, nodes: int, uavs: int) -> dict[str, Any]:
    """Quota, data and channel in proportion to the sea.

    The paper's UAVs fly 110 slots on 32 x 32 cells, for some 300 data units, and 15 % more arrive.
    """
    slots = min((60 + 3 * (rows + columns) // 4) * draws.integer(85, 110) // 100, 150)
    data = 160 * (2 * uavs - 1) * slots // (2 * 110)  # of all nodes [data units]
    low = max((4 * data + 5 * nodes) // (10 * nodes), 1)
    # The paper's SNR some cells away, give or take 2 dB; it is given at half the diagonal.
    decades = log10(2 * 32 * 32 / (rows * rows + columns * columns)) / 2
    return {
        "quota": 4 * slots,
        "initial_data": (low, 4 * low),
        "arrival_rate": min(low * 4, 200) / 1000,
        "edge_snr": round(-25 + 10 * 2.27 * decades + draws.integer(-2, 2), 1),
    }
