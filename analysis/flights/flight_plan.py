"""The plan of a mission: a file for each flight, a table of all phases, and how exact it is."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from dess.analysis.flights.fence import Fence
from dess.analysis.flights.phases import FLIGHT, list_phases
from dess.analysis.flights.plan_file import plan_text
from dess.analysis.flights.route import Route, SeaMap
from dess.analysis.flights.schedule import Entry, Schedule
from dess.analysis.flights.separation import ROUNDING, Approach, Separation, closest_approach
from dess.analysis.numbers import format_count, join_words, write_csv
from dess.analysis.results.event_log import Events, battery_from_full
from dess.base.errors import InputError
from dess.scenario.own_sea import Positions
from dess.scenario.projection import Projection
from dess.scenario.scenario import Constants, Scenario

TABLE = "plan.csv"
MOVE = "move"  # from one place of a zone to another
MOST_DAYS = 1000  # of a mission


def check_plannable(scenario: Constants) -> None:
    """Refuse a scenario whose missions cannot become plans.

    Raises:
        InputError: If it has no degrees, no units or no landings.
    """
    if scenario.centre is None:
        allowed = "nodes with lon and lat, or a scenario with centre"
        raise InputError("--plan", "the sea has no degrees", allowed)
    if scenario.units is None:
        allowed = "a scenario with [data_sheet], from which they follow"
        raise InputError("--plan", "the scenario has no cruise and no slot in seconds", allowed)
    if not scenario.landing:
        raise InputError("--plan", "the UAVs do not land", "landing = true")
    days = scenario.max_slots * scenario.units.slot / 86_400
    if days > MOST_DAYS:
        raise InputError("--plan", f"the mission lasts for {days:,.0f} d", f"{MOST_DAYS} d at most")
    projection = Projection(scenario.centre, scenario.size, scenario.cell_size)
    (west, north), (east, south) = projection.degrees(np.array([(0, 0), scenario.size], float))
    if north > 90 or south < -90 or east - west > 180:
        raise InputError("--plan", "the grid reaches beyond a pole", "a smaller grid")


@dataclass(frozen=True)
class FlightPlan:
    """The plan of a mission.

    Attributes:
        sea: Where the mission is.
        schedule: What each UAV does when.
        separation: How far apart UAVs have to be.
        start: When the mission starts, if it is known.
    """

    sea: SeaMap
    schedule: Schedule
    separation: Separation
    start: datetime | None = None

    @classmethod
    def of(
        cls,
        events: Events,
        scenario: Scenario,
        positions: Positions,
        start: datetime | None = None,
        separation: Separation | None = None,
    ) -> "FlightPlan":
        """The plan of a simulated mission.

        Args:
            events: The event log (a data frame, or the columns, of ``EventLog``).
            scenario: The scenario of the mission.
            positions: The places that the scenario has in degrees.
            start: When the mission starts.
            separation: How far apart UAVs have to be, otherwise 10 m in the air and 3 m on the
                ground.

        Raises:
            InputError: If the mission cannot become a plan, a UAV does not land in it, a zone has
                no room, or two UAVs come too near to each other.
        """
        check_plannable(scenario)
        separation = separation or Separation()
        sea = SeaMap(scenario, positions)
        phases = [phase for of_uav in list_phases(events, scenario) for phase in of_uav]
        plan = cls(sea, Schedule(phases, sea, separation), separation, start)
        plan._check_separation()
        return plan

    def _check_separation(self) -> None:
        for approach, least, where in (
            (self.approach, self.separation.air, "in the air"),
            (self.approach_on_ground, self.separation.ground, "on the ground"),
        ):
            if approach and approach.metres < least - ROUNDING:
                problem = f"two UAVs come too near: {self._describe_approach(approach)}"
                allowed = f"{least:g} m and more {where}, such as another --replication may have"
                raise InputError("--plan", problem, allowed)

    @cached_property
    def entries(self) -> list[Entry]:
        """What the UAVs do, one UAV after the other."""
        return self.schedule.entries

    @cached_property
    def routes(self) -> dict[str, Route]:
        """The flights by the names of their files."""
        routes = {}
        numbers: dict[tuple[int, str], int] = {}
        for entry in self.entries:
            if entry.route:
                key = entry.uav, _kind_of(entry)
                numbers[key] = numbers.get(key, 0) + 1
                flight = f"uav{entry.uav + 1:02}-{key[1]}{numbers[key]:02}"
                routes[f"{flight}-{_name_time(entry.start)}.plan"] = entry.route
        return routes

    @cached_property
    def fence(self) -> Fence:
        """The geofence of all files."""
        return Fence.around(self.sea, self.routes.values())

    def make_files(self) -> dict[str, str]:
        """The names of all files with their contents."""
        files = {}
        for name, route in self.routes.items():
            rally = [places.standing[route.uav] for places in self.schedule.places]
            files[name] = plan_text(route, self.fence, rally)
        return files | {TABLE: write_csv(self.make_table())}

    def make_table(self) -> pd.DataFrame:
        """All phases of all UAVs.

        Returns:
            A row for each: ``uav`` from 1 on; ``phase``, which is ``move`` for a flight from one
            place of a zone to another; ``start`` and ``end`` [s], with a start also as times
            ``from`` and ``to``; ``battery_start`` and ``battery_end`` [%] of a full battery;
            ``zone`` from 1 on, ``place``, ``lon, lat`` where it ends. Of a flight also its
            ``file``, ``seconds`` and ``metres`` beside ``simulated_start``, ``simulated_seconds``
            and ``simulated_metres``; ``speed`` and ``climb`` [m/s], ``altitude`` [m],
            ``way_points``; ``held``, how long it waits in the air for others [s]; how far they are
            from the middles of their cells at most, ``shift`` in the air and ``ground_shift`` at
            take-off and landing [m].
        """
        names = {id(route): name for name, route in self.routes.items()}
        rows = []
        for entry in self.entries:
            row = self._make_row(entry) | {"file": names.get(id(entry.route), "")}
            if entry.route:
                row |= self._row_of_flight(entry.route)
            rows.append(row)
        return pd.DataFrame(rows)

    def _make_row(self, entry: Entry) -> dict[str, Any]:
        row: dict[str, Any] = {"uav": entry.uav + 1, "phase": _kind_of(entry)}
        row["start"] = round(entry.start, 3)
        row["end"] = round(entry.end, 3)
        if self.start:
            for name, time in (("from", entry.start), ("to", entry.end)):
                moment = self.start + timedelta(seconds=time)
                row[name] = moment.isoformat(timespec="seconds")
        for name, battery in zip(("battery_start", "battery_end"), entry.battery, strict=True):
            row[name] = self._read_battery(battery, entry.uav)
        row["zone"] = entry.zone + 1
        row["place"] = self.schedule.places[entry.zone].name_of(entry.place)
        row["lon"], row["lat"] = entry.place
        return row

    def _row_of_flight(self, route: Route) -> dict[str, Any]:
        row: dict[str, Any] = {
            "seconds": round(route.seconds, 1),
            "metres": round(route.metres, 1),
        }
        if route.phase:
            row["simulated_start"] = round(route.phase.start * self._slot, 3)
            row["simulated_seconds"] = round(route.simulated_seconds, 1)
            row["simulated_metres"] = round(route.simulated_metres, 1)
        return row | {
            "speed": route.craft.speed,
            "climb": route.craft.climb,
            "altitude": route.craft.altitude,
            "way_points": len(route.points),
            "held": route.held,
            "shift": round(route.shift, 1),
            "ground_shift": round(route.ground_shift, 1),
        }

    @property
    def _slot(self) -> float:
        assert self.sea.scenario.units
        return self.sea.scenario.units.slot

    def _read_battery(self, battery: float, uav: int) -> float:
        """What a pilot reads of a battery of the model [%]."""
        return round(float(battery_from_full(battery, self.sea.scenario, uav)), 1)

    @property
    def _flights(self) -> dict[str, Route]:
        """The flights of the simulation, without moves within zones."""
        return {name: route for name, route in self.routes.items() if route.phase}

    @property
    def _landings(self) -> list[Entry]:
        return [entry for entry in self.entries if entry.kind == FLIGHT]

    def list_places(self) -> list[dict[str, Any]]:
        """The places of the zones: ``zone`` and ``place``, and ``lon, lat`` [degrees]."""
        return [
            {"zone": zone + 1, "place": places.name_of(place), "lon": place.lon, "lat": place.lat}
            for zone, places in enumerate(self.schedule.places)
            for place in dict.fromkeys((*places.pads, *places.standing))
        ]

    def summarise(self) -> dict[str, Any]:
        """How exact the plan is, and its places, by the names that the JSON of a mission has."""
        routes = [*self._flights.values()]
        simulated = [
            self._read_battery(route.phase.battery[1], route.uav) for route in routes if route.phase
        ]
        planned = [self._read_battery(entry.battery[1], entry.uav) for entry in self._landings]
        late = (r.start - r.phase.start * self._slot for r in routes if r.phase)
        return {
            "flights": len(routes),
            "moves_within_zones": len(self.routes) - len(routes),
            "largest_shift_m": _largest_of(r.shift for r in routes),
            "largest_ground_shift_m": _largest_of(r.ground_shift for r in routes),
            "largest_difference_m": _largest_of(r.metres - r.simulated_metres for r in routes),
            "largest_difference_s": _largest_of(r.seconds - r.simulated_seconds for r in routes),
            "largest_delay_s": _largest_of(late),
            "climb_m_per_s": self.sea.scenario.data_sheet.number("climb"),
            "lowest_battery": min(simulated, default=None),
            "lowest_battery_planned": min(planned, default=None),
            "closest_approach_m": _metres_of(self.approach),
            "closest_approach_outside_zones_m": _metres_of(self.approach_outside_zones),
            "closest_approach_on_ground_m": _metres_of(self.approach_on_ground),
            "fence_corners": self.fence.corners,
            "fence_left_out_m": self.fence.left_out,
            "places": self.list_places(),
        }

    def list_sentences(self) -> list[str]:
        """The same in sentences."""
        summary = self.summarise()
        if not self.routes:
            return [f"No UAV flies in this mission; {TABLE} says what they do."]
        sheet = self.sea.scenario.data_sheet
        climb = f"{summary['climb_m_per_s']:g} m/s"
        if sheet.climb is None:
            climb += ", which is assumed (climb in the data sheet)"
        lines = [f"{format_count(summary['flights'], 'flight')}, listed in {TABLE}."]
        if moves := summary["moves_within_zones"]:
            lines.append(
                f"{format_count(moves, 'move')} from one place of a zone to another, to a pad or "
                "from it, which the simulation does not have."
            )
        lines += [
            f"Way points are up to {summary['largest_shift_m']:g} m from the middles of their "
            f"cells, take-offs and landings up to {summary['largest_ground_shift_m']:g} m.",
            f"UAVs climb and descend at {climb}.",
            f"The flights of the files differ from the simulated ones by up to "
            f"{summary['largest_difference_m']:g} m and {summary['largest_difference_s']:g} s, "
            f"and begin up to {summary['largest_delay_s']:g} s later.",
            f"The lowest battery at a landing is {summary['lowest_battery']:g} % of a full one in "
            f"the simulation, and about {summary['lowest_battery_planned']:g} % on the ways of the "
            "files, with climbs and descents.",
            f"Closest approach of two UAVs, one of them in the air: "
            f"{self._describe_approach(self.approach)}.",
            f"Outside of the zones: {self._describe_approach(self.approach_outside_zones)}.",
            f"On the ground: {self._describe_approach(self.approach_on_ground)}.",
            *self._list_warnings(),
        ]
        return [*lines, *self.fence.list_sentences(), *self._list_zones()]

    def _list_zones(self) -> Iterator[str]:
        """The places of each zone."""
        for zone in range(len(self.schedule.places)):
            places = [
                f"{place['place']} at {place['lat']:.7f}, {place['lon']:.7f}"
                for place in self.list_places()
                if place["zone"] == zone + 1
            ]
            yield f"Places of zone {zone + 1} (latitude, longitude): {'; '.join(places)}."

    def _list_warnings(self) -> list[str]:
        """What a pilot has to know of some flights."""
        lines = []
        names = {id(route): name for name, route in self.routes.items()}
        steep = [n for n, r in self._flights.items() if r.craft.altitude > r.metres]
        if steep:
            flights = format_count(len(steep), "flight")
            lines.append(f"The climb of {flights} is longer than the way: {_join(steep)}.")
        empty = [
            names[id(entry.route)]
            for entry in self._landings
            if self._read_battery(entry.battery[1], entry.uav) <= 0
        ]
        reserve = [
            names[id(entry.route)]
            for entry in self._landings
            if entry.battery[1] < 0 and names[id(entry.route)] not in empty
        ]
        for short, problem in (
            (empty, "The battery may not last for the ways of"),
            (reserve, "The reserve is used on the ways of"),
        ):
            if short:
                lines.append(f"{problem} {format_count(len(short), 'flight')}: {_join(short)}.")
        return lines

    @cached_property
    def approach(self) -> Approach | None:
        """When two UAVs are nearest to each other, at least one of them in the air."""
        return closest_approach(self.schedule.tracks, self.sea)

    @cached_property
    def approach_outside_zones(self) -> Approach | None:
        """The same in the time in which both are outside of all zones."""
        return closest_approach(self.schedule.tracks, self.sea, outside_zones=True)

    @cached_property
    def approach_on_ground(self) -> Approach | None:
        """How near to each other UAVs stand."""
        return closest_approach(self.schedule.tracks, self.sea, ground=True)

    def _describe_approach(self, approach: Approach | None) -> str:
        if approach is None:
            return "there is no such time"
        time = _name_time(approach.seconds)
        first, second = (self._name_at(uav, approach.seconds) for uav in approach.uavs)
        track = self.schedule.tracks[approach.uavs[0]]
        spots, _ = track.at(np.array([approach.seconds]))
        place = self.sea.place_at(*spots[0])
        return (
            f"{approach.metres:.1f} m, after {time} at {place.lat:.6f}, {place.lon:.6f}, of "
            f"{first} and {second}"
        )

    def _name_at(self, uav: int, seconds: float) -> str:
        """The flight of a UAV at a time; on the ground its last one, and where it stands."""
        flights = {name: route for name, route in self.routes.items() if route.uav == uav}
        if not flights:
            return f"UAV {uav + 1}, which does not fly"
        past = [name for name, route in flights.items() if route.start <= seconds]
        name = past[-1] if past else next(iter(flights))
        if flights[name].start <= seconds <= flights[name].end:
            return name
        standing = [e for e in self.entries if e.uav == uav and e.start <= seconds]
        if not standing:
            return f"{name} (UAV {uav + 1} before it)"
        entry = standing[-1]
        place = self.schedule.places[entry.zone].name_of(entry.place)
        return f"{name} (UAV {uav + 1} on {place} of zone {entry.zone + 1})"


def _join(names: Iterable[str]) -> str:
    """Up to three names in words."""
    names = [*names]
    if len(names) > 3:
        names = [*names[:3], f"{len(names) - 3} more"]
    return join_words(names)


def _kind_of(entry: Entry) -> str:
    if entry.route and not entry.route.phase:
        return MOVE
    return entry.kind


def _metres_of(approach: Approach | None) -> float | None:
    if approach:
        return round(approach.metres, 1)
    return None


def _largest_of(differences: Any) -> float:
    """The largest of some differences, whatever their signs, to a tenth."""
    return round(max(map(abs, differences), default=0.0), 1)


def _name_time(seconds: float) -> str:
    """A time as in the name of a file, such as ``02h05m00s``."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours:02}h{minutes:02}m{rest:02}s"
