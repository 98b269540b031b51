"""When each UAV of a plan flies, stands and charges, and where.

The simulation has no climbs, and a zone in it is as large as its cells. So a flight of a plan takes
longer or shorter than the simulated one, and what follows it may begin later. Phases keep their
order: a UAV takes off when it did in the simulation or as soon as it can, and is charged to the
battery that it had there, on a pad that is free.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from dess.analysis.flights.phases import CHARGING, FLIGHT, STANDING, Phase
from dess.analysis.flights.places import ZonePlaces
from dess.analysis.flights.route import Craft, GeoPoint, Moment, Route, SeaMap, WayPoint
from dess.analysis.flights.separation import Separation, Track, keeps_apart

_WAITS = [2.0 * step for step in range(300)]  # until the way is free, the shortest first [s]


class Entry(NamedTuple):
    """What a UAV does from one time to another.

    Attributes:
        uav: The number of the UAV, from 0.
        kind: ``FLIGHT``, ``CHARGING`` or ``STANDING``.
        start: When it begins, from the start of the mission [s].
        end: When it ends [s].
        battery: The battery at both times, of which the reserve is not a part [%].
        zone: The number of the zone in which it ends, from 0.
        place: Where it ends.
        route: The way of a flight.
    """

    uav: int
    kind: str
    start: float
    end: float
    battery: tuple[float, float]
    zone: int
    place: GeoPoint
    route: Route | None = None


@dataclass
class _Uav:
    """A UAV while its schedule is made.

    Attributes:
        number: Its number, from 0.
        craft: How it flies.
        zone, place: Where it is.
        battery: What it has [%].
        track: Where it has been.
        entries: What it has done.
        time: Until when its schedule is made [s].
        pad: The number of the pad on which it is, None on other places.
        flight: A flight whose landing is not decided yet.
    """

    number: int
    craft: Craft
    zone: int
    place: GeoPoint
    battery: float
    track: Track
    entries: list[Entry]
    time: float = 0.0
    pad: int | None = None
    flight: Route | None = None


class Schedule:
    """The schedule of all UAVs.

    Attributes:
        places: The places of the zones.
    """

    def __init__(self, phases: Sequence[Phase], sea: SeaMap, separation: Separation):
        """Make the schedule of the phases of a simulated mission.

        Raises:
            InputError: If a zone has no room for its places.
        """
        self._sea = sea
        self._separation = separation
        assert sea.scenario.units
        self._slot = sea.scenario.units.slot
        zones = range(len(sea.scenario.rectangles))
        self.places = [ZonePlaces.lay_out(sea, zone, separation.spacing) for zone in zones]
        self._pads_free = [[0.0] * len(places.pads) for places in self.places]
        self._phases = phases
        self._uavs = [self._begin(phase) for phase in phases if phase.start == 0]
        # Who leaves a pad at a time leaves it to those who begin to charge then.
        order = (FLIGHT, STANDING, CHARGING)
        for phase in sorted(phases, key=lambda p: (p.start, order.index(p.kind), p.uav)):
            self._plan(self._uavs[phase.uav], phase)

    @property
    def entries(self) -> list[Entry]:
        """What the UAVs do, one UAV after the other."""
        return [entry for uav in self._uavs for entry in uav.entries]

    @property
    def tracks(self) -> list[Track]:
        """Where each UAV is over time."""
        return [uav.track for uav in self._uavs]

    def _begin(self, phase: Phase) -> _Uav:
        """A UAV at its own place of the zone in which it begins."""
        zone = self._sea.zone_of(phase.visits[0].cell)
        place = self.places[zone].standing[phase.uav]
        altitude = self._separation.altitudes(self._sea.scenario)[phase.uav]
        craft = Craft.of(self._sea.scenario, phase.uav, altitude)
        track = Track.of(phase.uav, [Moment(0.0, place, 0.0)], self._sea)
        return _Uav(phase.uav, craft, zone, place, float(phase.battery[0]), track, [])

    def _plan(self, uav: _Uav, phase: Phase) -> None:
        if phase.kind == FLIGHT:
            self._depart(uav, phase)
            return
        zone = self._sea.zone_of(phase.visits[-1].cell)
        if phase.kind == CHARGING:
            self._charge(uav, phase, zone)
            return
        own_place = self.places[zone].standing[uav.number]
        if uav.flight:
            self._land(uav, zone, own_place)
        elif uav.place != own_place and self._is_wanted(phase, zone):
            self._move(uav, own_place, uav.time)
        self._stand(uav, phase.end * self._slot)

    # --- on the ground ---

    def _stand(self, uav: _Uav, until: float) -> None:
        """Stand until a time [s], if it is not over."""
        if until <= uav.time:
            return
        start = uav.time
        if uav.entries and uav.entries[-1].kind == STANDING:
            start = uav.entries.pop().start
        battery = (uav.battery, uav.battery)
        entry = Entry(uav.number, STANDING, start, until, battery, uav.zone, uav.place)
        uav.entries.append(entry)
        uav.time = until

    def _is_wanted(self, standing: Phase, zone: int) -> bool:
        """Whether others begin to charge in a zone while a UAV stands there."""
        return any(
            other.kind == CHARGING
            and other.uav != standing.uav
            and standing.start <= other.start < standing.end
            and self._sea.zone_of(other.visits[-1].cell) == zone
            for other in self._phases
        )

    def _charge(self, uav: _Uav, phase: Phase, zone: int) -> None:
        """Charge on a pad, to the battery of the simulation."""
        if uav.flight or uav.pad is None:
            self._go_to_pad(uav, phase, zone)
        self._stand(uav, phase.start * self._slot)
        before = uav.battery
        needed = (phase.end - phase.start) * self._slot
        gained = phase.battery[1] - phase.battery[0]
        if gained > 0:
            needed *= max(phase.battery[1] - before, 0.0) / gained
        if needed:
            start = uav.time
            uav.battery = max(before, float(phase.battery[1]))
            uav.time += needed
            battery = (before, uav.battery)
            entry = Entry(uav.number, CHARGING, start, uav.time, battery, zone, uav.place)
            uav.entries.append(entry)

    def _go_to_pad(self, uav: _Uav, phase: Phase, zone: int) -> None:
        """Land on a pad, or on the own place and move to the pad when it is free."""
        places = self.places[zone]
        free = self._pads_free[zone]
        own_place = places.standing[uav.number]
        pad = min(range(len(free)), key=lambda number: (free[number], number))
        if own_place in places.pads:
            pad = uav.number
        place = places.pads[pad]
        if phase.start == 0:
            uav.place = place
            uav.track = Track.of(uav.number, [Moment(0.0, place, 0.0)], self._sea)
        elif uav.flight:
            landed = self._find_landing(uav, place, free[pad])
            if landed:
                self._finish(uav, landed, zone)
            else:
                self._land(uav, zone, own_place)
        if uav.place != place:
            self._move(uav, place, max(free[pad], phase.start * self._slot))
        uav.pad = pad
        free[pad] = math.inf

    def _leave_pad(self, uav: _Uav, time: float) -> None:
        if uav.pad is not None:
            self._pads_free[uav.zone][uav.pad] = time
            uav.pad = None

    # --- in the air ---

    def _depart(self, uav: _Uav, phase: Phase) -> None:
        """Take off when the way to the next zone is free; where to land is decided later."""
        route = Route(
            phase,
            uav.number,
            uav.craft,
            max(phase.start * self._slot, uav.time),
            self._sea.begin_way(phase, uav.place),
            (phase.end - phase.start) * self._slot,
            phase.moves * self._sea.scenario.cell_size,
        )
        later = (replace(route, start=route.start + wait) for wait in _WAITS)
        route = self._first_free(later, uav, lands=False) or route
        self._stand(uav, route.start)
        self._leave_pad(uav, route.start)
        uav.flight = route
        uav.time = route.moments[-2].seconds

    def _land(self, uav: _Uav, zone: int, place: GeoPoint) -> None:
        """Land at a place, whether its way is free or not: what is too near is refused later."""
        assert uav.flight
        landed = self._find_landing(uav, place, 0.0) or self._with_landing(uav.flight, place, 0.0)
        self._finish(uav, landed, zone)

    def _find_landing(self, uav: _Uav, place: GeoPoint, earliest: float) -> Route | None:
        """The flight with a landing at a place that is free at a time [s]; None if it is not.

        It waits in the air for others who are in its way, and not for the place.
        """
        assert uav.flight
        flight = uav.flight
        if self._with_landing(flight, place, 0.0).end < earliest:
            return None
        landings = (self._with_landing(flight, place, wait) for wait in _WAITS)
        return self._first_free(landings, uav)

    def _with_landing(self, flight: Route, place: GeoPoint, hold: float) -> Route:
        assert flight.phase
        end = self._sea.end_way(flight.phase, place, hold)
        return replace(flight, points=flight.points + end, held=hold)

    def _move(self, uav: _Uav, place: GeoPoint, earliest: float) -> None:
        """Fly from one place of a zone to another, from a time [s] on."""
        start = max(uav.time, earliest)
        points = (WayPoint(uav.place, 0.0, 0.0), WayPoint(place, 0.0, 0.0))
        route = Route(None, uav.number, uav.craft, start, points)
        later = (replace(route, start=start + wait) for wait in _WAITS)
        route = self._first_free(later, uav) or route
        self._stand(uav, route.start)
        self._leave_pad(uav, route.start)
        self._finish(uav, route, uav.zone)

    def _first_free(
        self, routes: Iterable[Route], uav: _Uav, *, lands: bool = True
    ) -> Route | None:
        """The first of some flights that keeps the distances to all others; None without one."""
        others = [*self._others(uav.number)]
        for route in routes:
            moments = route.moments
            end = math.inf
            if not lands:
                moments = moments[:-1]
                end = moments[-1].seconds
            track = uav.track.followed_by(moments, self._sea)
            if keeps_apart(track, others, self._separation, self._sea, (route.start, end)):
                return route
        return None

    def _finish(self, uav: _Uav, route: Route, zone: int) -> None:
        """End a flight at its last place."""
        before = uav.battery
        uav.track = uav.track.followed_by(route.moments, self._sea)
        uav.battery -= route.battery
        uav.flight = None
        uav.zone = zone
        uav.place = route.points[-1].place
        uav.time = route.end
        battery = (before, uav.battery)
        uav.entries.append(
            Entry(uav.number, FLIGHT, route.start, route.end, battery, zone, uav.place, route)
        )

    def _others(self, uav: int) -> Iterable[Track]:
        """Where the others are, those in the air until their landing is decided."""
        for other in self._uavs:
            if other.number == uav:
                continue
            if other.flight:
                yield other.track.followed_by(other.flight.moments[:-1], self._sea)
            else:
                yield other.track
