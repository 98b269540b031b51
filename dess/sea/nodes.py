"""Read the sensor nodes of a user's own sea from a CSV or GeoJSON file.

    nodes = "buoys.csv"  # in the TOML file of a scenario: a file in the same folder

A CSV file has cells or degrees (``dess.sea.positions``), a GeoJSON file Point features. Degrees are
projected about the centre of their bounding box (``dess.sea.positions``).
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from dess.errors import InputError
from dess.files.documents import Document
from dess.sea.chart import Cell
from dess.sea.positions import LIMIT, OnEarth, Positions, Projection, csv_positions

MAX_NODES, MAX_GRID = 1024, 256  # as of a scenario

_ALLOWED = "a GeoJSON FeatureCollection of points"


class _Point(Document, extra="ignore"):
    type: Literal["Point"]
    coordinates: OnEarth


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
    is_geographic, names, positions = _positions(path)
    if is_geographic:
        positions = Projection.about(positions, size, cell_size).cells(positions)
    cells = [(int(x), int(y)) for x, y in np.floor(positions)]
    known: dict[Cell, str] = {}
    for name, cell in zip(names, cells, strict=True):
        if min(cell) < 0 or cell[0] >= size[0] or cell[1] >= size[1]:
            line = f"{name} is off the grid of {size[0]} x {size[1]} cells, at {[*cell]}"
            raise InputError(f"{path}: {line}; allowed: {_enough(cells, size, is_geographic)}")
        if cell in known:
            smaller = f"a cell_size below {cell_size:g} m" if is_geographic else "distinct cells"
            shared = f"{known[cell]} and {name} lie in one cell, {[*cell]}"
            raise InputError(f"{path}: {shared}; allowed: {smaller}")
        known[cell] = name
    return tuple(cells)


def projection_in(path: Path, size: tuple[int, int], cell_size: float) -> Projection | None:
    """The projection of the nodes in a file, none if they are cells; arguments as ``nodes_in``."""
    is_geographic, _, positions = _positions(path)
    return Projection.about(positions, size, cell_size) if is_geographic else None


def _positions(path: Path) -> Positions:
    readers = {".csv": csv_positions, ".geojson": _of_geojson, ".json": _of_geojson}
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: has no known file ending; allowed: {', '.join(readers)}")
    found = readers[path.suffix.lower()](path)
    if not 0 < len(found.names) <= MAX_NODES:
        raise InputError(f"{path}: has {len(found.names):,} nodes; allowed: 1..{MAX_NODES}")
    return found


def _of_geojson(path: Path) -> Positions:
    features = _Collection.load(path, absent=_ALLOWED, limit=LIMIT).features
    places = [feature.geometry.coordinates[:2] for feature in features]
    names = [f"features.{number}" for number in range(len(places))]
    return Positions(True, names, np.reshape(places, (-1, 2)))


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
