"""The paths of the UAVs of a mission with its times, as a table and as files for maps."""

import json

import numpy as np
import pandas as pd

from dess.analysis.results.event_log import Events, battery_levels, uav_slots
from dess.scenario import Scenario
from dess.sea.places import Projection
from dess.sections.fleet import type_of

_KML = """<?xml version='1.0' encoding='UTF-8'?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">"""


def paths_of(events: Events, scenario: Scenario) -> pd.DataFrame:
    """Where every UAV was at the start of every mission slot, and at its end.

    Returns:
        One row per UAV and time, in that order: ``uav``; ``time`` [mission slots]; ``x, y``, the
        place on the grid [cells], where a whole number is the middle of a cell; ``lon, lat``
        [degrees], if the sea has them; ``altitude`` [m]; ``battery`` [%].
    """
    table, slots = battery_levels(events), uav_slots(events)
    for axis in ("x", "y"):
        for uav, of_uav in slots.groupby("uav"):
            moves, last = of_uav[of_uav["moved"]], type_of(scenario.fleet, int(uav)).slots_per_cell
            times = np.stack([moves["slot"], moves["slot"] + last], axis=1).ravel()
            cells = moves[[f"from_{axis}", axis]].to_numpy().ravel()
            first = of_uav[f"from_{axis}"].iloc[0]
            rows = table["uav"] == uav
            there = np.interp(table["time"][rows], [0, *times], [first, *cells])
            table.loc[rows, axis] = there
    if scenario.centre:
        projection = Projection(scenario.centre, scenario.size, scenario.cell_size)
        table[["lon", "lat"]] = projection.degrees(table[["x", "y"]].to_numpy() + 0.5)
    table.insert(len(table.columns), "altitude", scenario.altitude)
    return table[[*table.columns.drop("battery"), "battery"]]


def path_text(events: Events, scenario: Scenario, kind: str) -> str:
    """The paths in a file.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The scenario of the mission.
        kind: ``csv``, ``geojson``, with cells where the sea has no degrees, or ``kml``.
    """
    table = paths_of(events, scenario)
    if kind == "csv":
        return table.to_csv(index=False)
    axes = ["lon", "lat"] if scenario.centre else ["x", "y"]
    paths = {uav: of[[*axes, "altitude", "time", "battery"]] for uav, of in table.groupby("uav")}
    return (_kml if kind == "kml" else _geojson)(paths)


def _geojson(paths: dict[int, pd.DataFrame]) -> str:
    """A line for each UAV, with the time and the battery at each of its places."""
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "LineString", "coordinates": of.iloc[:, :3].to_numpy().tolist()},
            "properties": {"uav": uav, "times": [*of["time"]], "battery": [*of["battery"]]},
        }
        for uav, of in paths.items()
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


def _kml(paths: dict[int, pd.DataFrame]) -> str:
    """A track for each UAV; a mission slot is a second, from 1970 on, as KML has no other times."""
    marks = []
    for uav, of in paths.items():
        times = pd.to_datetime(of["time"], unit="s")
        track = [f"<when>{time:%Y-%m-%dT%H:%M:%SZ}</when>" for time in times]
        track += ["<gx:coord>{} {} {}</gx:coord>".format(*at) for at in of.iloc[:, :3].to_numpy()]
        track.insert(0, "<altitudeMode>relativeToGround</altitudeMode>")
        mark = f"<name>UAV {uav + 1}</name><gx:Track>{''.join(track)}</gx:Track>"
        marks.append(f"<Placemark>{mark}</Placemark>")
    return f"{_KML}<Document>{''.join(marks)}</Document></kml>"
