"""The paths of the UAVs of a mission, and their files: CSV, GeoJSON, KML and GPX."""

import json
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.results.event_log import Events, battery_from_full, battery_levels, uav_slots
from dess.base.errors import InputError
from dess.physics.fleet import type_of
from dess.scenario.projection import Projection
from dess.scenario.scenario import Scenario

_KML = """<?xml version='1.0' encoding='UTF-8'?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">"""

_GPX = """<?xml version='1.0' encoding='UTF-8'?>
<gpx xmlns="http://www.topografix.com/GPX/1/1" version="1.1" creator="dess">"""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def paths_of(
    events: Events, scenario: Scenario, altitudes: Sequence[float] | None = None
) -> pd.DataFrame:
    """Where every UAV was at the start of every mission slot, and at its end.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.model.events.EventLog``).
        scenario: The scenario of the mission.
        altitudes: Those of the UAVs in the air [m], where each has its own; otherwise that of the
            scenario.

    Returns:
        One row per UAV and time, in that order: ``uav`` from 1 on; ``time`` [mission slots];
        ``seconds``, the same time [s], if the scenario has a data sheet; ``x, y``, the place on the
        grid [cells], where a whole number is the middle of a cell; ``lon, lat`` [degrees], if the
        sea has them; ``altitude`` [m], 0 on the ground; ``battery`` [%] of a full one.
    """
    if altitudes is None:
        altitudes = [scenario.altitude] * scenario.uavs
    table = battery_levels(events)
    slots = uav_slots(events)
    for uav, of_uav in slots.groupby("uav"):
        rows = table["uav"] == uav
        moves = of_uav[of_uav["moved"]]
        last = type_of(scenario.fleet, int(uav)).slots_per_cell
        times = np.stack([moves["slot"], moves["slot"] + last], axis=1).ravel()
        for axis in ("x", "y"):
            cells = moves[[f"from_{axis}", axis]].to_numpy().ravel()
            first = of_uav[f"from_{axis}"].iloc[0]
            places = np.interp(table["time"][rows], [0, *times], [first, *cells])
            table.loc[rows, axis] = places
        on_ground = _is_on_ground(of_uav, scenario, last)
        altitude = np.where(on_ground, 0.0, altitudes[int(uav)])
        table.loc[rows, "altitude"] = altitude[: rows.sum()]
        battery = table.loc[rows, "battery"].to_numpy()
        table.loc[rows, "percent"] = battery_from_full(battery, scenario, int(uav))
    if scenario.centre:
        projection = Projection(scenario.centre, scenario.size, scenario.cell_size)
        table[["lon", "lat"]] = projection.degrees(table[["x", "y"]].to_numpy() + 0.5)
    table["battery"] = table.pop("percent").round(1)
    table["uav"] += 1
    if scenario.units:
        table.insert(2, "seconds", table["time"] * scenario.units.slot)
    at_end = ["altitude", "battery"]
    return table[[*table.columns.drop(at_end), *at_end]]


def _is_on_ground(slots: pd.DataFrame, scenario: Scenario, duration: int) -> np.ndarray:
    """(T + 1,) whether a UAV is on the ground at the start of each slot, and at its end.

    It is where it began, in slots in which it charges or is under repair, and with landing in those
    in which it hovers in a zone.
    """
    zones = scenario.chart.zones[slots["y"], slots["x"]]
    begins = slots["slot"].where(slots["moved"]).ffill().fillna(-duration)
    is_moving = slots["slot"] < begins + duration
    stands = slots["charging"] | slots["grounded"]
    if scenario.landing:
        stands |= (zones >= 0) & ~is_moving
    first = scenario.landing or bool(stands.iloc[0])
    return np.concatenate([[first], stands])


def path_text(
    events: Events,
    scenario: Scenario,
    kind: str,
    start: datetime | None = None,
    altitudes: Sequence[float] | None = None,
) -> str:
    """The paths in a file.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.model.events.EventLog``).
        scenario: The scenario of the mission.
        kind: ``csv``, ``geojson``, with cells where the sea has no degrees, ``kml`` or ``gpx``.
        start: When the mission starts. Without it KML and GPX, which have times of days only, count
            from 1970 on. Without a data sheet, a mission slot is a second.
        altitudes: As for ``paths_of``.

    Raises:
        InputError: If the mission lasts for longer than times of days go on.
    """
    table = paths_of(events, scenario, altitudes)
    if start or kind in ("kml", "gpx"):
        table["utc"] = _moments(table, start or _EPOCH)
    if kind == "csv":
        return numbers.write_csv(table)
    if scenario.centre:
        axes = ["lon", "lat"]
    else:
        axes = ["x", "y"]
    others = table.columns.intersection(["time", "seconds", "battery", "utc"])
    paths = {uav: rows[[*axes, "altitude", *others]] for uav, rows in table.groupby("uav")}
    writers = {"geojson": _paths_as_geojson, "kml": _paths_as_kml, "gpx": _paths_as_gpx}
    return writers[kind](paths)


def _moments(table: pd.DataFrame, start: datetime) -> pd.Series:
    """The times of a table of paths as texts such as ``2026-06-01T08:00:00Z``."""
    seconds = table["seconds"] if "seconds" in table else table["time"]
    try:
        moments = pd.Timestamp(start) + pd.to_timedelta(seconds, unit="s")
    except (OverflowError, ValueError):
        problem = f"the mission lasts for {seconds.max():g} s"
        raise InputError(
            "--path", problem, "less than 200 years, or .csv without --start"
        ) from None
    return moments.dt.round("s").dt.strftime("%Y-%m-%dT%H:%M:%SZ")


def _paths_as_geojson(paths: dict[int, pd.DataFrame]) -> str:
    """A line for each UAV, with the times and the battery at each of its places."""
    names = {"time": "times", "seconds": "seconds", "battery": "battery", "utc": "coordTimes"}
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "LineString", "coordinates": path.iloc[:, :3].to_numpy().tolist()},
            "properties": {"uav": uav} | {names[name]: [*path[name]] for name in path.columns[3:]},
        }
        for uav, path in paths.items()
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


def _paths_as_kml(paths: dict[int, pd.DataFrame]) -> str:
    """A track for each UAV."""
    marks = []
    for uav, path in paths.items():
        track = [f"<when>{moment}</when>" for moment in path["utc"]]
        track += ["<gx:coord>{} {} {}</gx:coord>".format(*at) for at in path.iloc[:, :3].to_numpy()]
        track.insert(0, "<altitudeMode>relativeToGround</altitudeMode>")
        mark = f"<name>UAV {uav}</name><gx:Track>{''.join(track)}</gx:Track>"
        marks.append(f"<Placemark>{mark}</Placemark>")
    return f"{_KML}<Document>{''.join(marks)}</Document></kml>"


def _paths_as_gpx(paths: dict[int, pd.DataFrame]) -> str:
    """A track for each UAV; its longitudes are those from -180 to 180 degrees."""
    tracks = []
    for uav, path in paths.items():
        points = [
            f'<trkpt lat="{row.lat}" lon="{(row.lon + 180) % 360 - 180}">'
            f"<ele>{row.altitude}</ele><time>{row.utc}</time></trkpt>"
            for row in path.itertuples()
        ]
        tracks.append(f"<trk><name>UAV {uav}</name><trkseg>{''.join(points)}</trkseg></trk>")
    return f"{_GPX}{''.join(tracks)}</gpx>"
