"""Read the no-fly cells of a user's own sea, such as islands, from a map, CSV or GeoJSON file.

    no_fly = "islands.txt"  # in the TOML file of a scenario: a file in the same folder

A map (``.txt``) has a line for each row of cells, from north to south: ``#`` is a no-fly cell and
``.`` an open one. A CSV file has cells or degrees (``dess.sea.positions``). A GeoJSON file has
Polygon and MultiPolygon features: a cell is a no-fly cell if its centre lies in one of them, and
not in a hole. Degrees are projected as those of the nodes are (``dess.sea.positions``).
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field

from dess.errors import InputError, shown
from dess.files.documents import Document
from dess.files.reading import read_text
from dess.sea.chart import Cell
from dess.sea.positions import LIMIT, OnEarth, Projection, csv_positions

_ALLOWED = "a GeoJSON FeatureCollection of polygons"


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


class _Feature(Document, extra="ignore"):
    geometry: Annotated[_Polygon | _MultiPolygon, Field(discriminator="type")] = Field(
        description="a Polygon or MultiPolygon"
    )


class _Collection(Document, extra="ignore"):
    features: tuple[_Feature, ...] = Field(min_length=1, description=_ALLOWED)


def no_fly_in(path: Path, size: tuple[int, int], projection: Projection | None) -> tuple[Cell, ...]:
    """The no-fly cells in a file, row by row.

    Args:
        path: A file ``.txt``, ``.csv``, ``.geojson`` or ``.json``.
        size: Cells of the grid from west to east and from north to south.
        projection: That of the nodes, none if they are cells.

    Raises:
        InputError: If the file cannot be read, a map has another size, a place or a whole feature
            is off the grid, or the file has degrees and the nodes are cells.
    """
    readers = {".txt": _of_map, ".csv": _of_csv, ".geojson": _of_geojson, ".json": _of_geojson}
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: has no known file ending; allowed: {', '.join(readers)}")
    closed = readers[path.suffix.lower()](path, size, projection)
    return tuple((int(x), int(y)) for y, x in np.argwhere(closed))


def _of_map(path: Path, size: tuple[int, int], _: Projection | None) -> np.ndarray:
    """(H, W) whether a cell is a no-fly cell."""
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


def _of_csv(path: Path, size: tuple[int, int], projection: Projection | None) -> np.ndarray:
    is_geographic, names, places = csv_positions(path)
    if not names:
        raise InputError(f"{path}: has no places; allowed: one or more")
    if is_geographic:
        places = _of_nodes(path, projection).cells(places)
    cells, closed = np.floor(places).astype(int), np.zeros(size[::-1], np.bool_)
    for name, (x, y) in zip(names, cells.tolist(), strict=True):
        if not (0 <= x < size[0] and 0 <= y < size[1]):
            line, allowed = _off(name, (x, y), size), f"0 <= x < {size[0]}, 0 <= y < {size[1]}"
            raise InputError(f"{path}: {line}; allowed: {allowed}")
        closed[y, x] = True
    return closed


def _of_geojson(path: Path, size: tuple[int, int], projection: Projection | None) -> np.ndarray:
    projected, closed = _of_nodes(path, projection), np.zeros(size[::-1], np.bool_)
    for number, feature in enumerate(_Collection.load(path, absent=_ALLOWED, limit=LIMIT).features):
        polygons = [[projected.cells(ring) for ring in rings] for rings in _rings(feature)]
        if not any(_meets_grid(rings[0], size) for rings in polygons):
            corner = np.floor(polygons[0][0][0]).astype(int).tolist()
            line = _off(f"features.{number}", corner, size)
            raise InputError(f"{path}: {line}; allowed: polygons with a part on the grid")
        for rings in polygons:
            closed |= centres_in(rings, size)
    return closed


def _of_nodes(path: Path, projection: Projection | None) -> Projection:
    if projection is None:
        raise InputError(
            f"{path}: has degrees, and the nodes are cells; allowed: cells, or nodes from a file "
            "with degrees"
        )
    return projection


def _rings(feature: _Feature) -> Iterator[list[np.ndarray]]:
    """The rings of each polygon of a feature, (K, 2) degrees each."""
    geometry = feature.geometry
    polygons = [geometry.coordinates] if geometry.type == "Polygon" else geometry.coordinates
    for rings in polygons:
        yield [np.array([position[:2] for position in ring]) for ring in rings]


def _meets_grid(ring: np.ndarray, size: tuple[int, int]) -> bool:
    """Whether the bounding box of a ring has a part on the grid."""
    return bool((ring.max(0) > 0).all() and (ring.min(0) < size).all())


def _off(name: str, cell: Iterable[int], size: tuple[int, int]) -> str:
    return f"{name} is off the grid of {size[0]} x {size[1]} cells, at {[*cell]}"


def centres_in(rings: list[np.ndarray], size: tuple[int, int]) -> np.ndarray:
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
