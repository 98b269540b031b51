"""The sensor nodes of a user's own sea, read from a file beside its scenario.

    nodes = "buoys.csv"     # in the TOML file of a scenario
    nodes = {file = "platforms.geojson", where = {Country = "DK*"}, place = "merge"}

A CSV file has places, as cells (``x``, ``y``) or degrees (``lon``, ``lat``); of a GeoJSON file the
points are taken.
"""

from collections.abc import Callable, Sequence
from functools import partial
from math import fsum
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field

from dess.base.errors import InputError, listed, shown, unknown_name
from dess.physics.chart import Cell
from dess.scenario import places
from dess.scenario.places import Place
from dess.scenario.projection import Projection, Size, is_on_grid
from dess.scenario.quantities import form_of, quantity_of
from dess.scenario.readers import read_places
from dess.scenario.readers.table import amount_of

MAX_NODES, MAX_GRID = 1024, 256  # as of a scenario
# What columns are called that are used without being asked for, whatever the case.
NAMES = ("name", "label", "id")
RATES = ("rate", "arrival_rate", "data_rate")
DATA = ("data", "initial_data", "backlog")

# The fields of a scenario that a file may give to each of its nodes.
AMOUNTS = ("data_sheet.data_rate", "data_sheet.backlog", "arrivals.rates", "arrivals.initial")


class Amounts(NamedTuple):
    """Amounts that a file may give to each of its nodes, and what the scenario has for all.

    Attributes:
        field: The field of the scenario with an amount per node.
        asked: The column that the scenario names for them; empty if it names none.
        known: What else the column may be called, whatever the case.
        unit: Their unit, of ``quantities.KINDS``; empty for plain numbers.
        limits: The least and the largest amount in this unit.
        for_all: The field of the scenario that has one amount for all nodes.
        otherwise: This amount in the unit, for nodes whose field is empty; None if there is none.
        is_listed: Whether the scenario has a list of them, beside which a file has none.
    """

    field: str
    asked: str
    known: tuple[str, ...]
    unit: str
    limits: tuple[float, float]
    for_all: str
    otherwise: float | None
    is_listed: bool


class NodesFile(places.Source):
    """A file of nodes, and how they are taken from it."""

    place: Literal["own", "merge", "nearest"] = Field(
        "own",
        description="where nodes of one cell are placed: own refuses them, merge adds their data "
        "and rates, nearest moves a node whose cell is taken or closed to the nearest free one",
    )
    name: str = Field("", description="the column of their names")
    rate: str = Field("", description="the column of their arrival rates")
    data: str = Field("", description="the column of their initial data")


class NodesFound(NamedTuple):
    """The nodes of a file, before they are placed.

    Attributes:
        path: The file.
        source: How they are taken from it.
        is_geographic: Whether their places are degrees, and not cells.
        rows: Where each stands in the file, with its properties.
        spots: (K, 2) degrees or cells.
    """

    path: Path
    source: NodesFile
    is_geographic: bool
    rows: list[Place]
    spots: np.ndarray

    @classmethod
    def read(cls, path: Path, source: NodesFile) -> Self:
        """The nodes of a file, in its order.

        Raises:
            InputError: If the file cannot be read or has no nodes.
        """
        is_geographic, features = read_places(path)
        points = [
            (place, ring[0])
            for place in source.chosen(features, path)
            for kind, (ring, *_) in place.shapes
            if kind == places.POINT
        ]
        if not points:
            raise InputError(path, "has 0 nodes", f"1..{MAX_NODES}")
        rows, spots = zip(*points, strict=True)
        return cls(path, source, is_geographic, [*rows], np.array(spots))

    def projection(self, size: Size, cell_size: float) -> Projection | None:
        """The projection about these places; none if they are cells."""
        if self.is_geographic:
            return Projection.about(self.spots, size, cell_size)
        return None

    def fields(
        self,
        size: Size,
        projection: Projection | None,
        closed: Any,
        amounts: Sequence[Amounts] = (),
        is_cell_fixed: bool = False,
    ) -> dict[str, Any]:
        """The fields of a scenario that these nodes have on a grid, those of ``arrivals`` dotted.

        Args:
            size: Cells of the grid from west to east and from north to south.
            projection: That of the sea.
            closed: (H, W) whether a cell is a no-fly cell.
            amounts: What the file may give to each node.
            is_cell_fixed: Whether the cell size follows from a data sheet, so that no message may
                advise another one.

        Raises:
            InputError: If a node is off the grid, two share a cell, or an amount is none.
        """
        spots = self.spots + 0.5
        if projection and self.is_geographic:
            spots = projection.cells(self.spots)
        cells_of_rows: list[Cell] = [(int(x), int(y)) for x, y in np.floor(spots)]
        self._check_on_grid(cells_of_rows, size, is_cell_fixed)
        moved: list[int] = []
        if self.source.place == "nearest":
            cells_of_rows, moved = _nearest_free(cells_of_rows, spots, closed)
        groups: dict[Cell, list[int]] = {}
        for number, cell in enumerate(cells_of_rows):
            groups.setdefault(cell, []).append(number)
        if self.source.place == "own" and len(groups) < len(cells_of_rows):
            self._refuse_shared(groups, projection, is_cell_fixed)
        if len(groups) > MAX_NODES:
            raise InputError(self.path, f"has {len(groups):,} nodes", f"1..{MAX_NODES}")
        names = [*map(self._name, range(len(cells_of_rows)))]
        members = [*groups.values()]
        arrivals = {
            "nodes": [*groups],
            "moved": moved,
            "names": [_joined([names[n] for n in group]) for group in members if any(names)],
            "arrivals.merged": [
                len(group) for group in members if len(groups) < len(cells_of_rows)
            ],
        }
        for kind in amounts:
            arrivals[kind.field] = self._sums(members, kind)
        return {field: values for field, values in arrivals.items() if values}

    def has_amounts(self, known: Sequence[str]) -> bool:
        """Whether every node has one in a column of these names."""
        return all(row.property("", known) is not None for row in self.rows)

    def _name(self, number: int) -> str:
        return str(self.rows[number].property(self.source.name, NAMES) or "")

    def _sums(self, groups: list[list[int]], kind: Amounts) -> list[Any]:
        """The sums of amounts over groups of nodes; none if the file has no such column."""
        column = self._column(kind)
        if not column:
            return []
        if kind.is_listed:
            both = f"the scenario lists {kind.field}"
            raise InputError(self.path, f"has the column {column}, and {both}", "one")
        values = [self._amount(row, column, kind) for row in self.rows]
        sums = [fsum(values[number] for number in group) for group in groups]
        if kind.unit:
            return [f"{total!r} {kind.unit}" for total in sums]
        return sums

    def _column(self, kind: Amounts) -> str:
        """The column of amounts, as the file calls it; empty if it has none that is filled."""
        columns = {str(name) for row in self.rows for name in row.properties}
        filled = [name for name in sorted(columns) if self._is_filled(name)]
        if kind.asked:
            if kind.asked not in columns:
                raise unknown_name(self.path, f"has no {kind.asked}", kind.asked, columns)
            if kind.asked in filled:
                return kind.asked
            return ""
        matching = [name for name in filled if name.lower() in kind.known]
        if len({name.lower() for name in matching}) > 1:
            both = f"the columns {' and '.join(matching)}"
            raise InputError(self.path, f"has {both} for one field", "one of them")
        if matching:
            return matching[0]
        return ""

    def _is_filled(self, column: str) -> bool:
        return any(row.property("", [column.lower()]) is not None for row in self.rows)

    def _amount(self, row: Place, column: str, kind: Amounts) -> float:
        """What a node has in a column or, if its field is empty, what the scenario has for all."""
        where = f"{self.path}: {row.where}: {column}"
        text = row.property("", [column.lower()])
        if text is not None:
            read: Callable[[str, str], float]
            read = amount_of
            if kind.unit:
                read = partial(quantity_of, unit=kind.unit)
            amount = read(str(text), where)
            least, most = kind.limits
            if not least <= amount <= most:
                limits = f"{least:g}..{most:g} {kind.unit}".rstrip()
                raise InputError(where, f"{shown(text)} is out of range", limits)
            return amount
        if kind.otherwise is None:
            allowed = "a number"
            if kind.unit:
                allowed = form_of(kind.unit)
            raise InputError(where, "is empty", f"{allowed}, or one in {kind.for_all}")
        return kind.otherwise

    def _title(self, number: int) -> str:
        """Where a node stands in the file, and its name."""
        name = self._name(number)
        where = self.rows[number].where
        if name:
            return f"{where} ({name})"
        return where

    def _check_on_grid(self, own: list[Cell], size: Size, is_cell_fixed: bool) -> None:
        beyond = [number for number, cell in enumerate(own) if not is_on_grid(cell, size)]
        if beyond:
            names = listed(f"{self._title(number)} at {[*own[number]]}" for number in beyond)
            verb = "is"
            if beyond[1:]:
                verb = "are"
            enough = _enough(own, size, self.is_geographic, is_cell_fixed)
            line = f"{names} {verb} off the grid of {size[0]} x {size[1]} cells"
            raise InputError(self.path, line, enough)

    def _refuse_shared(
        self, groups: dict[Cell, list[int]], projection: Projection | None, is_cell_fixed: bool
    ) -> None:
        """Say which nodes share cells, and what would part them."""
        cells = listed(
            f"{' and '.join(map(self._title, group))} lie in one cell, {[*cell]}"
            for cell, group in groups.items()
            if len(group) > 1
        )
        parted = "distinct cells, "
        if projection:
            parted = "" if is_cell_fixed else self._finer(projection)
        ways_out = 'place = "merge", place = "nearest" beside the file'
        raise InputError(self.path, cells, f"{parted}{ways_out}")

    def _finer(self, projection: Projection) -> str:
        """The smallest cells that the largest grid allows, if they part all nodes."""
        coarse = projection.cell_size
        largest = (MAX_GRID, MAX_GRID)
        reach = np.abs(projection.cells(self.spots) - np.array(projection.size) / 2).max()
        finest = float(f"{max(coarse * reach / (MAX_GRID / 2 - 2), 0.01):.2g}")
        cells = np.floor(projection._replace(size=largest, cell_size=finest).cells(self.spots))
        if finest >= coarse or len(np.unique(cells, axis=0)) < len(cells):
            return ""
        return f"a cell_size below {coarse:g} m, such as {finest:g} with grid = {MAX_GRID}, "


def _joined(names: list[str]) -> str:
    """The name of a node that stands for several."""
    if len(names) == 1:
        return names[0]
    return f"{names[0]} +{len(names) - 1}"


def _nearest_free(
    own: list[Cell], spots: np.ndarray, closed: np.ndarray
) -> tuple[list[Cell], list[int]]:
    """The cells of nodes, each of its own, and the numbers of those that have moved.

    The first node in a cell that is open stays there; then the others choose, in their order.
    """
    is_free = ~closed
    cells = [*own]
    moved = []
    for number, (x, y) in enumerate(own):
        if not is_free[y, x]:
            moved.append(number)
        is_free[y, x] = False
    for number in moved:
        free = np.argwhere(is_free)[:, ::-1]
        if not len(free):
            raise InputError("nodes", "there are more than open cells", "a larger grid")
        across = free + 0.5 - spots[number]
        x, y = free[(across * across).sum(1).argmin()].tolist()
        cells[number] = (x, y)
        is_free[y, x] = False
    return cells, moved


def _enough(cells: list[Cell], size: Size, is_geographic: bool, is_cell_fixed: bool) -> str:
    """What would be allowed, such as a grid that is large enough, where cells are off the grid."""
    sides = np.array(cells).T
    beyond = [max(-side.min(), side.max() - n + 1, 0) for side, n in zip(sides, size, strict=True)]
    needed = [n + b * (1 + is_geographic) for n, b in zip(size, beyond, strict=True)]
    if size[0] == size[1]:
        needed = [max(needed)] * 2
    coarser = "a larger cell_size"
    if is_cell_fixed:
        coarser = "UAVs that fly further in a slot"
    if max(needed) > MAX_GRID or (not is_geographic and min(map(min, cells)) < 0):
        if is_geographic:
            return coarser
        return f"0 <= x, y < {MAX_GRID}"
    enough = f"grid = {needed[0]}" + (f", rows = {needed[1]}" if needed[0] != needed[1] else "")
    return f"{enough} or more" + (f", or {coarser}" if is_geographic else "")
