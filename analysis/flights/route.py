"""The ways of UAVs on the Earth: way points in degrees, their lengths and times, and who is near.

A flight keeps of its cells those where it turns or hovers. A way point lies in its cell, so a
straight way between two of them stays in the row or column of open cells that was simulated.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from dess.analysis.flights.phases import Phase, Visit
from dess.physics.chart import Cell
from dess.physics.fleet import type_of
from dess.scenario.own_sea import Positions
from dess.scenario.places import EARTH_RADIUS, Projection
from dess.scenario.scenario import Scenario

CLEARANCE = 5.0  # by which each UAV flies higher than the one before it [m]
_DECIMALS = 7  # of degrees, as MAVLink has them: about 1 cm


class Place(NamedTuple):
    """A place on the Earth.

    Attributes:
        lon: Longitude from -180 to 180 [degrees].
        lat: Latitude [degrees].
    """

    lon: float
    lat: float

    @classmethod
    def of(cls, lon: float, lat: float) -> "Place":
        """A place, rounded as autopilots have it; longitudes may go on beyond 180 degrees."""
        wrapped = (lon + 180) % 360 - 180
        return cls(round(wrapped, _DECIMALS), round(lat, _DECIMALS))

    def distance_to(self, other: "Place") -> float:
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

    place: Place
    seconds: float
    shift: float


@dataclass(frozen=True)
class Route:
    """The way of a flight.

    Attributes:
        phase: The flight in the simulation.
        start: When it begins, from the start of the mission [s].
        simulated_seconds: How long it takes in the simulation.
        simulated_metres: How long its way is in the simulation.
        speed: Ground speed [m/s].
        altitude: Above the place of the take-off [m].
        points: Its way points, from that of the take-off to that of the landing.
    """

    phase: Phase
    start: float
    simulated_seconds: float
    simulated_metres: float
    speed: float
    altitude: float
    points: tuple[WayPoint, ...]

    @cached_property
    def times(self) -> tuple[tuple[float, Place], ...]:
        """When the UAV is where [s]: it arrives at each way point, and departs from it."""
        time = self.start
        times = []
        before = self.points[0].place
        for point in self.points:
            time += before.distance_to(point.place) / self.speed
            times.append((time, point.place))
            if point.seconds:
                time += point.seconds
                times.append((time, point.place))
            before = point.place
        return tuple(times)

    @property
    def end(self) -> float:
        """When it ends, from the start of the mission [s]."""
        return self.times[-1][0]

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return self.end - self.start

    @property
    def metres(self) -> float:
        """How long its way is."""
        places = [point.place for point in self.points]
        return math.fsum(map(Place.distance_to, places, places[1:]))

    @property
    def shift(self) -> float:
        """The largest distance of a way point in the air from the middle of its cell [m]."""
        return max((point.shift for point in self.points[1:-1]), default=0.0)

    @property
    def ground_shift(self) -> float:
        """The larger distance of take-off and landing from the middles of their cells [m]."""
        return max(self.points[0].shift, self.points[-1].shift)

    @property
    def battery_end(self) -> float:
        """The battery at the landing, if the whole way costs as much as in the simulation [%]."""
        first, last = self.phase.battery
        return first - (first - last) * self.seconds / self.simulated_seconds


class Approach(NamedTuple):
    """How near two UAVs are at a time.

    Attributes:
        metres: Their distance.
        seconds: The time, from the start of the mission.
        routes: Their flights.
    """

    metres: float
    seconds: float
    routes: tuple[Route, Route]


class SeaMap:
    """Where the cells of a sea with degrees are on the Earth."""

    def __init__(self, scenario: Scenario, positions: Positions):
        """Begin with what the scenario has in degrees besides its cells."""
        assert scenario.centre and scenario.units
        self.scenario = scenario
        self._units = scenario.units
        self._positions = positions
        self.projection = Projection(scenario.centre, scenario.size, scenario.cell_size)

    @property
    def bases(self) -> set[int]:
        """The numbers of the zones that are one place, since they were typed in degrees."""
        return {*self._positions.zones}

    def place_at(self, x: float, y: float) -> Place:
        """A place on the grid [cells]."""
        [(lon, lat)] = self.projection.degrees(np.array([[x, y]], float))
        return Place.of(float(lon), float(lat))

    def middle_of(self, cell: Cell) -> Place:
        """The middle of a cell."""
        return self.place_at(cell[0] + 0.5, cell[1] + 0.5)

    def place_of_zone(self, number: int) -> Place:
        """The place of a zone: where it was typed, or else the middle of its cells."""
        if number in self._positions.zones:
            return Place.of(*self._positions.zones[number])
        x, y, width, height = self.scenario.rectangles[number]
        return self.place_at(x + width / 2, y + height / 2)

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

    def place_on_ground(self, cell: Cell) -> Place:
        """Where a UAV stands that is in a cell of a zone."""
        number = self._zone_of(cell)
        if number in self.bases:
            return self.place_of_zone(number)
        return self.middle_of(cell)

    def plan_route(self, flight: Phase) -> Route:
        """The way of a flight."""
        kind = type_of(self.scenario.fleet, flight.uav)
        cells = [visit.cell for visit in flight.visits]
        first = self._last_in_base(cells)
        last = len(cells) - 1 - self._last_in_base(cells[::-1])
        way = flight.visits[first : last + 1]
        points = [
            *self._leave_ground(cells[0], cells[first]),
            *map(self._way_point, _turns_and_stops(way)),
            *reversed(self._leave_ground(cells[-1], cells[last])),
        ]
        return Route(
            flight,
            flight.start * self._units.slot,
            (flight.end - flight.start) * self._units.slot,
            flight.moves * self.scenario.cell_size,
            round(self._units.cell / self._units.slot / kind.slots_per_cell, 6),
            self.scenario.altitude + CLEARANCE * flight.uav,
            tuple(points),
        )

    def _zone_of(self, cell: Cell) -> int:
        return int(self.scenario.chart.zones[cell[1], cell[0]])

    def _last_in_base(self, cells: list[Cell]) -> int:
        """The number of the cell from which a UAV leaves the base where it has taken off."""
        base = self._zone_of(cells[0])
        if base not in self.bases:
            return 0
        return next(n for n, cell in enumerate(cells) if self._zone_of(cell) != base) - 1

    def _leave_ground(self, cell: Cell, border: Cell) -> list[WayPoint]:
        """The take-off from a cell, and the way to the middle of a cell at the zone's border."""
        place = self.place_on_ground(cell)
        points = [WayPoint(place, 0.0, place.distance_to(self.middle_of(cell)))]
        [spot] = self.projection.cells(np.array([place]))
        if tuple(np.floor(spot)) != border:
            points.append(WayPoint(self.middle_of(border), 0.0, 0.0))
        return points

    def _way_point(self, visit: Visit) -> WayPoint:
        """A way point: where a UAV hovers at a node, that of the node."""
        cell_middle = self.middle_of(visit.cell)
        place = cell_middle
        if visit.slots and visit.cell in self._positions.nodes:
            place = Place.of(*self._positions.nodes[visit.cell])
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


def closest_approach(
    routes: Iterable[Route], sea: SeaMap, outside_zones: bool = False
) -> Approach | None:
    """When two UAVs in flight are nearest to each other; None if no two are.

    Each flies at its own altitude from its take-off to its landing; climbs are left out.

    Args:
        routes: The flights of all UAVs.
        sea: Where they are.
        outside_zones: Whether only the time counts in which both UAVs are outside of all zones.
    """
    nearest: Approach | None = None
    tracks = [_Track.of(route, sea) for route in routes]
    for pair in combinations(tracks, 2):
        if pair[0].route.phase.uav == pair[1].route.phase.uav:
            continue
        approach = _find_approach(*pair, outside_zones)
        if approach and (nearest is None or approach.metres < nearest.metres):
            nearest = approach
    return nearest


class _Track(NamedTuple):
    """Where a UAV is at some times of a flight.

    Attributes:
        route: The flight.
        times: (T,) [s].
        spots: (T, 2) places on the grid [cells].
        sea: Where this is.
    """

    route: Route
    times: np.ndarray
    spots: np.ndarray
    sea: SeaMap

    @classmethod
    def of(cls, route: Route, sea: SeaMap) -> "_Track":
        times, places = zip(*route.times, strict=True)
        return cls(route, np.array(times), sea.projection.cells(np.array(places)), sea)

    def spots_at(self, times: np.ndarray) -> np.ndarray:
        """(N, 2) places on the grid at N times."""
        axes = [np.interp(times, self.times, axis) for axis in self.spots.T]
        return np.stack(axes, axis=1)


def _find_approach(track: _Track, other: _Track, outside_zones: bool) -> Approach | None:
    """When two UAVs are nearest to each other in the time in which both fly."""
    start = max(track.times[0], other.times[0])
    end = min(track.times[-1], other.times[-1])
    if start > end:
        return None
    sea = track.sea
    # Fine enough to say for each part whether it lies in a zone.
    count = 2 + int((end - start) * track.route.speed / sea.scenario.cell_size * 4)
    joined = np.concatenate([track.times, other.times, np.linspace(start, end, count)])
    times = np.unique(np.clip(joined, start, end))
    if len(times) == 1:
        times = np.repeat(times, 2)
    spots = track.spots_at(times)
    others = other.spots_at(times)
    away = sea.metres_between(spots, others)
    step = np.diff(away, axis=0)
    length = (step * step).sum(axis=1)
    towards = -(away[:-1] * step).sum(axis=1)
    shares = np.clip(np.divide(towards, length, out=np.zeros_like(length), where=length > 0), 0, 1)
    across = np.linalg.norm(away[:-1] + shares[:, None] * step, axis=1)
    distances = np.hypot(across, track.route.altitude - other.route.altitude)
    if outside_zones:
        in_zone = sea.in_zones(spots) | sea.in_zones(others)
        distances[in_zone[:-1] | in_zone[1:]] = np.inf
    best = int(distances.argmin())
    if not np.isfinite(distances[best]):
        return None
    time = times[best] + shares[best] * (times[best + 1] - times[best])
    return Approach(float(distances[best]), float(time), (track.route, other.route))
