"""The ways of UAVs on the Earth: way points in degrees, their lengths, times and altitudes.

A flight keeps of its cells those where it turns or hovers. A way point lies in its cell, so a
straight way between two of them stays in the row or column of open cells that was simulated.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dess.analysis.flights.phases import Phase, Visit
from dess.physics.chart import Cell
from dess.physics.energy import PERCENT
from dess.physics.fleet import type_of
from dess.scenario.own_sea import Positions
from dess.scenario.projection import EARTH_RADIUS, Projection
from dess.scenario.scenario import Scenario

_EDGE = 1e-4  # of a cell, by which a place may be rounded off it [cells]
_DECIMALS = 7  # of degrees, as MAVLink has them: about 1 cm


class GeoPoint(NamedTuple):
    """A place on the Earth.

    Attributes:
        lon: Longitude from -180 to 180 [degrees].
        lat: Latitude [degrees].
    """

    lon: float
    lat: float

    @classmethod
    def of(cls, lon: float, lat: float) -> "GeoPoint":
        """A place, rounded as autopilots have it; longitudes may go on beyond 180 degrees."""
        wrapped = (lon + 180) % 360 - 180
        return cls(round(wrapped, _DECIMALS), round(lat, _DECIMALS))

    def distance_to(self, other: "GeoPoint") -> float:
        """The length of the shortest way to another place [m], on a sphere."""
        north = math.radians(other.lat - self.lat)
        east = math.radians(other.lon - self.lon)
        parallels = math.cos(math.radians(self.lat)) * math.cos(math.radians(other.lat))
        haversine = math.sin(north / 2) ** 2 + parallels * math.sin(east / 2) ** 2
        return 2 * EARTH_RADIUS * math.asin(min(math.sqrt(haversine), 1.0))


class WayPoint(NamedTuple):
    """A way point.

    Attributes:
        place: Where it is.
        seconds: How long the UAV hovers there [s].
        shift: How far it is from the middle of its cell [m].
    """

    place: GeoPoint
    seconds: float
    shift: float


class Moment(NamedTuple):
    """Where a UAV is at a time.

    Attributes:
        seconds: The time, from the start of the mission.
        place: Where it is.
        altitude: Above the places where UAVs stand [m].
    """

    seconds: float
    place: GeoPoint
    altitude: float


class Craft(NamedTuple):
    """How a UAV flies in a plan.

    Attributes:
        altitude: Its own altitude [m].
        speed: Ground speed [m/s].
        climb: Rate of climb and of descent [m/s].
        hovering: What hovering takes of the battery [%/s].
        climbing: What climbing takes of it [%/s].
    """

    altitude: float
    speed: float
    climb: float
    hovering: float
    climbing: float

    @classmethod
    def of(cls, scenario: Scenario, uav: int, altitude: float) -> "Craft":
        """That of a UAV of a scenario with a data sheet."""
        units = scenario.units
        assert units
        sheet = scenario.data_sheet
        slots_per_cell = type_of(scenario.fleet, uav).slots_per_cell
        speed = units.cell / units.slot / slots_per_cell
        climb = sheet.number("climb")
        hovering = scenario.consumption.slots[slots_per_cell - 1][-1] / PERCENT
        # A climb takes so much more than hovering in still air; in wind, hovering takes more.
        extra = (sheet.wing.climbing_power(climb) - 1) / sheet.wing.power(speed)
        return cls(
            altitude,
            round(speed, 6),
            climb,
            hovering / units.slot,
            (hovering + extra) / units.slot,
        )

    @property
    def vertical_seconds(self) -> float:
        """How long it climbs, and how long it descends."""
        return self.altitude / self.climb

    @property
    def vertical_battery(self) -> float:
        """What a climb and a descent, which counts as hovering, take of the battery [%]."""
        return self.vertical_seconds * (self.climbing + self.hovering)


@dataclass(frozen=True)
class Route:
    """The way of a flight.

    Attributes:
        phase: The flight in the simulation; None for a move between two places of a zone, which the
            simulation does not have.
        uav: The number of the UAV, from 0.
        craft: How it flies.
        start: When it begins, from the start of the mission [s].
        points: Its way points, from that of the take-off to that of the landing.
        simulated_seconds: How long it takes in the simulation.
        simulated_metres: How long its way is in the simulation.
        held: How long it waits in the air until the way is free [s].
    """

    phase: Phase | None
    uav: int
    craft: Craft
    start: float
    points: tuple[WayPoint, ...]
    simulated_seconds: float = 0.0
    simulated_metres: float = 0.0
    held: float = 0.0

    @cached_property
    def moments(self) -> tuple[Moment, ...]:
        """When the UAV is where: it climbs, flies at its altitude, and descends."""
        altitude = self.craft.altitude
        place = self.points[0].place
        time = self.start
        moments = [Moment(time, place, 0.0)]
        time += self.craft.vertical_seconds
        for point in self.points:
            time += place.distance_to(point.place) / self.craft.speed
            place = point.place
            moments.append(Moment(time, place, altitude))
            if point.seconds:
                time += point.seconds
                moments.append(Moment(time, place, altitude))
        moments.append(Moment(time + self.craft.vertical_seconds, place, 0.0))
        return tuple(moments)

    @property
    def end(self) -> float:
        """When it ends, from the start of the mission [s]."""
        return self.moments[-1].seconds

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return self.end - self.start

    @property
    def metres(self) -> float:
        """How long its way is, without climb and descent."""
        places = [point.place for point in self.points]
        return math.fsum(map(GeoPoint.distance_to, places, places[1:]))

    @property
    def shift(self) -> float:
        """The largest distance of a way point in the air from the middle of its cell [m]."""
        return max((point.shift for point in self.points[1:-1]), default=0.0)

    @property
    def ground_shift(self) -> float:
        """The larger distance of take-off and landing from the middles of their cells [m]."""
        return max(self.points[0].shift, self.points[-1].shift)

    @property
    def battery(self) -> float:
        """What it takes of the battery [%].

        A second of the way takes what it does in the simulation; climb, descent and waiting are
        added.
        """
        way = 0.0
        if self.phase:
            before, after = self.phase.battery
            seconds = self.seconds - 2 * self.craft.vertical_seconds - self.held
            way = (before - after) * seconds / self.simulated_seconds
        return way + self.craft.vertical_battery + self.craft.hovering * self.held


class SeaMap:
    """Where the cells of a sea with degrees are on the Earth."""

    def __init__(self, scenario: Scenario, positions: Positions):
        """Begin with what the scenario has in degrees besides its cells."""
        assert scenario.centre and scenario.units
        self.scenario = scenario
        self._units = scenario.units
        self._positions = positions
        self.projection = Projection(scenario.centre, scenario.size, scenario.cell_size)

    def place_at(self, x: float, y: float) -> GeoPoint:
        """A place on the grid [cells]."""
        [(lon, lat)] = self.projection.degrees(np.array([[x, y]], float))
        return GeoPoint.of(float(lon), float(lat))

    def middle_of(self, cell: Cell) -> GeoPoint:
        """The middle of a cell."""
        return self.place_at(cell[0] + 0.5, cell[1] + 0.5)

    def spots(self, places: Sequence[GeoPoint]) -> np.ndarray:
        """(N, 2) places on the grid [cells]."""
        return self.projection.cells(np.array(places, float).reshape(-1, 2))

    def place_of_zone(self, number: int) -> GeoPoint:
        """The place of a zone: where it was typed, or else the middle of its cells."""
        if number in self._positions.zones:
            return GeoPoint.of(*self._positions.zones[number])
        x, y, width, height = self.scenario.rectangles[number]
        return self.place_at(x + width / 2, y + height / 2)

    def zone_of(self, cell: Cell) -> int:
        """The number of the zone of a cell."""
        return int(self.scenario.chart.zones[cell[1], cell[0]])

    def in_zones(self, spots: np.ndarray) -> np.ndarray:
        """(N,) whether places on the grid [cells] are in a zone."""
        most = np.array(self.scenario.size) - 1
        x, y = np.clip(np.floor(spots).astype(int), 0, most).T
        return self.scenario.chart.zones[y, x] >= 0

    def metres_between(self, spots: np.ndarray, others: np.ndarray) -> np.ndarray:
        """(N, 2) the ways from places on the grid to others, to the east and to the north [m]."""
        degrees = self.projection.degrees(spots)
        others_in_degrees = self.projection.degrees(others)
        step = np.radians(others_in_degrees - degrees) * EARTH_RADIUS
        latitudes = np.radians((degrees[:, 1] + others_in_degrees[:, 1]) / 2)
        return step * np.stack([np.cos(latitudes), np.ones_like(latitudes)], axis=1)

    def begin_way(self, flight: Phase, place: GeoPoint) -> tuple[WayPoint, ...]:
        """The way of a flight from the place of its take-off to before the zone of its landing."""
        cells = [visit.cell for visit in flight.visits]
        first, last = self._ends_in_the_open(cells)
        return (
            *self._leave_zone(place, cells[0], cells[first]),
            *map(self._way_point, _turns_and_stops(flight.visits[first : last + 1])),
        )

    def end_way(self, flight: Phase, place: GeoPoint, hold: float) -> tuple[WayPoint, ...]:
        """The rest of a flight: it waits before the zone for a time [s], and lands at a place."""
        cells = [visit.cell for visit in flight.visits]
        _, last = self._ends_in_the_open(cells)
        points = [*reversed(self._leave_zone(place, cells[-1], cells[last]))]
        if hold:
            points.insert(0, WayPoint(self.middle_of(cells[last - 1]), hold, 0.0))
        return tuple(points)

    def _ends_in_the_open(self, cells: list[Cell]) -> tuple[int, int]:
        """The numbers of the last cell in the zone of the take-off, and of the first at the end."""
        first = self._last_in_zone(cells)
        last = len(cells) - 1 - self._last_in_zone(cells[::-1])
        return first, last

    def _last_in_zone(self, cells: list[Cell]) -> int:
        """The number of the cell from which a UAV leaves the zone where it has taken off."""
        zone = self.zone_of(cells[0])
        return next(n for n, cell in enumerate(cells) if self.zone_of(cell) != zone) - 1

    def _leave_zone(self, place: GeoPoint, cell: Cell, border: Cell) -> list[WayPoint]:
        """The take-off from a place, and the way to the middle of a cell at the zone's border."""
        points = [WayPoint(place, 0.0, place.distance_to(self.middle_of(cell)))]
        [spot] = self.spots([place])
        if np.abs(spot - border - 0.5).max() > 0.5 + _EDGE:
            points.append(WayPoint(self.middle_of(border), 0.0, 0.0))
        return points

    def _way_point(self, visit: Visit) -> WayPoint:
        """A way point: where a UAV hovers at a node, that of the node."""
        cell_middle = self.middle_of(visit.cell)
        place = cell_middle
        if visit.slots and visit.cell in self._positions.nodes:
            place = GeoPoint.of(*self._positions.nodes[visit.cell])
        seconds = round(visit.slots * self._units.slot, 3)
        return WayPoint(place, seconds, place.distance_to(cell_middle))


def _turns_and_stops(visits: Sequence[Visit]) -> Iterator[Visit]:
    """The cells between the first and the last where a UAV turns or hovers."""
    for before, visit, after in zip(visits, visits[1:], visits[2:], strict=False):
        turns = _step_between(before, visit) != _step_between(visit, after)
        if turns or visit.slots:
            yield visit


def _step_between(source: Visit, target: Visit) -> tuple[int, int]:
    return target.cell[0] - source.cell[0], target.cell[1] - source.cell[1]
