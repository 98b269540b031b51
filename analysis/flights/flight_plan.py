"""The plan of a mission: a file for each flight, a table of all phases, and how exact it is."""

from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from dess.analysis.flights.phases import Phase, list_phases
from dess.analysis.flights.plan_file import Fence, plan_text
from dess.analysis.flights.route import Approach, Route, SeaMap, closest_approach
from dess.analysis.numbers import format_count, write_csv
from dess.analysis.results.event_log import Events
from dess.base.errors import InputError
from dess.scenario.own_sea import Positions
from dess.scenario.places import Projection
from dess.scenario.scenario import Constants, Scenario

TABLE = "plan.csv"
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
        phases: What each UAV does, one UAV after the other.
        start: When the mission starts, if it is known.
    """

    sea: SeaMap
    phases: tuple[Phase, ...]
    start: datetime | None = None

    @classmethod
    def of(
        cls,
        events: Events,
        scenario: Scenario,
        positions: Positions,
        start: datetime | None = None,
    ) -> "FlightPlan":
        """The plan of a simulated mission.

        Args:
            events: The event log (a data frame, or the columns, of ``EventLog``).
            scenario: The scenario of the mission.
            positions: The places that the scenario has in degrees.
            start: When the mission starts.

        Raises:
            InputError: If the mission cannot become a plan, or a UAV does not land in it.
        """
        check_plannable(scenario)
        sea = SeaMap(scenario, positions)
        of_uavs = list_phases(events, scenario, sea.bases)
        return cls(sea, tuple(phase for phases in of_uavs for phase in phases), start)

    @cached_property
    def routes(self) -> dict[str, Route]:
        """The flights by the names of their files."""
        routes = {}
        numbers: dict[int, int] = {}
        for phase in self.phases:
            if phase.moves:
                numbers[phase.uav] = numbers.get(phase.uav, 0) + 1
                route = self.sea.plan_route(phase)
                flight = f"uav{phase.uav + 1:02}-flight{numbers[phase.uav]:02}"
                routes[f"{flight}-{_name_time(route.start)}.plan"] = route
        return routes

    @cached_property
    def fence(self) -> Fence:
        """The geofence of all files."""
        return Fence(self.sea)

    def make_files(self) -> dict[str, str]:
        """The names of all files with their contents."""
        files = {
            name: plan_text(route, self.sea, self.fence) for name, route in self.routes.items()
        }
        return files | {TABLE: write_csv(self.make_table())}

    def make_table(self) -> pd.DataFrame:
        """All phases of all UAVs.

        Returns:
            A row for each: ``uav`` from 1 on, ``phase``, ``start`` and ``end`` [s] in the
            simulation, with a start also as times ``from`` and ``to``; ``battery_start`` and
            ``battery_end`` [%]; ``lon, lat`` of its place or of its landing. Of a flight also its
            ``file``, ``seconds`` and ``metres`` in the file beside ``simulated_seconds`` and
            ``simulated_metres``; ``battery_planned`` [%], what is left with ``seconds`` in the
            place of ``simulated_seconds``; ``speed`` [m/s], ``altitude`` [m], ``way_points``; how
            far they are from the middles of their cells at most, ``shift`` in the air and
            ``ground_shift`` at take-off and landing [m].
        """
        named = {route.phase: (name, route) for name, route in self.routes.items()}
        rows = []
        for phase in self.phases:
            name, route = named.get(phase, ("", None))
            rows.append(self._make_row(phase) | {"file": name} | _row_of_flight(route))
        return pd.DataFrame(rows)

    def _make_row(self, phase: Phase) -> dict[str, Any]:
        units = self.sea.scenario.units
        assert units
        times = {"start": phase.start * units.slot, "end": phase.end * units.slot}
        row: dict[str, Any] = {"uav": phase.uav + 1, "phase": phase.kind}
        row |= {name: round(time, 3) for name, time in times.items()}
        if self.start:
            for name, time in zip(("from", "to"), times.values(), strict=True):
                moment = self.start + timedelta(seconds=time)
                row[name] = moment.isoformat(timespec="seconds")
        row["battery_start"], row["battery_end"] = phase.battery
        row["lon"], row["lat"] = self.sea.place_on_ground(phase.visits[-1].cell)
        return row

    def summarise_errors(self) -> dict[str, Any]:
        """How exact the plan is, by the names that the JSON of a mission has."""
        routes = [*self.routes.values()]
        return {
            "flights": len(routes),
            "largest_shift_m": _largest_of(r.shift for r in routes),
            "largest_ground_shift_m": _largest_of(r.ground_shift for r in routes),
            "largest_difference_m": _largest_of(r.metres - r.simulated_metres for r in routes),
            "largest_difference_s": _largest_of(r.seconds - r.simulated_seconds for r in routes),
            "lowest_battery": min((r.phase.battery[1] for r in routes), default=None),
            "lowest_battery_planned": min((round(r.battery_end, 1) for r in routes), default=None),
            "closest_approach_m": _metres_of(self.approach),
            "closest_approach_outside_zones_m": _metres_of(self.approach_outside_zones),
            "fence_corners": self.fence.corners,
        }

    def list_sentences(self) -> list[str]:
        """The same in sentences."""
        summary = self.summarise_errors()
        if not self.routes:
            return [f"No UAV flies in this mission; {TABLE} says what they do."]
        lines = [
            f"{format_count(summary['flights'], 'flight')}, listed in {TABLE}.",
            f"Way points are up to {summary['largest_shift_m']:g} m from the middles of their "
            f"cells, take-offs and landings up to {summary['largest_ground_shift_m']:g} m.",
            f"The flights of the files differ from the simulated ones by up to "
            f"{summary['largest_difference_m']:g} m and {summary['largest_difference_s']:g} s.",
            f"The lowest battery at a landing is {summary['lowest_battery']} % in the simulation, "
            f"and about {summary['lowest_battery_planned']:g} % on the ways of the files.",
            f"Closest approach of two UAVs: {self._describe_approach(self.approach)}",
            f"Outside of the zones: {self._describe_approach(self.approach_outside_zones)}",
        ]
        short = sum(route.battery_end <= 0 for route in self.routes.values())
        if short:
            flights = format_count(short, "flight")
            lines.append(f"The battery may not last for the ways of {flights}.")
        if self.fence.corners:
            count = format_count(summary["fence_corners"], "corner")
            lines.append(f"The geofence has {count}; autopilots keep only so many.")
        else:
            lines.append("There is no geofence, since the sea crosses the 180th meridian.")
        return lines

    @cached_property
    def approach(self) -> Approach | None:
        """When two UAVs in flight are nearest to each other."""
        return closest_approach(self.routes.values(), self.sea)

    @cached_property
    def approach_outside_zones(self) -> Approach | None:
        """The same in the time in which both are outside of all zones."""
        return closest_approach(self.routes.values(), self.sea, outside_zones=True)

    def _describe_approach(self, approach: Approach | None) -> str:
        if approach is None:
            return "no two fly at the same time."
        names = {id(route): name for name, route in self.routes.items()}
        first, second = (names[id(route)] for route in approach.routes)
        time = _name_time(approach.seconds)
        return f"{approach.metres:.1f} m, after {time}, of {first} and {second}."


def _metres_of(approach: Approach | None) -> float | None:
    if approach:
        return round(approach.metres, 1)
    return None


def _row_of_flight(route: Route | None) -> dict[str, Any]:
    if route is None:
        return {}
    return {
        "seconds": round(route.seconds, 1),
        "simulated_seconds": round(route.simulated_seconds, 1),
        "battery_planned": round(route.battery_end, 1),
        "metres": round(route.metres, 1),
        "simulated_metres": round(route.simulated_metres, 1),
        "speed": route.speed,
        "altitude": route.altitude,
        "way_points": len(route.points),
        "shift": round(route.shift, 1),
        "ground_shift": round(route.ground_shift, 1),
    }


def _largest_of(differences: Any) -> float:
    """The largest of some differences, whatever their signs, to a tenth."""
    return round(max(map(abs, differences), default=0.0), 1)


def _name_time(seconds: float) -> str:
    """A time as in the name of a file, such as ``02h05m00s``."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours:02}h{minutes:02}m{rest:02}s"
