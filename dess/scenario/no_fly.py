"""The no-fly cells and charging zones of a user's own sea, read from files beside its scenario.

    no_fly = "islands.txt"  # in the TOML file of a scenario
    no_fly = ["land.geojson", {file = "routes.geojson", width = 2000, touched = true}]

Of polygons, a cell is a no-fly cell if its centre lies in one of them, and not in a hole; with
``touched``, every cell of which a part does. A line with a width is a shipping lane; without one,
it closes every cell that it touches. A point closes its cell, and one with a ``radius`` of its own
every cell whose centre lies in the circle. A map in a text (``.txt``, ``.map``)
has a line for each row of cells, one in a picture (``.png``) a pixel for each cell.
"""

import io
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import Annotated

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
    path: Path, size: Size, projection: Projection | None, source: NoFlyFile
) -> np.ndarray:
    """(H, W) whether a cell is a no-fly cell of a file; a note tells of what closes none.

    Args:
        path: A file ``.txt``, ``.map``, ``.png``, ``.csv``, ``.tsv``, ``.geojson`` or ``.json``.
        size: Cells of the grid from west to east and from north to south.
        projection: That of the sea, none if the nodes are cells.
        source: What is taken of the file.

    Raises:
        InputError: If the file cannot be read, a map has another size, a cell is off the grid, or
            the file has degrees and the nodes are cells.
    """
    return places.reader(path, _READERS)(path, size, projection, source)


def zones_in(path: Path, size: Size) -> list[Rectangle]:
    """The charging zones of a map in a picture: its blue rectangles, from north to south.

    Raises:
        InputError: If the file cannot be read or has another size, or a zone is no rectangle.
    """
    from scipy import ndimage

    red, _, blue = np.moveaxis(places.reader(path, {".png": _pixels})(path, size), 2, 0)
    is_blue = (blue > 127) & (red < 128)
    rectangles = ndimage.find_objects(ndimage.label(is_blue)[0])
    if not rectangles or not all(is_blue[part].all() for part in rectangles):
        raise InputError(path, "has no zones", "one blue rectangle or more")
    return [(x.start, y.start, x.stop - x.start, y.stop - y.start) for y, x in rectangles]


def _of_text(path: Path, size: Size, _: Projection | None, source: NoFlyFile) -> np.ndarray:
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


def _of_picture(path: Path, size: Size, _: Projection | None, source: NoFlyFile) -> np.ndarray:
    pixels = _pixels(path, size)
    closed = (pixels[..., 0] > 127) & (pixels[..., 2] < 128)
    if source.colours:
        colours = [[int(colour[n : n + 2], 16) for n in (1, 3, 5)] for colour in source.colours]
        closed = (pixels[:, :, None] == np.array(colours)).all(3).any(2)
    if not closed.any():
        present = np.unique(pixels.reshape(-1, 3), axis=0).tolist()
        names = listed(f"#{bytes(colour).hex()}" for colour in present)
        _note(f"{path} closes no cell; its colours are {names}: colours says which do")
    return closed


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


def _of_places(
    path: Path, size: Size, projection: Projection | None, source: NoFlyFile
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
    closed = np.zeros(size[::-1], np.bool_)
    unseen = []
    chosen = source.chosen(features)
    if not is_geographic and any(_has_radius(place) for place in chosen):
        _note(f"{path}: the column radius is not used, since its places are cells and no degrees")
    for place in chosen:
        if is_geographic and projection:
            cells, is_near = _cells_of(place, projection, source, _radius(place, path))
            if is_near and not cells.any():
                unseen.append(place.where)
        else:
            cells = np.zeros_like(closed)
            cell = place.shapes[0][1][0][0].astype(int)
            if not places.is_on_grid(cell, size):
                what = f"off the grid of {size[0]} x {size[1]} cells, at {cell.tolist()}"
                allowed = f"0 <= x < {size[0]}, 0 <= y < {size[1]}"
                raise InputError(path, f"{place.where} is {what}", allowed)
            cells[cell[1], cell[0]] = True
        closed |= cells
    if unseen:
        names = listed(unseen)
        _note(f"{path}: {names} close no cell; touched = true closes all cells that they touch")
    elif not closed.any():
        _note(f"{path} closes no cell: it is not on the grid")
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
        _note(line)


def _note(line: str) -> None:
    """Tell once what a user should know, or keep it for the end of ``notes_after``."""
    notes = _held.get()
    if notes is None:
        _tell(line)
    else:
        notes.append(line)


@cache
def _tell(line: str) -> None:
    logging.getLogger(__name__).warning("note: no_fly: %s", line)


_RADIUS = ("radius",)  # what the property or the column of a circle is called


def _has_radius(place: Place) -> bool:
    return place.property("", _RADIUS) is not None


def _radius(place: Place, path: Path) -> float:
    """The radius of a circle [m]: a number in metres, or a distance with its unit; or else 0.

    Raises:
        InputError: If it is none.
    """
    value = place.property("", _RADIUS)
    if value is None or all(kind != places.POINT for kind, _ in place.shapes):
        return 0.0
    where = f"{path}: {place.where}: radius"
    try:
        radius = float(str(value))
    except ValueError:
        radius = quantity_of(str(value), where, "m")
    if not 0 <= radius <= MOST_METRES:
        allowed = f"metres from 0 to {MOST_METRES:,}, or a distance with its unit"
        raise InputError(where, f"{shown(value)} is out of range", allowed)
    return radius


def _cells_of(
    place: Place, projection: Projection, source: NoFlyFile, radius: float
) -> tuple[np.ndarray, bool]:
    """The cells that a feature closes, and whether its bounding box has a part on the grid.

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
            if (high + margin < 0).any() or (low - margin >= size).any():
                continue
            is_near = True
            x, y = np.floor(turned[0][0]).astype(int)
            if kind == places.POINT and source.buffer == 0 and places.is_on_grid((x, y), size):
                closed[y, x] = True
            if kind == places.POINT and not reach:
                continue
            if kind == places.POLYGON and not reach and not source.touched:
                closed |= centres_in(turned, size)
            else:
                closed |= _covered(kind, turned, margin, size, source.touched)
    return closed, is_near


def _covered(
    kind: str, rings: list[np.ndarray], reach: float, size: Size, touched: bool
) -> np.ndarray:
    """(H, W) whether a cell is in reach [cells] of a shape, with a part or with its centre."""
    needs("geo", "no_fly with lines, circles, touched or buffer")
    import shapely

    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    coordinates = {places.POINT: rings[0][0], places.LINE: rings[0], places.POLYGON: rings}[kind]
    shape = shapely.make_valid(shapely.geometry.shape({"type": kind, "coordinates": coordinates}))
    edge = reach + 1  # what is further away has no effect
    shape = shapely.clip_by_rect(shape, -edge, -edge, size[0] + edge, size[1] + edge)
    if reach:
        shape = shape.buffer(reach)
    shapely.prepare(shape)
    if touched or (kind == places.LINE and not reach):
        cells = shapely.box(x, y, x + 1, y + 1)
        return shapely.intersects(shape, cells) & ~shapely.touches(shape, cells)
    return shapely.contains_xy(shape, x + 0.5, y + 0.5)


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
    for place in source.chosen(places.reader(path, places.READERS)(path).places):
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
