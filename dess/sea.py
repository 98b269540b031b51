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
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field

from dess.errors import InputError, shown
from dess.files.documents import Document
from dess.files.reading import read_text

Cell = tuple[int, int]

MAX_NODES, MAX_GRID = 1024, 256  # as of a scenario
EARTH_RADIUS = 6_371_008.8  # mean radius of WGS 84 [m]
LIMIT = 2**20  # bytes of the largest file


GEOGRAPHIC = ("lon", "lat")
# The pairs of columns, and the largest number of each; cells off the grid are refused later.
LIMITS = {("x", "y"): {"x": 99_999.0, "y": 99_999.0}, GEOGRAPHIC: {"lon": 180.0, "lat": 90.0}}

_ALLOWED = "a GeoJSON FeatureCollection of points"


def _on_earth(position: list[float]) -> list[float]:
    if len(position) < 2:
        raise ValueError("has not two numbers; allowed: [lon, lat]")
    for (name, most), value in zip(LIMITS[GEOGRAPHIC].items(), position, strict=False):
        if abs(value) > most:
            raise ValueError(f"{name} is {value:g}; allowed: -{most:g}..{most:g}")
    return position


class _Point(Document, extra="ignore"):
    type: Literal["Point"]
    coordinates: Annotated[list[float], AfterValidator(_on_earth)]


class _Feature(Document, extra="ignore"):
    geometry: _Point = Field(description="a Point")


class _Collection(Document, extra="ignore"):
    features: tuple[_Feature, ...] = Field(description=_ALLOWED)


class Place(NamedTuple):
    """Where a node is.

    Attributes:
        name: Where the node stands in the file, such as ``line 3`` or ``features.2``; used in
            messages.
        x: Longitude [degrees], or column of the cell.
        y: Latitude [degrees], or row of the cell.
    """

    name: str
    x: float
    y: float


def nodes_in(path: Path, grid: int, cell_size: float) -> tuple[Cell, ...]:
    """The cells of the nodes in a file, in the order of the file.

    Args:
        path: A file ``.csv``, ``.geojson`` or ``.json``.
        grid: Cells along one side of the grid.
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
    cells = _projected(places, grid, cell_size) if is_geographic else _integers(path, places)
    _check_grid(path, places, cells, grid, is_geographic)
    known: dict[Cell, str] = {}
    for place, cell in zip(places, cells, strict=True):
        if cell in known:
            smaller = f"a cell_size below {cell_size:g} m" if is_geographic else "distinct cells"
            shared = f"{known[cell]} and {place.name} lie in one cell, {list(cell)}"
            raise InputError(f"{path}: {shared}; allowed: {smaller}")
        known[cell] = place.name
    return tuple(cells)


def _of_csv(path: Path) -> tuple[bool, list[Place]]:
    """Whether the nodes are geographic, and where they are."""
    try:
        text = read_text(path, LIMIT, "utf-8-sig", "a CSV file")
        lines = csv.reader(io.StringIO(text), strict=True)
        columns = [name.strip() for name in next(lines, [])]
        rows = [(f"line {lines.line_num}", [text.strip() for text in row]) for row in lines]
    except csv.Error as error:
        raise InputError(f"{path}: is not a CSV file: {error}; allowed: CSV with commas") from None
    found = [pair for pair in LIMITS if {*pair} <= {*columns}]
    if len(found) != 1:
        there = ", ".join(columns) or "none"
        raise InputError(f"{path}: has columns {there}; allowed: x and y, or lon and lat")
    places = []
    for line, texts in rows:
        cells = dict.fromkeys(columns, "") | dict(zip(columns, texts, strict=False))
        if any(texts):
            numbers = (
                _number(cells[name], f"{path}: {line}: {name}", most)
                for name, most in LIMITS[found[0]].items()
            )
            places.append(Place(line, *numbers))
    return found[0] == GEOGRAPHIC, places


def _number(text: str, place: str, most: float) -> float:
    """A number of at most this size."""
    try:
        number = float(text)
    except ValueError:
        raise InputError(f"{place} is {shown(text)}; allowed: a number") from None
    if not -most <= number <= most:
        raise InputError(f"{place} is {number:g}; allowed: {-most:,g}..{most:,g}")
    return number


def _of_geojson(path: Path) -> tuple[bool, list[Place]]:
    """True, because the positions in GeoJSON are geographic, and where the nodes are."""
    features = _Collection.load(path, absent=_ALLOWED, limit=LIMIT).features
    positions = [feature.geometry.coordinates[:2] for feature in features]
    return True, [Place(f"features.{n}", *position) for n, position in enumerate(positions)]


def _integers(path: Path, places: Iterable[Place]) -> list[Cell]:
    """The cells of places that are given as cells."""
    cells = []
    for place in places:
        for column, value in (("x", place.x), ("y", place.y)):
            if value != int(value):
                line = f"{place.name}: {column} is {value:g}; allowed: an integer (a cell)"
                raise InputError(f"{path}: {line}")
        cells.append((int(place.x), int(place.y)))
    return cells


def _projected(places: Sequence[Place], grid: int, cell_size: float) -> list[Cell]:
    """The cells of places on the Earth; y grows south."""
    longitudes = [place.x for place in places]
    if max(longitudes) - min(longitudes) > 180:  # on both sides of the 180th meridian
        longitudes = [x + 360 if x < 0 else x for x in longitudes]
    latitudes = [place.y for place in places]
    middle_x, middle_y = ((min(v) + max(v)) / 2 for v in (longitudes, latitudes))
    east = math.radians(1) * EARTH_RADIUS * math.cos(math.radians(middle_y)) / cell_size
    south = -math.radians(1) * EARTH_RADIUS / cell_size
    return [
        (
            math.floor(grid / 2 + (x - middle_x) * east),
            math.floor(grid / 2 + (y - middle_y) * south),
        )
        for x, y in zip(longitudes, latitudes, strict=True)
    ]


def _check_grid(
    path: Path, places: Sequence[Place], cells: Sequence[Cell], grid: int, is_centred: bool
) -> None:
    """Refuse cells off the grid; the message names a grid that is large enough."""
    for place, cell in zip(places, cells, strict=True):
        if not all(0 <= coordinate < grid for coordinate in cell):
            beyond = max(max(-c, c - grid + 1) for at in cells for c in at)
            needed = grid + 2 * beyond if is_centred else grid + beyond
            line = f"{place.name} is off the grid of {grid} x {grid} cells, at {list(cell)}"
            if min(cell) < 0 and not is_centred:
                allowed = "0 <= x, y"
            elif needed <= MAX_GRID:
                allowed = f"grid = {needed} or more"
                allowed += ", or a larger cell_size" if is_centred else ""
            else:
                allowed = "a larger cell_size" if is_centred else f"0 <= x, y < {MAX_GRID}"
            raise InputError(f"{path}: {line}; allowed: {allowed}")
