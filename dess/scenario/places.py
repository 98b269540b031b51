"""Places of users in files: rows of CSV files, and features of GeoJSON, with their projection.

    read_places(Path("buoys.csv"))       # the places of a file, degrees or cells

Columns of CSV files are known by their names, whatever the case (``COLUMNS``). Degrees are
projected about the centre of the grid (equirectangular projection).
"""

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self, TypeVar

import numpy as np
from pydantic import Field

from dess.base.elementary import cos, hypot, sin
from dess.base.errors import InputError, shown, unknown_name, validated
from dess.base.files.documents import Document
from dess.base.files.reading import TEXT_LIMIT, read_text
from dess.physics.chart import Cell
from dess.physics.section import Strict
from dess.scenario.quantities import may_part_thousands

EARTH_RADIUS = 6_371_008.8  # mean radius of WGS 84 [m]

# The pairs of columns, and the largest number of each; cells off the grid are refused later.
GEOGRAPHIC = ("lon", "lat")
LIMITS = {("x", "y"): (99_999, 99_999), GEOGRAPHIC: (180, 90)}
# What columns of a place are called; letters may be small or large.
COLUMNS = {"lon": ("lon", "lng", "long", "longitude"), "lat": ("lat", "latitude")}
COLUMNS |= {"x": ("x",), "y": ("y",)}
# With this first line Excel says what parts the columns.
_NAMED_DELIMITER = re.compile("sep=(.)", re.IGNORECASE)
_ROUNDING = 1e-6  # degrees by which a file may be beyond a limit
# An edge that is longer [degrees] crosses the 180th meridian instead.
_LONGEST = 270

# Of the geofence of a plan: the sides of a circle, its largest radius [m], and how far beyond all
# of it UAVs are kept out [degrees].
_SIDES, _MOST_RADIUS, _FAR = 64, 10**6, 90
# Readers of other packages: entry points whose names are file endings, as ".kml", and whose values
# are functions of a path that return ``Places``; for weather, times and columns
# (``dess.scenario.weather.formats``).
GROUP = "dess.readers"
# What a feature consists of, as GeoJSON calls it.
POINT, LINE, POLYGON = "Point", "LineString", "Polygon"
_GEOJSON = "a GeoJSON FeatureCollection"

Read = TypeVar("Read")
Size = tuple[int, int]  # cells of the grid from west to east, and from north to south
Shape = tuple[str, list[np.ndarray]]  # POINT, LINE or POLYGON, and its rings of (K, 2) places


class Projection(NamedTuple):
    """The projection of a sea.

    Attributes:
        centre: Longitude and latitude of the centre of the grid [degrees].
        size: Cells of the grid from west to east and from north to south.
        cell_size: Side of a cell [m].
    """

    centre: tuple[float, float]
    size: Size
    cell_size: float

    @classmethod
    def about(cls, degrees: np.ndarray, size: Size, cell_size: float) -> Self:
        """The projection about the centre of the bounding box of (K, 2) places on the Earth."""
        if np.ptp(degrees[:, 0]) > 180:  # on both sides of the 180th meridian
            degrees = degrees + [360, 0] * (degrees < 0)
        lon, lat = (degrees.min(0) + degrees.max(0)) / 2
        if lon > 180:
            lon -= 360
        return cls((float(lon), float(lat)), size, cell_size)

    @property
    def _degree(self) -> np.ndarray:
        """A degree to the east and one to the north [cells]; y grows south."""
        degree = math.radians(1) * EARTH_RADIUS / self.cell_size
        return np.array([degree * cos(math.radians(self.centre[1])), -degree])

    def cells(self, degrees: np.ndarray) -> np.ndarray:
        """The (K, 2) places on the grid [cells] of (K, 2) places on the Earth."""
        away = degrees - self.centre
        away[:, 0] -= 360 * np.round(away[:, 0] / 360)  # the short way around the Earth
        return np.array(self.size) / 2 + away * self._degree

    def degrees(self, places: np.ndarray) -> np.ndarray:
        """The (K, 2) places on the Earth of (K, 2) places on the grid [cells].

        Longitudes go on beyond 180 degrees where the grid does, so that no path jumps by 360.
        """
        return (places - np.array(self.size) / 2) / self._degree + self.centre

    def distance_error(self, places: np.ndarray) -> float:
        """The largest error of distances in the rectangle around (K, 2) places [cells], as a share.

        Distances between its corners, and from them a hundredth of a cell to the east, are compared
        with those on the Earth (great circles).
        """
        low, high = places.min(0), places.max(0)
        corners = np.array([low, high, [low[0], high[1]], [high[0], low[1]]])
        spots = np.concatenate([corners, corners + [0.01, 0]])
        first, second = np.triu_indices(len(spots), 1)
        across = spots[first] - spots[second]
        on_grid = hypot(across[:, 0], across[:, 1]) * self.cell_size
        degrees = np.radians(self.degrees(spots))
        half = np.sin((degrees[first] - degrees[second]) / 2) ** 2
        lats = np.cos(degrees[:, 1])
        on_earth = np.arcsin(np.sqrt(half[:, 1] + lats[first] * lats[second] * half[:, 0]))
        is_known = on_grid > 0
        errors = on_grid[is_known] / (2 * EARTH_RADIUS * on_earth[is_known]) - 1
        return float(np.abs(errors).max())

    def shapes(self, rings: list[np.ndarray]) -> Iterator[list[np.ndarray]]:
        """The rings of a shape on the grid [cells]; once more for each turn around the Earth.

        A ring is unwrapped as a whole: its first place may be anywhere, the others follow it.
        """
        rings = [_unwrapped(ring) for ring in rings]
        middles = [(ring[:, 0].min() + ring[:, 0].max()) / 2 for ring in rings]
        turns = np.round((np.array(middles) - middles[0]) / 360)  # of holes, away from the outer
        first = np.round((middles[0] - self.centre[0]) / 360)
        for turn in (-1, 0, 1):
            degrees = [
                ring - self.centre - [360 * (first + of_ring - turn), 0]
                for ring, of_ring in zip(rings, turns, strict=True)
            ]
            yield [np.array(self.size) / 2 + ring * self._degree for ring in degrees]


def _unwrapped(ring: np.ndarray) -> np.ndarray:
    """A ring or line whose long edges cross the 180th meridian instead.

    An edge of 360 degrees is one of a map that is cut there, and a ring that does not close any
    more goes around a pole: both stay as they are.
    """
    steps = np.diff(ring[:, 0])
    is_long = (np.abs(steps) > _LONGEST) & (np.abs(steps) < 360)
    turns = np.cumsum(-np.sign(steps) * is_long)
    if len(turns) and turns[-1] and (ring[0] == ring[-1]).all():
        return ring
    return ring + np.stack([360 * np.append(0, turns), np.zeros(len(ring))], axis=1)


class Place(NamedTuple):
    """A row of a CSV file, or a feature.

    Attributes:
        where: Where it stands in the file, such as ``line 3``.
        properties: The columns or the properties.
        shapes: What it consists of; none if it is empty.
    """

    where: str
    properties: Mapping[str, Any]
    shapes: list[Shape]

    def property(self, name: str, known: Iterable[str] = ()) -> Any:
        """The property of this name, or else the first of the known ones, whatever the case.

        Raises:
            InputError: If it has none of this name.
        """
        if name and name not in self.properties:
            raise unknown_name(self.where, f"has no {name}", name, self.properties)
        lower = {str(key).lower(): value for key, value in self.properties.items()}
        values = [self.properties[name]] if name else [lower.get(key) for key in known]
        return next((value for value in values if value not in (None, "")), None)


class Places(NamedTuple):
    """The places of a file, degrees or cells."""

    is_geographic: bool
    places: list[Place]


class Source(Strict):
    """A file that a scenario names, and what is taken of it."""

    file: str = Field(description="the name of a file beside the scenario, or in a folder there")
    where: dict[str, str] = Field(
        default={}, description="the properties of what is taken, e.g. {Country = 'DK*'}"
    )

    def chosen(self, places: list[Place], path: Path) -> list[Place]:
        """The places that have the wanted properties; ``*`` and ``?`` stand for other letters.

        Raises:
            InputError: If the file, whose path is for the message, has places and none is chosen.
        """
        chosen = places
        for name, pattern in self.where.items():
            present = chosen
            chosen = [p for p in present if fnmatchcase(str(p.properties.get(name)), pattern)]
            if present and not chosen:
                values = [str(p.properties[name]) for p in present if name in p.properties]
                if not values:
                    names = [other for place in present for other in place.properties]
                    raise unknown_name(path, f"has no {name}", name, names)
                problem = f"where: no place has {name} = {shown(pattern)}"
                raise unknown_name(path, problem, pattern, values)
        return chosen


def read_places(path: Path, others: Iterable[str] = ()) -> Places:
    """The places in a file, by its ending; other packages may read further ones (``GROUP``).

    Args:
        path: The file.
        others: Endings that are read elsewhere, for the message.

    Raises:
        InputError: If no reader knows the ending, or the file cannot be read.
    """
    ending = path.suffix.lower()
    if ending in READERS:
        return READERS[ending](path)
    return read_by_others(path, Places, [*others, *READERS])


def read_by_others(path: Path, kind: Callable[..., Read], others: Iterable[str]) -> Read:
    """What the reader of another package reads in a file (``GROUP``).

    Args:
        path: The file.
        kind: What is made of the items that it returns.
        others: Endings that are read here, for the message.

    Raises:
        InputError: If no reader knows the ending, or the file cannot be read.
    """
    added = {point.name: point for point in entry_points(group=GROUP)}
    point = added.get(path.suffix.lower())
    if point is None:
        raise InputError(path, "has no known file ending", ", ".join([*others, *added]))
    try:
        return kind(*point.load()(path))
    except InputError:
        raise
    except Exception as error:  # code of others may raise anything; name it
        problem = f"cannot be read by {point.value}: {type(error).__name__}: {error}"
        raise InputError(path, problem, f"a {point.name} file") from error


def is_on_grid(cell: Cell, size: Size) -> bool:
    """Whether a cell is on the grid."""
    return 0 <= cell[0] < size[0] and 0 <= cell[1] < size[1]


def read_table(path: Path) -> Places:
    """The places in a CSV file, in the order of its lines; commas, semicolons or tabs part columns.

    Raises:
        InputError: If it cannot be read, has other columns, or a place is no number.
    """
    try:
        text = read_text(path, TEXT_LIMIT, "utf-8-sig", "a CSV file")
        text, delimiter = without_delimiter(text)
        lines = csv.reader(io.StringIO(text), strict=True, delimiter=delimiter)
        columns = [name.strip() for name in next(filter(None, lines), [])]
        rows = [(f"line {lines.line_num}", row) for row in lines if any(map(str.strip, row))]
    except csv.Error as error:
        raise InputError(path, f"is not a CSV file: {error}", "CSV with commas") from None
    axes = {axis: [c for c in columns if c.lower() in COLUMNS[axis]] for axis in COLUMNS}
    pairs = [pair for pair in LIMITS if all(len(axes[axis]) == 1 for axis in pair)]
    if len(pairs) != 1:
        present = ", ".join(columns) or "none"
        allowed = "x and y, or lon and lat"
        if pairs:
            allowed = "one pair: x and y are cells, lon and lat degrees"
        raise InputError(path, f"has columns {present}", allowed)
    is_geographic = pairs == [GEOGRAPHIC]
    places = []
    for line, texts in rows:
        filled = zip(columns, map(str.strip, texts), strict=False)
        values = dict.fromkeys(columns, "") | dict(filled)
        numbers = [
            _number(values[axes[axis][0]], f"{path}: {line}: {axis}", most, is_geographic)
            for axis, most in zip(pairs[0], LIMITS[pairs[0]], strict=True)
        ]
        places.append(Place(line, values, [(POINT, [np.array([numbers])])]))
    return Places(is_geographic, places)


def without_delimiter(text: str) -> tuple[str, str]:
    """The text of a CSV file without the line that says what parts its columns, and what does.

    The numbers of its lines stay. Without such a line, the first line tells the most frequent of
    comma, semicolon and tab.
    """
    text = text.lstrip("\r\n")
    first, _, others = text.partition("\n")
    named = _NAMED_DELIMITER.fullmatch(first.rstrip("\r"))
    if named:
        return f"\n{others}", named[1]
    return text, max(",;\t", key=first.count)


def number_of(text: str, place: str) -> float:
    """A number, be it with a decimal comma.

    Raises:
        InputError: If it is none; ``place`` says where it stands.
    """
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise InputError("", f"{place} is {shown(text)}", "a number") from None


def amount_of(text: str, place: str) -> float:
    """A number whose comma, if it has one, parts decimals for certain.

    Raises:
        InputError: If it is none, or ``1,000`` could be a thousand; ``place`` says where it stands.
    """
    if may_part_thousands(text.strip()):
        allowed = f"{text.replace(',', '')} or {text.replace(',', '.')}"
        problem = "has a comma that may part thousands or decimals"
        raise InputError(place, f"{shown(text)} {problem}", allowed)
    return number_of(text, place)


def _number(text: str, place: str, most: int, is_geographic: bool) -> float:
    """A number of at most this size; a cell has integers."""
    number = number_of(text, place)
    if not -most - _ROUNDING <= number <= most + _ROUNDING:
        raise InputError("", f"{place} is {number:g}", f"{-most:,}..{most:,}")
    if not is_geographic and not number.is_integer():
        raise InputError(
            "", f"{place} is {number:g}", "an integer (a cell); degrees are lon and lat"
        )
    return min(max(number, -most), most)


class _Geometry(Document, extra="allow"):
    type: Literal[
        "Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon",
        "GeometryCollection",
    ]  # fmt: skip
    coordinates: list[Any] = Field([], description="positions, or lists of them")
    geometries: list[dict[str, Any]] = Field([], description="geometries")


class _Feature(Document, extra="allow"):
    id: str | int | float | None = None
    geometry: _Geometry | None = Field(None, description="a geometry")
    properties: dict[str, Any] | None = None


class Features(Document, extra="ignore"):
    """A GeoJSON file."""

    features: tuple[_Feature, ...] = Field(min_length=1, description=_GEOJSON)


def read_geojson(path: Path) -> Places:
    """The features of a GeoJSON file; those without a geometry have no shapes.

    Members that GeoJSON does not know are properties as well. A geometry within another one that
    has such members, as zones of ED-318 have them, is a place of its own.

    Raises:
        InputError: If it cannot be read, or is no GeoJSON.
    """
    places = []
    features = Features.load(path, absent=_GEOJSON, limit=TEXT_LIMIT).features
    for number, feature in enumerate(features):
        where = f"features.{number}"
        properties = {"id": feature.id} | _foreign(feature) | (feature.properties or {})
        of_feature = Place(where, properties, [])
        if feature.geometry:
            of_feature = Place(where, properties | _foreign(feature.geometry), [])
            for inner, geometry in _geometries(feature.geometry, f"{where}.geometry"):
                shapes = _shapes(geometry, f"{path}: {inner}")
                if geometry is not feature.geometry and _foreign(geometry):
                    places.append(Place(inner, properties | _foreign(geometry), [*shapes]))
                else:
                    of_feature.shapes.extend(shapes)
        places.append(of_feature)
    return Places(True, places)


def _foreign(part: _Feature | _Geometry) -> dict[str, Any]:
    """The members of a part of a file that GeoJSON does not know."""
    members = part.model_extra or {}
    return {name: value for name, value in members.items() if name not in ("type", "bbox")}


def _geometries(geometry: _Geometry, place: str) -> Iterator[tuple[str, _Geometry]]:
    """The geometries of a feature, the inner ones first, each with where it stands."""
    for number, inner in enumerate(geometry.geometries):
        where = f"{place}.geometries.{number}"
        yield from _geometries(validated(_Geometry, inner, where), where)
    yield place, geometry


def _shapes(geometry: _Geometry, place: str) -> Iterator[Shape]:
    """The parts of a geometry of GeoJSON, those that are empty left out."""
    kind = geometry.type.removeprefix("Multi")
    place = f"{place}.coordinates"
    parts = {place: geometry.coordinates}
    if kind != geometry.type:
        parts = {f"{place}.{n}": part for n, part in enumerate(geometry.coordinates)}
    for where, part in parts.items():
        if part and kind == POLYGON:
            rings = [part]
            if isinstance(part, list):
                rings = part
            yield kind, [_ring(ring, f"{where}.{n}") for n, ring in enumerate(rings)]
        elif part and kind == LINE:
            yield kind, [_line(part, where)]
        elif part:
            yield kind, [_positions([part], where)]


def _ring(value: Any, place: str) -> np.ndarray:
    ring = _positions(value, place)
    if len(ring) < 4 or (ring[0] != ring[-1]).any():
        allowed = "four positions or more, the last as the first"
        raise InputError(place, "is no ring", allowed)
    return ring


def _line(value: Any, place: str) -> np.ndarray:
    line = _positions(value, place)
    if len(line) < 2:
        raise InputError(place, "is no line", "two positions or more")
    return line


def _positions(value: Any, place: str, form: str = "[lon, lat]") -> np.ndarray:
    """The (K, 2) degrees of a list of positions; messages say their ``form``."""
    try:
        positions = np.array([position[:2] for position in value], float).reshape(len(value), 2)
    except (TypeError, ValueError, OverflowError, KeyError):
        raise InputError(place, "has not two numbers", form) from None
    most = np.array(LIMITS[GEOGRAPHIC])
    for number, axis in np.argwhere(~(np.abs(positions) <= most + _ROUNDING)):
        where = place
        if len(positions) > 1:
            where = f"{place}.{number}"
        name = GEOGRAPHIC[axis]
        limit = most[axis]
        problem = f"{name} is {positions[number, axis]:g}"
        raise InputError(where, problem, f"-{limit}..{limit}")
    return np.clip(positions, -most, most)


class _PlanPolygon(Document, extra="ignore"):
    polygon: list[Any] = Field(description="corners, [lat, lon] each")
    inclusion: bool


class _Circle(Document, extra="ignore"):
    center: list[Any] = Field(description="[lat, lon]")
    radius: float = Field(gt=0, le=_MOST_RADIUS, description="of a circle [m]")


class _PlanCircle(Document, extra="ignore"):
    circle: _Circle
    inclusion: bool


class _GeoFence(Document, extra="ignore"):
    polygons: list[_PlanPolygon] = []
    circles: list[_PlanCircle] = []


class _PlanDocument(Document, extra="ignore"):
    """A plan of QGroundControl, of which the geofence is read."""

    geoFence: _GeoFence = Field(description="a geofence")  # noqa: N815


def read_plan(path: Path) -> Places:
    """The no-fly zones of the geofence of a plan of QGroundControl (``.plan``).

    What UAVs are kept out of is a feature each; all that lies outside of the polygons and circles
    in which they are kept is one feature more. A circle is a polygon of ``_SIDES`` sides.

    Raises:
        InputError: If it cannot be read, or is no plan.
    """
    fence = _PlanDocument.load(path, absent="a plan of QGroundControl", limit=TEXT_LIMIT).geoFence
    rings = []
    for number, polygon in enumerate(fence.polygons):
        where = f"geoFence.polygons.{number}"
        ring = _corners(polygon.polygon, f"{path}: {where}.polygon")
        if len(ring) < 3:
            raise InputError(f"{path}: {where}.polygon", "is no polygon", "three corners or more")
        rings.append((where, np.concatenate([ring, ring[:1]]), polygon.inclusion))
    for number, item in enumerate(fence.circles):
        where = f"geoFence.circles.{number}"
        [centre] = _corners([item.circle.center], f"{path}: {where}.circle.center")
        rings.append((where, _ring_about(centre, item.circle.radius), item.inclusion))
    places = [
        Place(where, {"id": None}, [(POLYGON, [ring])])
        for where, ring, inclusion in rings
        if not inclusion
    ]
    inside = [ring for _, ring, inclusion in rings if inclusion]
    if inside:
        places.append(Place("geoFence", {"id": None}, [(POLYGON, [_around(inside), *inside])]))
    return Places(True, places)


def _corners(value: Any, place: str) -> np.ndarray:
    """(K, 2) longitudes and latitudes of a list of [lat, lon]."""
    if isinstance(value, list):
        value = [[*reversed(c[:2])] if isinstance(c, list) else c for c in value]
    return _positions(value, place, "[lat, lon]")


def _ring_about(centre: np.ndarray, radius: float) -> np.ndarray:
    """(K, 2) longitudes and latitudes around a circle."""
    degree = radius / EARTH_RADIUS / math.radians(1)
    turns = [2 * math.pi * side / _SIDES for side in range(_SIDES + 1)]
    narrow = cos(math.radians(centre[1]))
    away = np.array([[cos(angle) / narrow, sin(angle)] for angle in turns])
    ring = centre + degree * away
    ring[-1] = ring[0]
    return ring


def _around(rings: list[np.ndarray]) -> np.ndarray:
    """A ring far around others."""
    corners = np.concatenate(rings)
    west, south = corners.min(0) - _FAR
    east, north = corners.max(0) + _FAR
    return np.array([(west, south), (east, south), (east, north), (west, north), (west, south)])


READERS = {".csv": read_table, ".tsv": read_table, ".geojson": read_geojson, ".json": read_geojson}
READERS[".plan"] = read_plan
