"""Read the sensor nodes of a user's own sea from a CSV or GeoJSON file.

    nodes = "buoys.csv"  # in the TOML file of a scenario: a file in the same folder

A CSV file has a header line, with either the columns ``x`` and ``y`` or the columns ``lon`` and
``lat``; other columns are ignored. ``x`` and ``y`` are a cell of the grid, where (0, 0) is the
north-western cell. ``lon`` and ``lat``, like the Point features of a GeoJSON file (RFC 7946), are
degrees of WGS 84. Such positions are projected with the local equirectangular projection about the
centre of their bounding box, which becomes the centre of the grid (J. P. Snyder, Map projections: a
working manual, U.S. Geological Survey 1987).
"""

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field

from dess.errors import InputError, shown
from dess.files.documents import Document
from dess.files.reading import read_text
from dess.sea.chart import Cell

# Where a node stands in the file, such as ``line 3``, and its longitude and latitude [degrees], or
# the column and row of its cell.
Place = tuple[str, float, float]

MAX_NODES, MAX_GRID = 1024, 256  # as of a scenario
EARTH_RADIUS = 6_371_008.8  # mean radius of WGS 84 [m]
LIMIT = 2**20  # bytes of the largest file

# The pairs of columns, and the largest number of each; cells off the grid are refused later.
GEOGRAPHIC = ("lon", "lat")
LIMITS = {("x", "y"): (99_999, 99_999), GEOGRAPHIC: (180, 90)}

_ALLOWED = "a GeoJSON FeatureCollection of points"


def _on_earth(position: list[float]) -> list[float]:
    if len(position) < 2:
        raise ValueError("has not two numbers; allowed: [lon, lat]")
    for name, most, value in zip(GEOGRAPHIC, LIMITS[GEOGRAPHIC], position, strict=False):
        if abs(value) > most:
            raise ValueError(f"{name} is {value:g}; allowed: -{most}..{most}")
    return position


class _Point(Document, extra="ignore"):
    type: Literal["Point"]
    coordinates: Annotated[list[float], AfterValidator(_on_earth)]


class _Feature(Document, extra="ignore"):
    geometry: _Point = Field(description="a Point")


class _Collection(Document, extra="ignore"):
    features: tuple[_Feature, ...] = Field(description=_ALLOWED)


def nodes_in(path: Path, size: tuple[int, int], cell_size: float) -> tuple[Cell, ...]:
    """The cells of the nodes in a file, in the order of the file.

    Args:
        path: A file ``.csv``, ``.geojson`` or ``.json``.
        size: Cells of the grid from west to east and from north to south.
        cell_size: Side of a cell [m].

    Raises:
        InputError: If the file cannot be read or has no nodes, or if a node is off the grid or two
            nodes share a cell.
    """
    readers = {".csv": _of_csv, ".geojson": _of_geojson, ".json": _of_geojson}
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: has no known file ending; allowed: {', '.join(readers)}")
    is_geographic, places = readers[path.suffix.lower()](path)
    if not 0 < len(places) <= MAX_NODES:
        raise InputError(f"{path}: has {len(places):,} nodes; allowed: 1..{MAX_NODES}")
    positions = np.array([place[1:] for place in places])
    if is_geographic:
        positions = _projected(positions, size, cell_size)
    cells = [(int(x), int(y)) for x, y in np.floor(positions)]
    known: dict[Cell, str] = {}
    for (name, *_), cell in zip(places, cells, strict=True):
        if min(cell) < 0 or cell[0] >= size[0] or cell[1] >= size[1]:
            line = f"{name} is off the grid of {size[0]} x {size[1]} cells, at {[*cell]}"
            raise InputError(f"{path}: {line}; allowed: {_enough(cells, size, is_geographic)}")
        if cell in known:
            smaller = f"a cell_size below {cell_size:g} m" if is_geographic else "distinct cells"
            shared = f"{known[cell]} and {name} lie in one cell, {[*cell]}"
            raise InputError(f"{path}: {shared}; allowed: {smaller}")
        known[cell] = name
    return tuple(cells)


def _of_csv(path: Path) -> tuple[bool, list[Place]]:
    """Whether the nodes are geographic, and where they are."""
    try:
        text = read_text(path, LIMIT, "utf-8-sig", "a CSV file")
        lines = csv.reader(io.StringIO(text), strict=True)
        columns = [name.strip() for name in next(lines, [])]
        rows = [(f"line {lines.line_num}", row) for row in lines if any(map(str.strip, row))]
    except csv.Error as error:
        raise InputError(f"{path}: is not a CSV file: {error}; allowed: CSV with commas") from None
    found = [pair for pair in LIMITS if {*pair} <= {*columns}]
    if len(found) != 1:
        there = ", ".join(columns) or "none"
        raise InputError(f"{path}: has columns {there}; allowed: x and y, or lon and lat")
    is_geographic, places = found == [GEOGRAPHIC], []
    for line, texts in rows:
        values = dict.fromkeys(columns, "") | dict(zip(columns, texts, strict=False))
        x, y = (
            _number(values[name].strip(), f"{path}: {line}: {name}", most, is_geographic)
            for name, most in zip(found[0], LIMITS[found[0]], strict=True)
        )
        places.append((line, x, y))
    return is_geographic, places


def _number(text: str, place: str, most: int, is_geographic: bool) -> float:
    """A number of at most this size; a cell has integers."""
    try:
        number = float(text)
    except ValueError:
        raise InputError(f"{place} is {shown(text)}; allowed: a number") from None
    if not -most <= number <= most:
        raise InputError(f"{place} is {number:g}; allowed: {-most:,}..{most:,}")
    if not is_geographic and not number.is_integer():
        raise InputError(f"{place} is {number:g}; allowed: an integer (a cell)")
    return number


def _of_geojson(path: Path) -> tuple[bool, list[Place]]:
    """True, because the positions in GeoJSON are geographic, and where the nodes are."""
    features = _Collection.load(path, absent=_ALLOWED, limit=LIMIT).features
    positions = [feature.geometry.coordinates for feature in features]
    return True, [(f"features.{n}", x, y) for n, (x, y, *_) in enumerate(positions)]


def _projected(degrees: np.ndarray, size: tuple[int, int], cell_size: float) -> np.ndarray:
    """The (K, 2) places on the grid [cells] of places on the Earth; y grows south."""
    if np.ptp(degrees[:, 0]) > 180:  # on both sides of the 180th meridian
        degrees = degrees + [360, 0] * (degrees < 0)
    middle = (degrees.min(0) + degrees.max(0)) / 2
    degree = math.radians(1) * EARTH_RADIUS  # of latitude [m]
    east = degree * math.cos(math.radians(middle[1])) / cell_size
    return np.array(size) / 2 + (degrees - middle) * [east, -degree / cell_size]


def _enough(cells: Sequence[Cell], size: tuple[int, int], is_geographic: bool) -> str:
    """What would be allowed, such as a grid that is large enough, where cells are off the grid."""
    sides = np.array(cells).T
    beyond = [max(-side.min(), side.max() - n + 1, 0) for side, n in zip(sides, size, strict=True)]
    needed = [n + b * (1 + is_geographic) for n, b in zip(size, beyond, strict=True)]
    if size[0] == size[1]:
        needed = [max(needed)] * 2
    if max(needed) > MAX_GRID or (not is_geographic and min(map(min, cells)) < 0):
        return "a larger cell_size" if is_geographic else f"0 <= x, y < {MAX_GRID}"
    enough = f"grid = {needed[0]}" + (f", rows = {needed[1]}" if needed[0] != needed[1] else "")
    return f"{enough} or more" + (", or a larger cell_size" if is_geographic else "")
