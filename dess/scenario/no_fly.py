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
from collections.abc import Callable
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
from dess.scenario.extents import MOST_METRES, lies_elsewhere, radii_of, radius_of, unread_names
from dess.scenario.notes import tell
from dess.scenario.places import Place
from dess.scenario.polygons import border_within, centres_in, lie_in
from dess.scenario.projection import Projection, Size, is_on_grid
from dess.scenario.readers import read_places

# The letters of maps, those of the MAPF benchmark among them: trees and water are closed.
CLOSED, FREE = "#@OTW", ".GS"
_MAPF = CLOSED[1:] + FREE
# How far beyond itself a point or a line touches a cell [cells]: it may lie on an edge, which the
# rounding of a projection puts on either side.
_HAIR = 1e-6

_REMEDY = "touched = true closes all cells that they touch"


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
        path: A file ``.txt``, ``.map``, ``.png``, or one that ``readers.read_places`` reads.
        size: Cells of the grid from west to east and from north to south.
        projection: That of the sea, none if the nodes are cells.
        source: What is taken of the file.
        altitude: That of the UAVs [m]; a note tells of zones that begin above it.

    Raises:
        InputError: If the file cannot be read, a map has another size, ``where`` takes no place, a
            cell is off the grid, or the file has degrees and the nodes are cells.
    """
    read = _MAPS.get(path.suffix.lower(), _of_places)
    return read(path, size, projection, source, altitude)


def zones_in(path: Path, size: Size) -> list[Rectangle]:
    """The charging zones of a map in a picture: its blue rectangles, from north to south.

    Raises:
        InputError: If the file cannot be read or has another size, or a zone is no rectangle.
    """
    from scipy import ndimage

    if path.suffix.lower() != ".png":
        raise InputError(path, "has no known file ending", ".png")
    pixels = _pixels(path, size)
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
    is_geographic, features = read_places(path, _MAPS)
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
    if any(radii_of(place) for place in chosen):
        _note(f"{path}: the column radius is not used, since its places are cells and no degrees")
    closed = np.zeros(size[::-1], np.bool_)
    for place in chosen:
        x, y = place.shapes[0][1][0][0].astype(int)
        if not is_on_grid((x, y), size):
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
        cells, is_near = _cells_of(place, projection, source, radius_of(place, path))
        if is_near and not cells.any():
            unseen.append(place.where)
        if cells.any() and lies_elsewhere(place, altitude):
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
    unread = {name for place in chosen for name in unread_names(place)}
    if unread:
        _note(f"{path}: {listed(sorted(unread))} of its places is not read; width and buffer are")
    return closed


def _note(line: str) -> None:
    tell(f"no_fly: {line}")


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
            is_near |= len(turned) == 1 or len(border_within(turned, size)) > 0
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
            x, y = border_within(turned, projection.size).T
            if not beside[y, x].all():
                return True
    return False


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
    if path.suffix.lower() in _MAPS:
        return is_held
    for place in source.chosen(read_places(path).places, path):
        for kind, rings in place.shapes:
            for turned in projection.shapes(rings) if kind == places.POLYGON else ():
                is_held |= lie_in(turned, spots)
    return is_held


_MAPS: dict[str, Callable[..., np.ndarray]] = {
    ".txt": _of_text,
    ".map": _of_text,
    ".png": _of_picture,
}
