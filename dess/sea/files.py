"""The nodes and the no-fly cells of a user's own sea, read from files beside its scenario.

    nodes = "buoys.csv"     # in the TOML file of a scenario: a file in the same folder
    no_fly = "islands.txt"

A CSV file has places, as cells (``x``, ``y``) or degrees (``lon``, ``lat``). A GeoJSON file has
Point features for nodes. For no-fly cells it has Polygon and MultiPolygon features: a cell is a
no-fly cell if its centre lies in one of them, and not in a hole. A map (``.txt``) has a line for
each row of cells, from north to south: ``#`` is a no-fly cell and ``.`` an open one.

Degrees are projected about the centre of the bounding box of the nodes.
"""

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import AfterValidator, Field

from dess.errors import InputError, shown
from dess.files.documents import Document
from dess.files.reading import read_text
from dess.sea.chart import Cell

EARTH_RADIUS = 6_371_008.8  # mean radius of WGS 84 [m]
LIMIT = 2**20  # bytes of the largest file
MAX_NODES, MAX_GRID = 1024, 256  # as of a scenario

# The pairs of columns, and the largest number of each; cells off the grid are refused later.
GEOGRAPHIC = ("lon", "lat")
LIMITS = {("x", "y"): (99_999, 99_999), GEOGRAPHIC: (180, 90)}

Size = tuple[int, int]  # cells of the grid from west to east, and from north to south


class Projection(NamedTuple):
    """The projection of a sea.

    Attributes:
        middle: Longitude and latitude of the centre of the grid [degrees].
        size: Cells of the grid from west to east and from north to south.
        cell_size: Side of a cell [m].
    """

    middle: tuple[float, float]
    size: Size
    cell_size: float

    @classmethod
    def about(cls, degrees: np.ndarray, size: Size, cell_size: float) -> Self:
        """The projection about the centre of the bounding box of (K, 2) places on the Earth."""
        if np.ptp(degrees[:, 0]) > 180:  # on both sides of the 180th meridian
            degrees = degrees + [360, 0] * (degrees < 0)
        lon, lat = (degrees.min(0) + degrees.max(0)) / 2
        return cls((float(lon), float(lat)), size, cell_size)

    def cells(self, degrees: np.ndarray) -> np.ndarray:
        """The (K, 2) places on the grid [cells] of (K, 2) places on the Earth; y grows south."""
        away = degrees - self.middle
        away[:, 0] -= 360 * np.round(away[:, 0] / 360)  # the short way around the Earth
        degree = math.radians(1) * EARTH_RADIUS / self.cell_size  # of latitude [cells]
        east = degree * math.cos(math.radians(self.middle[1]))
        return np.array(self.size) / 2 + away * [east, -degree]


def nodes_in(path: Path, size: Size, cell_size: float) -> tuple[Cell, ...]:
    """The cells of the nodes in a file, in the order of the file.

    Args:
        path: A file ``.csv``, ``.geojson`` or ``.json``.
        size: Cells of the grid from west to east and from north to south.
        cell_size: Side of a cell [m].

    Raises:
        InputError: If the file cannot be read or has no nodes, or if a node is off the grid or two
            nodes share a cell.
    """
    found = _places_of_nodes(path)
    cells = found.cells(found.projection(size, cell_size))
    known: dict[Cell, str] = {}
    for name, cell in zip(found.names, cells, strict=True):
        if not _is_on_grid(cell, size):
            allowed = _enough(cells, size, found.is_geographic)
            raise InputError(f"{path}: {_off(name, cell, size)}; allowed: {allowed}")
        if cell in known:
            smaller = f"a cell_size below {cell_size:g} m"
            allowed = smaller if found.is_geographic else "distinct cells"
            shared = f"{known[cell]} and {name} lie in one cell, {[*cell]}"
            raise InputError(f"{path}: {shared}; allowed: {allowed}")
        known[cell] = name
    return tuple(cells)


def projection_in(path: Path, size: Size, cell_size: float) -> Projection | None:
    """The projection of the nodes in a file, none if they are cells; arguments as ``nodes_in``."""
    return _places_of_nodes(path).projection(size, cell_size)


def _places_of_nodes(path: Path) -> "Places":
    found = _reader(path, _NODES)(path)
    if not 0 < len(found.names) <= MAX_NODES:
        raise InputError(f"{path}: has {len(found.names):,} nodes; allowed: 1..{MAX_NODES}")
    return found


def no_fly_in(path: Path, size: Size, projection: Projection | None) -> tuple[Cell, ...]:
    """The no-fly cells in a file, row by row.

    Args:
        path: A file ``.txt``, ``.csv``, ``.geojson`` or ``.json``.
        size: Cells of the grid from west to east and from north to south.
        projection: That of the nodes, none if they are cells.

    Raises:
        InputError: If the file cannot be read, a map has another size, a place or a whole feature
            is off the grid, or the file has degrees and the nodes are cells.
    """
    closed = _reader(path, _NO_FLY)(path, size, projection)
    return tuple((int(x), int(y)) for y, x in np.argwhere(closed))


def _reader(path: Path, readers: Mapping[str, Callable[..., Any]]) -> Callable[..., Any]:
    """The function that reads files of this ending."""
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: has no known file ending; allowed: {', '.join(readers)}")
    return readers[path.suffix.lower()]


def _is_on_grid(cell: Cell, size: Size) -> bool:
    return 0 <= cell[0] < size[0] and 0 <= cell[1] < size[1]


def _off(name: str, cell: Iterable[int], size: Size) -> str:
    return f"{name} is off the grid of {size[0]} x {size[1]} cells, at {[*cell]}"


def _enough(cells: Sequence[Cell], size: Size, is_geographic: bool) -> str:
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


# --- places, in CSV files and as points ---


class Places(NamedTuple):
    """The places that a file has.

    Attributes:
        is_geographic: Whether they are degrees, and not cells.
        names: Where each place stands in the file, such as ``line 3``.
        places: (K, 2) longitude and latitude [degrees], or column and row of the cell.
    """

    is_geographic: bool
    names: list[str]
    places: np.ndarray

    def projection(self, size: Size, cell_size: float) -> Projection | None:
        """The projection about these places; none if they are cells."""
        return Projection.about(self.places, size, cell_size) if self.is_geographic else None

    def cells(self, projection: Projection | None) -> list[Cell]:
        """The cells of the places; degrees are projected."""
        places = projection.cells(self.places) if projection else self.places
        return [(int(x), int(y)) for x, y in np.floor(places)]


def _on_earth(position: list[float]) -> list[float]:
    if len(position) < 2:
        raise ValueError("has not two numbers; allowed: [lon, lat]")
    for name, most, value in zip(GEOGRAPHIC, LIMITS[GEOGRAPHIC], position, strict=False):
        if abs(value) > most:
            raise ValueError(f"{name} is {value:g}; allowed: -{most}..{most}")
    return position


# A position in GeoJSON: longitude, latitude [degrees] and perhaps an altitude.
OnEarth = Annotated[list[float], AfterValidator(_on_earth)]


class _Point(Document, extra="ignore"):
    type: Literal["Point"]
    coordinates: OnEarth


class _PointFeature(Document, extra="ignore"):
    geometry: _Point = Field(description="a Point")


_POINTS = "a GeoJSON FeatureCollection of points"


class Points(Document, extra="ignore"):
    """A GeoJSON file of points."""

    features: tuple[_PointFeature, ...] = Field(description=_POINTS)


def _points(path: Path) -> Places:
    features = Points.load(path, absent=_POINTS, limit=LIMIT).features
    places = [feature.geometry.coordinates[:2] for feature in features]
    names = [f"features.{number}" for number in range(len(places))]
    return Places(True, names, np.reshape(places, (-1, 2)))


def _table(path: Path) -> Places:
    """The places in a CSV file, in the order of its lines."""
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
        numbers = [
            _number(values[name].strip(), f"{path}: {line}: {name}", most, is_geographic)
            for name, most in zip(found[0], LIMITS[found[0]], strict=True)
        ]
        places.append(numbers)
    return Places(is_geographic, [line for line, _ in rows], np.reshape(places, (-1, 2)))


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


_NODES = {".csv": _table, ".geojson": _points, ".json": _points}


# --- areas: what is closed, (H, W) whether a cell is a no-fly cell ---


def _closed(ring: list[OnEarth]) -> list[OnEarth]:
    if len(ring) < 4 or ring[0][:2] != ring[-1][:2]:
        raise ValueError("is no ring; allowed: four positions or more, the last as the first")
    return ring


_Ring = Annotated[list[OnEarth], AfterValidator(_closed)]


class _Polygon(Document, extra="ignore"):
    type: Literal["Polygon"]
    coordinates: list[_Ring] = Field(min_length=1, description="the outer ring, and holes")


class _MultiPolygon(Document, extra="ignore"):
    type: Literal["MultiPolygon"]
    coordinates: list[Annotated[list[_Ring], Field(min_length=1)]] = Field(
        min_length=1, description="the rings of each polygon"
    )


class _PolygonFeature(Document, extra="ignore"):
    geometry: Annotated[_Polygon | _MultiPolygon, Field(discriminator="type")] = Field(
        description="a Polygon or MultiPolygon"
    )


_POLYGONS = "a GeoJSON FeatureCollection of polygons"


class Polygons(Document, extra="ignore"):
    """A GeoJSON file of polygons."""

    features: tuple[_PolygonFeature, ...] = Field(min_length=1, description=_POLYGONS)


def _of_map(path: Path, size: Size, _: Projection | None) -> np.ndarray:
    lines = [line.rstrip() for line in read_text(path, LIMIT, "utf-8-sig", "a map").splitlines()]
    while lines and not lines[-1]:
        lines.pop()
    columns, rows = size
    allowed = f"allowed: {rows} lines of {columns} cells, as grid and rows say"
    if len(lines) != rows:
        raise InputError(f"{path}: has {len(lines):,} lines; {allowed}")
    for number, line in enumerate(lines, 1):
        if unknown := line.strip("#.") and next(c for c in line if c not in "#."):
            what = f"line {number}: has {shown(unknown)}"
            raise InputError(f"{path}: {what}; allowed: # for a no-fly cell, . for an open one")
        if len(line) != columns:
            raise InputError(f"{path}: line {number}: has {len(line):,} cells; {allowed}")
    return np.array([[cell == "#" for cell in line] for line in lines])


def _of_table(path: Path, size: Size, projection: Projection | None) -> np.ndarray:
    found, closed = _table(path), np.zeros(size[::-1], np.bool_)
    if not found.names:
        raise InputError(f"{path}: has no places; allowed: one or more")
    cells = found.cells(_of_nodes(path, projection) if found.is_geographic else None)
    for name, (x, y) in zip(found.names, cells, strict=True):
        if not _is_on_grid((x, y), size):
            allowed = f"0 <= x < {size[0]}, 0 <= y < {size[1]}"
            raise InputError(f"{path}: {_off(name, (x, y), size)}; allowed: {allowed}")
        closed[y, x] = True
    return closed


def _of_polygons(path: Path, size: Size, projection: Projection | None) -> np.ndarray:
    projected, closed = _of_nodes(path, projection), np.zeros(size[::-1], np.bool_)
    for number, feature in enumerate(Polygons.load(path, absent=_POLYGONS, limit=LIMIT).features):
        polygons = [[projected.cells(ring) for ring in rings] for rings in _rings(feature)]
        if not any(_meets_grid(rings[0], size) for rings in polygons):
            corner = np.floor(polygons[0][0][0]).astype(int).tolist()
            line = _off(f"features.{number}", corner, size)
            raise InputError(f"{path}: {line}; allowed: polygons with a part on the grid")
        for rings in polygons:
            closed |= centres_in(rings, size)
    return closed


_NO_FLY = {".txt": _of_map, ".csv": _of_table, ".geojson": _of_polygons, ".json": _of_polygons}


def _of_nodes(path: Path, projection: Projection | None) -> Projection:
    if projection is None:
        raise InputError(
            f"{path}: has degrees, and the nodes are cells; allowed: cells, or nodes from a file "
            "with degrees"
        )
    return projection


def _rings(feature: _PolygonFeature) -> Iterator[list[np.ndarray]]:
    """The rings of each polygon of a feature, (K, 2) degrees each."""
    geometry = feature.geometry
    polygons = [geometry.coordinates] if geometry.type == "Polygon" else geometry.coordinates
    for rings in polygons:
        yield [np.array([position[:2] for position in ring]) for ring in rings]


def _meets_grid(ring: np.ndarray, size: Size) -> bool:
    """Whether the bounding box of a ring has a part on the grid."""
    return bool((ring.max(0) > 0).all() and (ring.min(0) < size).all())


def centres_in(rings: list[np.ndarray], size: Size) -> np.ndarray:
    """(H, W) whether the centre of a cell lies in a polygon, by the even-odd rule.

    A ray from the centre to the west crosses the rings an odd number of times.

    Args:
        rings: The outer ring and the holes, (K, 2) places on the grid [cells] each, closed.
        size: Cells of the grid from west to east and from north to south.
    """
    starts = np.concatenate([ring[:-1] for ring in rings])
    ends = np.concatenate([ring[1:] for ring in rings])
    inside = np.zeros(size[::-1], np.bool_)
    for row in range(size[1]):
        y = row + 0.5
        crosses = (starts[:, 1] <= y) != (ends[:, 1] <= y)
        (x0, y0), (x1, y1) = starts[crosses].T, ends[crosses].T
        crossings = np.sort(x0 + (y - y0) * (x1 - x0) / (y1 - y0))
        inside[row] = np.searchsorted(crossings, np.arange(size[0]) + 0.5) % 2 == 1
    return inside
