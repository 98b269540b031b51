"""The no-fly cells and charging zones of a user's own sea, read from files beside its scenario.

    no_fly = "islands.txt"  # in the TOML file of a scenario
    no_fly = ["land.geojson", {file = "routes.geojson", width = 2000, touched = true}]

Of polygons, a cell is a no-fly cell if its centre lies in one of them, and not in a hole; with
``touched``, every cell of which a part does. Points and lines close every cell that they touch, on
an edge those of both sides; a line with a width, and a point with a ``radius`` of its own, every
cell whose centre is so near as well. A map in a text (``.txt``, ``.map``) has a line for each row
of cells, one in a picture (``.png``) a pixel for each cell. Of a plan (``.plan``), the geofence
closes cells, also those outside of what UAVs are kept in.
"""

import io
import logging
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from dess.base.errors import InputError, listed, shown
from dess.base.files.reading import TEXT_LIMIT, read_bytes, read_text
from dess.base.libraries import absence, needs
from dess.physics.chart import Rectangle
from dess.physics.section import Number
from dess.scenario import places
from dess.scenario.places import Place, Projection, Size
from dess.scenario.quantities import quantity_of

# The letters of maps, those of the MAPF benchmark among them: trees and water are closed.
CLOSED, FREE = "#@OTW", ".GS"
_MAPF = CLOSED[1:] + FREE
MOST_METRES = 10**6  # of a width, a buffer or a radius
# How far beyond itself a point or a line touches a cell [cells]: it may lie on an edge, which the
# rounding of a projection puts on either side.
_HAIR = 1e-6

_REMEDY = "touched = true closes all cells that they touch"

# What a place says of its extent, by the last word of a property: its radius, perhaps with a unit
# as in "Radius (km)"; what is not read; from and up to which altitude it reaches.
_RADIUS = re.compile(r"radius[ _.-]*[(\[]?([a-z]*)[)\]]?", re.IGNORECASE)
_UNREAD = re.compile(
    "radius|diameter|width|buffer|wkt|polygon|ellipse|semi.?(?:major|minor)|(?<![a-z])range|extent",
    re.IGNORECASE,
)
_LOWER = re.compile(r"lower|floor|min_?alt", re.IGNORECASE)
_UPPER = re.compile(r"upper|ceil|max_?alt", re.IGNORECASE)
_OF_A_LIMIT = re.compile(r"ref|datum|unit|uom", re.IGNORECASE)
_UNIT = re.compile(r"unit|uom", re.IGNORECASE)
# In hundreds of feet, as FL100 or as 100 with the unit FL.
_FLIGHT_LEVEL = re.compile(r"FL ?([0-9]{1,3})|([0-9]{1,3}) FL", re.IGNORECASE)


class NoFlyFile(places.Source):
    """A file of no-fly cells, and how they are taken from it."""

    touched: bool = Field(
        False, description="whether a cell of which only a part lies in it counts"
    )
    width: Number = Field(0.0, ge=0, le=MOST_METRES, description="of lines [m]")
    buffer: Number = Field(0.0, ge=0, le=MOST_METRES, description="kept around everything [m]")
    colours: tuple[Annotated[str, Field(pattern="^#[0-9a-f]{6}$")], ...] = Field(
        (), description="colours of closed cells in a picture, such as '#ff0000'; by default red"
    )


def no_fly_in(
    path: Path, size: Size, projection: Projection | None, source: NoFlyFile, altitude: float
) -> np.ndarray:
    """(H, W) whether a cell is a no-fly cell of a file; notes tell what closes none or is not read.

    Args:
        path: A file ``.txt``, ``.map``, ``.png``, ``.csv``, ``.tsv``, ``.geojson``, ``.json`` or
            ``.plan``.
        size: Cells of the grid from west to east and from north to south.
        projection: That of the sea, none if the nodes are cells.
        source: What is taken of the file.
        altitude: That of the UAVs [m]; a note tells of zones that begin above it.

    Raises:
        InputError: If the file cannot be read, a map has another size, ``where`` takes no place, a
            cell is off the grid, or the file has degrees and the nodes are cells.
    """
    return places.reader(path, _READERS)(path, size, projection, source, altitude)


def zones_in(path: Path, size: Size) -> list[Rectangle]:
    """The charging zones of a map in a picture: its blue rectangles, from north to south.

    Raises:
        InputError: If the file cannot be read or has another size, or a zone is no rectangle.
    """
    from scipy import ndimage

    pixels = places.reader(path, {".png": _pixels})(path, size)
    is_blue = _is_blue(pixels)
    rectangles = ndimage.find_objects(ndimage.label(is_blue)[0])
    if not rectangles:
        raise InputError(path, "has no blue pixels, of which zones are", "one rectangle or more")
    for y, x in rectangles:
        if not is_blue[y, x].all():
            where = f"x {x.start}..{x.stop - 1}, y {y.start}..{y.stop - 1}"
            problem = f"the blue pixels at {where} do not fill their rectangle"
            raise InputError(path, problem, "filled rectangles that do not touch each other")
    return [(x.start, y.start, x.stop - x.start, y.stop - y.start) for y, x in rectangles]


def _of_text(
    path: Path, size: Size, _: Projection | None, source: NoFlyFile, altitude: float
) -> np.ndarray:
    _tell_unused(path, source, "a map", "file")
    text = read_text(path, TEXT_LIMIT, "utf-8-sig", "a map")
    rows = [(number, line.rstrip()) for number, line in enumerate(text.splitlines(), 1)]
    if text.startswith("type"):  # the header of a map of the MAPF benchmark
        begin = len(rows)
        if "map" in text.split():
            begin = [line for _, line in rows].index("map") + 1
        rows = rows[begin:]
    filled = [place for place, (_, line) in enumerate(rows) if line]
    rows = rows[filled[0] : filled[-1] + 1] if filled else []
    allowed = f"{size[1]} lines of {size[0]} cells, as grid and rows say"
    if len(rows) != size[1]:
        raise InputError(path, f"has {len(rows):,} lines", allowed)
    for number, line in rows:
        if unknown := line.strip(CLOSED + FREE):
            letters = "# for a no-fly cell, . for an open one, or the MAPF letters " + _MAPF
            raise InputError(f"{path}: line {number}", f"has {shown(unknown[0])}", letters)
        if len(line) != size[0]:
            raise InputError(f"{path}: line {number}", f"has {len(line):,} cells", allowed)
    return np.array([[cell in CLOSED for cell in line] for _, line in rows])


def _of_picture(
    path: Path, size: Size, _: Projection | None, source: NoFlyFile, altitude: float
) -> np.ndarray:
    _tell_unused(path, source, "a picture", "file", "colours")
    pixels = _pixels(path, size)
    closed = (pixels[..., 0] > 127) & (pixels[..., 2] < 128)
    if source.colours:
        colours = [[int(colour[n : n + 2], 16) for n in (1, 3, 5)] for colour in source.colours]
        closed = (pixels[:, :, None] == np.array(colours)).all(3).any(2)
    if not closed.any():
        names = _colours_of(pixels.reshape(-1, 3))
        _note(f"{path} closes no cell; its colours are {names}: colours says which do")
        return closed
    is_open_or_zone = (pixels == 0).all(2) | (pixels == 255).all(2) | _is_blue(pixels)
    unread = pixels[~closed & ~is_open_or_zone]
    if len(unread) and not source.colours:
        count = f"{len(unread):,} pixels of {_colours_of(unread)}"
        _note(f"{path}: {count} close no cell; colours says which do")
    return closed


def _is_blue(pixels: np.ndarray) -> np.ndarray:
    """(H, W) whether pixels are those of zones."""
    return (pixels[..., 2] > 127) & (pixels[..., 0] < 128)


def _colours_of(pixels: np.ndarray) -> str:
    """The colours of (K, 3) pixels, as a message lists them."""
    present = np.unique(pixels, axis=0).tolist()
    return listed(f"#{bytes(colour).hex()}" for colour in present)


def _pixels(path: Path, size: Size) -> np.ndarray:
    """(H, W, 3) red, green and blue of a picture."""
    try:
        from PIL import Image
    except ModuleNotFoundError as error:
        raise absence(error, "a map in a picture") or error from None
    buffer = io.BytesIO(read_bytes(path, TEXT_LIMIT, "a picture"))
    try:
        with Image.open(buffer) as image:
            actual = image.size
            pixels = np.array(image.convert("RGB") if actual == size else ())
    except (OSError, SyntaxError):
        raise InputError(path, "is no picture", "a PNG file") from None
    if actual != size:
        allowed = f"{size[0]} x {size[1]}, as grid and rows say"
        raise InputError(path, f"has {actual[0]} x {actual[1]} pixels", allowed)
    return pixels


def _tell_unused(path: Path, source: NoFlyFile, kind: str, *used: str) -> None:
    """Tell in a note which keys say nothing about a file of this kind."""
    unused = [name for name in source.model_fields_set if name not in used]
    if unused:
        _note(f"{path} is {kind}, for which {listed(sorted(unused))} has no effect")


def _of_places(
    path: Path, size: Size, projection: Projection | None, source: NoFlyFile, altitude: float
) -> np.ndarray:
    is_geographic, features = places.reader(path, places.READERS)(path)
    if not features:
        raise InputError(path, "has no places", "one or more")
    if is_geographic and projection is None:
        raise InputError(
            path,
            "has degrees, and the nodes are cells",
            "cells, nodes from a file with degrees, or centre",
        )
    chosen = source.chosen(features, path)
    if is_geographic and projection:
        return _of_degrees(path, chosen, projection, source, altitude)
    _tell_unused(path, source, "a table of cells", "file", "where")
    if any(_radii(place) for place in chosen):
        _note(f"{path}: the column radius is not used, since its places are cells and no degrees")
    closed = np.zeros(size[::-1], np.bool_)
    for place in chosen:
        x, y = place.shapes[0][1][0][0].astype(int)
        if not places.is_on_grid((x, y), size):
            what = f"off the grid of {size[0]} x {size[1]} cells, at {[int(x), int(y)]}"
            allowed = f"0 <= x < {size[0]}, 0 <= y < {size[1]}"
            raise InputError(path, f"{place.where} is {what}", allowed)
        closed[y, x] = True
    return closed


def _of_degrees(
    path: Path, chosen: list[Place], projection: Projection, source: NoFlyFile, altitude: float
) -> np.ndarray:
    from scipy import ndimage

    _tell_unused(path, source, "a file of places", *(NoFlyFile.model_fields.keys() - {"colours"}))
    closed = np.zeros(projection.size[::-1], np.bool_)
    unseen = []
    elsewhere = []
    for place in chosen:
        cells, is_near = _cells_of(place, projection, source, _radius(place, path))
        if is_near and not cells.any():
            unseen.append(place.where)
        if cells.any() and _lies_elsewhere(place, altitude):
            elsewhere.append(place.where)
        closed |= cells
    if unseen:
        names = listed(unseen)
        _note(f"{path}: {names} close no cell; {_REMEDY}")
    elif not closed.any():
        _note(f"{path} closes no cell: it is not on the grid")
    beside = ndimage.binary_dilation(closed, np.ones((5, 5)))
    narrow = [p.where for p in chosen if p.where not in unseen and _has_gaps(p, projection, beside)]
    if narrow and not source.touched:
        names = listed(narrow)
        _note(f"{path}: {names} are narrower than a cell at places that stay open; {_REMEDY}")
    if elsewhere:
        names = listed(elsewhere)
        problem = f"lie above or below the UAVs, {altitude:g} m high, and close their cells"
        _note(f"{path}: by their limits of altitude {names} {problem}; where leaves them out")
    unread = {name for place in chosen for name in _unread_names(place)}
    if unread:
        _note(f"{path}: {listed(sorted(unread))} of its places is not read; width and buffer are")
    return closed


# Notes that are kept until a scenario is known to be valid: a refusal is told alone.
_held: ContextVar[list[str] | None] = ContextVar("held", default=None)


@contextmanager
def notes_after() -> Iterator[None]:
    """Tell the notes of a block at its end, and none if it raises an error."""
    token = _held.set([])
    try:
        yield
        notes = _held.get() or []
    finally:
        _held.reset(token)
    for line in notes:
        tell(line)


def _note(line: str) -> None:
    tell(f"no_fly: {line}")


def tell(line: str) -> None:
    """Tell once what a user should know, or keep it for the end of ``notes_after``."""
    notes = _held.get()
    if notes is None:
        _tell_once(line)
    else:
        notes.append(line)


@cache
def _tell_once(line: str) -> None:
    logging.getLogger(__name__).warning("note: %s", line)


def _statements(values: Mapping[str, Any], within: str = "") -> Iterator[tuple[str, Any]]:
    """The properties of a place that are not empty, those of tables in them dotted."""
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _statements(value, f"{within}{name}.")
        elif value not in (None, ""):
            yield f"{within}{name}", value


def _radii(place: Place) -> dict[str, str]:
    """The radii of a circle, with their units, by the names of the properties that say them."""
    radii = {}
    for name, value in _statements(place.properties):
        match = _RADIUS.fullmatch(name.rpartition(".")[2])
        if match:
            text = str(value).strip()
            if not text[-1:].isalpha():
                unit = match[1].lower() or "m"
                text = f"{text} {'NM' if unit == 'nm' else unit}"
            radii[name] = text
    return radii


def _radius(place: Place, path: Path) -> float:
    """The radius of a circle [m], the largest that it has; 0 without one.

    Raises:
        InputError: If it is none.
    """
    largest = 0.0
    for name, text in _radii(place).items():
        if _has_points(place):
            where = f"{path}: {place.where}: {name}"
            radius = quantity_of(text, where, "m")
            if not 0 <= radius <= MOST_METRES:
                allowed = f"metres from 0 to {MOST_METRES:,}, or a distance with its unit"
                raise InputError(where, f"{shown(text)} is out of range", allowed)
            largest = max(largest, radius)
    return largest


def _has_points(place: Place) -> bool:
    return any(kind == places.POINT for kind, _ in place.shapes)


def _unread_names(place: Place) -> list[str]:
    """The properties of a place that seem to say how far it reaches, and are not read."""
    radii = _radii(place)
    if not _has_points(place):
        radii = {}
    return [
        name
        for name, _ in _statements(place.properties)
        if _UNREAD.search(name.rpartition(".")[2]) and name not in radii
    ]


def _lies_elsewhere(place: Place, altitude: float) -> bool:
    """Whether a place begins above an altitude [m], or ends below it."""
    lower = _limits(place, _LOWER)
    upper = [limit for limit in _limits(place, _UPPER) if limit > 0]  # 0 is often for none
    return max(lower, default=0.0) > altitude or min(upper, default=altitude) < altitude


def _limits(place: Place, kind: re.Pattern[str]) -> list[float]:
    """The limits of altitude of a kind that a place has [m]; without a unit they are metres."""
    limits = []
    statements = dict(_statements(place.properties))
    for name, value in statements.items():
        table, _, word = name.rpartition(".")
        if not kind.search(name) or _OF_A_LIMIT.search(word):
            continue
        text = str(value).strip()
        if not text[-1:].isalpha() and not _FLIGHT_LEVEL.fullmatch(text):
            beside = [n for n in statements if n.rpartition(".")[0] == table and _UNIT.search(n)]
            beside.sort(key=lambda other: not kind.search(other))  # its own unit, if it has one
            units = [str(statements[other]).lower() for other in beside]
            text = f"{text} {next(filter(str.isalpha, units), 'm')}"
        level = _FLIGHT_LEVEL.fullmatch(text)
        if level:
            text = f"{level[1] or level[2]}00 ft"
        with suppress(InputError):  # a word, such as that for the surface of the sea
            limits.append(quantity_of(text, name, "m"))
    return limits


def _cells_of(
    place: Place, projection: Projection, source: NoFlyFile, radius: float
) -> tuple[np.ndarray, bool]:
    """The cells that a feature closes, and whether it has a part on the grid, or seems to.

    Without holes, its bounding box tells; the sea may also lie in a hole.

    Args:
        place: The feature.
        projection: That of the sea.
        source: What is taken of its file.
        radius: Of its points, which are circles then [m].
    """
    size = projection.size
    closed = np.zeros(size[::-1], np.bool_)
    is_near = False
    for kind, rings in place.shapes:
        reach = source.buffer
        if kind == places.LINE:
            reach += source.width / 2
        elif kind == places.POINT:
            reach += radius
        for turned in projection.shapes(rings):
            low = turned[0].min(0)
            high = turned[0].max(0)
            margin = reach / projection.cell_size
            beyond = margin + _HAIR
            if (high + beyond < 0).any() or (low - beyond >= size).any():
                continue
            is_near |= len(turned) == 1 or len(_border_within(turned, size)) > 0
            if kind == places.POINT:
                closed |= _cells_at(turned[0][0], size)
                if not reach:
                    continue
            if kind == places.POLYGON and not reach and not source.touched:
                closed |= centres_in(turned, size)
            else:
                closed |= _covered(kind, turned, margin, size, source.touched)
    return closed, is_near


def _has_gaps(place: Place, projection: Projection, beside: np.ndarray) -> bool:
    """Whether a border of a polygon has a part on the grid without closed cells beside it.

    Args:
        place: The feature.
        projection: That of the sea.
        beside: (H, W) whether a cell is closed, or one of those around it.
    """
    for kind, rings in place.shapes:
        for turned in projection.shapes(rings) if kind == places.POLYGON else ():
            x, y = _border_within(turned, projection.size).T
            if not beside[y, x].all():
                return True
    return False


def _border_within(rings: list[np.ndarray], size: Size) -> np.ndarray:
    """(K, 2) the cells along rings, without those at the rim of the grid, beyond which is land."""
    cells = np.concatenate([_border_of(ring, size) for ring in rings])
    return cells[((cells > 0) & (cells < np.array(size) - 1)).all(1)]


def _border_of(ring: np.ndarray, size: Size) -> np.ndarray:
    """(K, 2) the cells along a ring, of its edges that may be on the grid."""
    low = np.minimum(ring[:-1], ring[1:])
    high = np.maximum(ring[:-1], ring[1:])
    is_near = ((low < size) & (high > 0)).all(1)
    starts = ring[:-1][is_near]
    steps = np.diff(ring, axis=0)[is_near]
    counts = np.ceil(2 * np.abs(steps)).astype(int).max(1, initial=1)  # at every half of a cell
    edges = np.repeat(np.arange(len(counts)), counts)
    first = np.cumsum(counts) - counts
    shares = (np.arange(len(edges)) - first[edges]) / counts[edges]
    return np.floor(starts[edges] + shares[:, None] * steps[edges]).astype(int)


def _cells_at(spot: np.ndarray, size: Size) -> np.ndarray:
    """(H, W) whether a place [cells] lies in a cell or on its edge."""
    cells = np.zeros(size[::-1], np.bool_)
    first = np.floor(spot - _HAIR).astype(int).clip(0)
    last = np.floor(spot + _HAIR).astype(int).clip(-1)
    cells[first[1] : last[1] + 1, first[0] : last[0] + 1] = True
    return cells


def _covered(
    kind: str, rings: list[np.ndarray], reach: float, size: Size, touched: bool
) -> np.ndarray:
    """(H, W) whether a cell is in reach [cells] of a shape, with a part or with its centre.

    A line closes the cells that it touches as well.
    """
    needs("geo", "no_fly with lines, circles, touched or buffer")
    import shapely

    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    coordinates = {places.POINT: rings[0][0], places.LINE: rings[0], places.POLYGON: rings}[kind]
    shape = shapely.make_valid(shapely.geometry.shape({"type": kind, "coordinates": coordinates}))
    edge = reach + 1  # what is further away has no effect
    shape = shapely.clip_by_rect(shape, -edge, -edge, size[0] + edge, size[1] + edge)
    thin = shape
    if not shape.area:  # a point, a line, or a polygon that has collapsed to one
        thin = shape.buffer(_HAIR)
    wide = thin
    if reach:
        wide = shape.buffer(reach)
    shapely.prepare([thin, wide])
    cells = shapely.box(x, y, x + 1, y + 1)
    if touched:
        return shapely.intersects(wide, cells) & ~shapely.touches(wide, cells)
    covered = shapely.contains_xy(wide, x + 0.5, y + 0.5)
    if kind == places.LINE:
        covered |= shapely.intersects(thin, cells)
    return covered


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
        x0, y0 = starts[crosses].T
        x1, y1 = ends[crosses].T
        crossings = np.sort(x0 + (y - y0) * (x1 - x0) / (y1 - y0))
        inside[row] = np.searchsorted(crossings, np.arange(size[0]) + 0.5) % 2 == 1
    return inside


def polygons_hold(
    path: Path, projection: Projection, source: NoFlyFile, spots: np.ndarray
) -> np.ndarray:
    """(K,) whether places on the grid lie in a polygon of a file of no-fly cells.

    Args:
        path: The file; a map, a picture and a file of cells have no polygons.
        projection: That of the sea.
        source: What is taken of the file.
        spots: (K, 2) places [cells].

    Raises:
        InputError: If the file cannot be read.
    """
    is_held = np.zeros(len(spots), np.bool_)
    if path.suffix.lower() not in places.READERS:
        return is_held
    for place in source.chosen(places.reader(path, places.READERS)(path).places, path):
        for kind, rings in place.shapes:
            for turned in projection.shapes(rings) if kind == places.POLYGON else ():
                is_held |= _lie_in(turned, spots)
    return is_held


def _lie_in(rings: list[np.ndarray], spots: np.ndarray) -> np.ndarray:
    """(K,) whether (K, 2) places lie in a polygon, by the even-odd rule as in ``centres_in``."""
    x0, y0 = np.concatenate([ring[:-1] for ring in rings]).T
    x1, y1 = np.concatenate([ring[1:] for ring in rings]).T
    is_held = np.zeros(len(spots), np.bool_)
    for number, (x, y) in enumerate(spots):
        crosses = (y0 <= y) != (y1 <= y)
        shares = (y - y0[crosses]) / (y1 - y0)[crosses]
        crossings = x0[crosses] + shares * (x1 - x0)[crosses]
        is_held[number] = np.count_nonzero(crossings < x) % 2 == 1
    return is_held


_READERS: dict[str, Callable[..., np.ndarray]] = {
    **{".txt": _of_text, ".map": _of_text, ".png": _of_picture},
    **dict.fromkeys(places.READERS, _of_places),
}
