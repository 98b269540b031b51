"""A user's own sea: what the files and degrees of a scenario become on its grid.

nodes = "buoys.csv"     # in the TOML file of a scenario
no_fly = "land.geojson"
zone = {lon = 8.70, lat = 53.87, width = 4, height = 3}
"""

from collections.abc import Callable, Mapping, Sequence, Set
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import BaseModel, Field

from dess.base.errors import InputError, validated
from dess.physics.arrivals import MOST_AMOUNT, MOST_RATE
from dess.physics.chart import Cell, Rectangle
from dess.physics.section import Integer, Number, Strict
from dess.scenario.no_fly import NoFlyFile, no_fly_in, polygons_hold, zones_in
from dess.scenario.nodes import DATA, RATES, Amounts, NodesFile, NodesFound
from dess.scenario.projection import Projection

# What stands for a field in a scenario whose files are not read yet.
_UNREAD = {"nodes": [[0, 0]], "no_fly": [], "zone": [0, 0, 1, 1]}


class ZonePlace(Strict):
    """A charging zone about a place on the Earth."""

    lon: Number = Field(ge=-180, le=180, description="longitude of its middle [degrees]")
    lat: Number = Field(ge=-90, le=90, description="latitude of its middle [degrees]")
    width: Integer = Field(ge=1, description="cells from west to east")
    height: Integer = Field(ge=1, description="cells from north to south")


def unread(values: Mapping[str, Any]) -> dict[str, Any]:
    """The fields that name files or degrees, each with what stands for it."""
    files = {key: kind for key, kind in _UNREAD.items() if _is_named(values.get(key))}
    if _are_places(values.get("zones")):
        files["zones"] = []
    return files


def _is_named(value: Any) -> bool:
    """Whether a field, or an item of it, names a file or degrees."""
    items: Sequence[Any] = [value]
    if isinstance(value, list | tuple):
        items = value
    return any(isinstance(item, str | dict) for item in items)


def _are_places(zones: Any) -> bool:
    """Whether a further zone has degrees in the place of cells."""
    tables: Sequence[Any] = []
    if isinstance(zones, list | tuple):
        tables = zones
    return any(isinstance(table, dict) and isinstance(table.get("cells"), dict) for table in tables)


class Positions(NamedTuple):
    """The places of nodes and zones that a scenario has in degrees, besides their cells.

    Attributes:
        nodes: Longitude and latitude of the first node of a cell [degrees], by the cell; without
            those that lie in a no-fly polygon.
        zones: Longitude and latitude of the middle of a zone [degrees], by its number from 0.
    """

    nodes: Mapping[Cell, tuple[float, float]]
    zones: Mapping[int, tuple[float, float]]


class OwnSea(NamedTuple):
    """An own sea whose files are not read yet.

    Attributes:
        where: The name of its scenario, for messages.
        beside: The path of a file that a field names.
        grid: Its scenario with what ``unread`` says in the place of files and degrees.
        replaced: The fields, those of sections dotted, that replace those of its file.
    """

    where: str
    beside: Callable[[str, str], Path]
    grid: Any
    replaced: Set[str] = frozenset()

    def placed(self, values: Mapping[str, Any], of_nodes: Any) -> dict[str, Any]:
        """The fields that name files or degrees, as cells.

        Args:
            values: The fields of the scenario.
            of_nodes: What the scenario's file has for the nodes, which may be others in ``values``.

        Raises:
            InputError: If a file cannot be read, or does not fit.
        """
        nodes_found = None
        projection = None
        about = (self.grid.size, self.grid.cell_size)
        if _is_named(of_nodes):
            source = self._file(NodesFile, of_nodes, "nodes")
            nodes_found = NodesFound.read(self.beside("nodes", source.file), source)
            projection = nodes_found.projection(*about)
        if self.grid.centre:
            projection = Projection(self.grid.centre, *about)
        placed = self._zones(values, projection) | self._no_fly(values, projection)
        if projection:
            placed["centre"] = projection.centre
        if nodes_found and values["nodes"] is of_nodes:
            closed = np.zeros(self.grid.size[::-1], np.bool_)
            for x, y in placed.get("no_fly", self.grid.no_fly):
                closed[y : y + 1, x : x + 1] = True  # none for a cell that is refused later
            amounts = [
                kind for kind in self._amounts(nodes_found.source) if not self._replaces(kind)
            ]
            is_cell_fixed = self.grid.data_sheet.is_on
            size = self.grid.size
            placed |= nodes_found.fields(size, projection, closed, amounts, is_cell_fixed)
        return placed

    def positions(self, values: Mapping[str, Any], of_nodes: Any) -> Positions:
        """The places that its files and tables have in degrees; ``grid`` is the placed scenario.

        Args:
            values: The fields of the scenario, as for ``placed``.
            of_nodes: What the scenario's file has for the nodes, as for ``placed``.

        Raises:
            InputError: If a file cannot be read.
        """
        zones: dict[int, tuple[float, float]] = {}
        tables = [values.get("zone"), *(table["cells"] for table in values.get("zones") or ())]
        for number, table in enumerate(tables):
            if isinstance(table, dict):
                zones[number] = (float(table["lon"]), float(table["lat"]))
        nodes: dict[Cell, tuple[float, float]] = {}
        if _is_named(of_nodes) and values["nodes"] is of_nodes:
            nodes = self._node_positions(values, of_nodes)
        return Positions(nodes, zones)

    def _node_positions(
        self, values: Mapping[str, Any], of_nodes: Any
    ) -> dict[Cell, tuple[float, float]]:
        """Longitude and latitude of the first node of each cell, outside of no-fly polygons."""
        source = self._file(NodesFile, of_nodes, "nodes")
        nodes_found = NodesFound.read(self.beside("nodes", source.file), source)
        if not nodes_found.is_geographic:
            return {}
        projection = Projection(self.grid.centre, self.grid.size, self.grid.cell_size)
        spots = projection.cells(nodes_found.spots)
        is_closed = np.zeros(len(spots), np.bool_)
        for no_fly in self._no_fly_files(values):
            path = self.beside("no_fly", no_fly.file)
            is_closed |= polygons_hold(path, projection, no_fly, spots)
        positions: dict[Cell, tuple[float, float]] = {}
        taken = set()
        for (x, y), (lon, lat), closed in zip(spots, nodes_found.spots, is_closed, strict=True):
            cell = (int(np.floor(x)), int(np.floor(y)))
            if cell in self.grid.nodes and cell not in taken and not closed:
                positions[cell] = (float(lon), float(lat))
            taken.add(cell)
        return positions

    def _replaces(self, kind: Amounts) -> bool:
        """Whether a field that replaces those of the file says what its nodes have."""
        return not self.replaced.isdisjoint({kind.field, kind.for_all})

    def _amounts(self, source: NodesFile) -> list[Amounts]:
        """The rates and the data that a file may give to each node."""
        sheet, arrivals = self.grid.data_sheet, self.grid.arrivals
        rates = (source.rate, RATES)
        data = (source.data, DATA)
        if not sheet.is_on:
            low, high = self.grid.initial_data
            amount = None
            if low == high:
                amount = low
            most = (0, MOST_AMOUNT)
            rate = self.grid.arrival_rate
            has_rates = bool(arrivals.rates)
            has_data = bool(arrivals.initial)
            return [
                Amounts(
                    "arrivals.rates", *rates, "", (0, MOST_RATE), "arrival_rate", rate, has_rates
                ),
                Amounts("arrivals.initial", *data, "", most, "initial_data", amount, has_data),
            ]
        kinds = []
        for name, columns, missing in (("data_rate", rates, None), ("backlog", data, 0.0)):
            field = f"data_sheet.{name}"
            of_sheet = getattr(sheet, name)
            is_listed = isinstance(of_sheet, tuple)
            otherwise = missing if is_listed or not of_sheet else sheet.number(name)
            unit = sheet.extra(name)["units"]
            limits = sheet.extra(name)["limits"][0]
            kinds.append(Amounts(field, *columns, unit, limits, field, otherwise, is_listed))
        return kinds

    def _no_fly(self, values: Mapping[str, Any], projection: Projection | None) -> dict[str, Any]:
        """The no-fly cells, row by row."""
        sources = self._no_fly_files(values)
        if not sources:
            return {}
        closed = np.zeros(self.grid.size[::-1], np.bool_)
        for source in sources:
            path = self.beside("no_fly", source.file)
            closed |= no_fly_in(path, self.grid.size, projection, source, self.grid.altitude)
        return {"no_fly": [(x, y) for y, x in np.argwhere(closed).tolist()]}

    def _no_fly_files(self, values: Mapping[str, Any]) -> list[NoFlyFile]:
        """The files of no-fly cells that the scenario names."""
        tables = values.get("no_fly")
        if not _is_named(tables):
            return []
        if not isinstance(tables, list):
            tables = [tables]
        return [self._file(NoFlyFile, table, "no_fly") for table in tables]

    def _zones(self, values: Mapping[str, Any], projection: Projection | None) -> dict[str, Any]:
        """The charging zones."""
        zone = values.get("zone")
        zones = values.get("zones")
        if isinstance(zone, str):
            zone, *others = zones_in(self.beside("zone", zone), self.grid.size)
            zones = zones or [{"cells": cells} for cells in others]
        elif isinstance(zone, dict):
            zone = self._rectangle(zone, "zone", projection)
        if zones and _are_places(zones):
            zones = [*zones]
            for n, table in enumerate(zones):
                if _are_places([table]):
                    cells = self._rectangle(table["cells"], f"zones.{n}.cells", projection)
                    zones[n] = table | {"cells": cells}
        return {key: table for key, table in (("zone", zone), ("zones", zones)) if table}

    def _rectangle(self, of: Any, key: str, projection: Projection | None) -> Rectangle:
        """The cells of a charging zone about a place."""
        where = f"{self.where}: {key}"
        place = validated(ZonePlace, of, where)
        if projection is None:
            allowed = "[x, y, width, height], nodes from a file with degrees, or centre"
            raise InputError(where, "has degrees, and the nodes are cells", allowed)
        [centre] = projection.cells(np.array([[place.lon, place.lat]]))
        x, y = np.round(centre - np.array([place.width, place.height]) / 2).astype(int).tolist()
        return x, y, place.width, place.height

    def _file(self, model: type[BaseModel], of: Any, key: str) -> Any:
        """A file that a field names, by its name or in a table."""
        if isinstance(of, str):
            of = {"file": of}
        return validated(model, of, f"{self.where}: {key}")
