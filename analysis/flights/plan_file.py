"""Files that QGroundControl reads: a flight with its geofence and rally points (version 1).

The format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html
"""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from dess.analysis.flights.route import Place, Route, SeaMap, WayPoint
from dess.physics.chart import NO_FLY

# Commands of MAVLink (MAV_CMD), and what the altitudes of items are relative to (MAV_FRAME).
WAY_POINT, LOITER, LAND, TAKE_OFF, CHANGE_SPEED = 16, 19, 21, 22, 178
_ABOVE_HOME, _NO_PLACE = 3, 2
# Of MAV_AUTOPILOT and MAV_TYPE.
_PX4, _QUADROTOR = 12, 2
_RELATIVE = 1  # the altitude mode of QGroundControl
_GROUND_SPEED, _SAME_THROTTLE = 1, -1

Corners = list[tuple[float, float]]


class Fence:
    """The geofence of a sea: the grid, and the no-fly cells in it.

    Attributes:
        inside: The corners in which UAVs stay; none if the sea crosses the 180th meridian, where
            autopilots do not know which side of a fence is meant.
        outside: The corners of each polygon that they do not enter.
    """

    def __init__(self, sea: SeaMap):
        """Make the fence of a sea."""
        columns, rows = sea.scenario.size
        grid: Corners = [(0, 0), (columns, 0), (columns, rows), (0, rows)]
        closed = sea.scenario.chart.zones == NO_FLY
        self.inside = [sea.place_at(*corner) for corner in grid]
        self.outside = [
            [sea.place_at(*corner) for corner in piece] for piece in outline_pieces(closed)
        ]
        if self.inside[0].lon > self.inside[1].lon:
            self.inside = []
            self.outside = []

    @property
    def corners(self) -> int:
        """The number of all corners."""
        return len(self.inside) + sum(map(len, self.outside))

    def make_document(self) -> dict[str, Any]:
        """The fence as the file has it."""
        polygons = [_make_polygon(corners, inclusion=False) for corners in self.outside]
        if self.inside:
            polygons.insert(0, _make_polygon(self.inside, inclusion=True))
        return {"circles": [], "polygons": polygons, "version": 2}


def outline_pieces(closed: np.ndarray) -> Iterator[Corners]:
    """The outlines of pieces without holes that cover cells, each clockwise as a map shows it.

    A piece has one run of cells in each of its rows, which touches that in the row above. It ends
    where runs part or meet.

    Args:
        closed: (H, W) whether a cell is covered.
    """
    growing: list[list[tuple[int, int, int]]] = []
    for row, cells in enumerate(closed):
        edges = np.flatnonzero(np.diff(cells.astype(int), prepend=0, append=0)).tolist()
        runs = [*zip(edges[::2], edges[1::2], strict=True)]
        still_growing = []
        for start, end in runs:
            above = [piece for piece in growing if piece[-1][1] < end and start < piece[-1][2]]
            piece = []
            if len(above) == 1 and _count_touching(above[0][-1], runs) == 1:
                piece = above[0]
            piece.append((row, start, end))
            still_growing.append(piece)
        yield from (_trace_outline(piece) for piece in growing if piece[-1][0] < row)
        growing = still_growing
    yield from map(_trace_outline, growing)


def _count_touching(above: tuple[int, int, int], runs: list[tuple[int, int]]) -> int:
    """How many runs of a row touch a run of the row above."""
    return sum(start < above[2] and above[1] < end for start, end in runs)


def _trace_outline(piece: list[tuple[int, int, int]]) -> Corners:
    """The corners of a piece: down its right side, and up its left one."""
    right = [(end, y) for row, _, end in piece for y in (row, row + 1)]
    left = [(start, y) for row, start, _ in piece for y in (row, row + 1)]
    corners = right + left[::-1]
    kept: Corners = []
    for before, corner, after in zip(
        [corners[-1], *corners], corners, [*corners[1:], corners[0]], strict=False
    ):
        is_straight = before[0] == corner[0] == after[0] or before[1] == corner[1] == after[1]
        if corner != before and not is_straight:
            kept.append(corner)
    return kept


def plan_text(route: Route, sea: SeaMap, fence: Fence) -> str:
    """The file of a flight."""
    return json.dumps(_make_document(route, sea, fence), indent=4) + "\n"


def _make_document(route: Route, sea: SeaMap, fence: Fence) -> dict[str, Any]:
    home = route.points[0].place
    zones = [sea.place_of_zone(number) for number in range(len(sea.scenario.rectangles))]
    return {
        "fileType": "Plan",
        "geoFence": fence.make_document(),
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": route.speed,
            "firmwareType": _PX4,
            "globalPlanAltitudeMode": _RELATIVE,
            "hoverSpeed": route.speed,
            "items": [*_list_items(route)],
            "plannedHomePosition": [home.lat, home.lon, 0],
            "vehicleType": _QUADROTOR,
            "version": 2,
        },
        "rallyPoints": {
            "points": [[place.lat, place.lon, route.altitude] for place in zones],
            "version": 2,
        },
        "version": 1,
    }


def _list_items(route: Route) -> Iterator[dict[str, Any]]:
    """The items of a flight, numbered from 1."""
    take_off, *points, landing = route.points
    items = [
        _make_item(TAKE_OFF, [0, 0, 0, None], take_off, route.altitude),
        _change_speed(route.speed),
        *(_item_at(point, route.altitude) for point in points),
        _make_item(LAND, [0, 0, 0, None], landing, 0),
    ]
    for number, item in enumerate(items, 1):
        yield item | {"doJumpId": number}


def _item_at(point: WayPoint, altitude: float) -> dict[str, Any]:
    """The item of a way point, where the UAV may hover."""
    if point.seconds:
        return _make_item(LOITER, [point.seconds, 0, 0, 0], point, altitude)
    return _make_item(WAY_POINT, [0, 0, 0, None], point, altitude)


def _make_item(
    command: int, parameters: list[float | None], point: WayPoint, altitude: float
) -> dict[str, Any]:
    """An item at a place; the altitude is that above home."""
    return {
        "AMSLAltAboveTerrain": None,
        "Altitude": altitude,
        "AltitudeMode": _RELATIVE,
        "autoContinue": True,
        "command": command,
        "frame": _ABOVE_HOME,
        "params": [*parameters, point.place.lat, point.place.lon, altitude],
        "type": "SimpleItem",
    }


def _change_speed(speed: float) -> dict[str, Any]:
    return {
        "autoContinue": True,
        "command": CHANGE_SPEED,
        "frame": _NO_PLACE,
        "params": [_GROUND_SPEED, speed, _SAME_THROTTLE, 0, 0, 0, 0],
        "type": "SimpleItem",
    }


def _make_polygon(corners: list[Place], *, inclusion: bool) -> dict[str, Any]:
    return {
        "inclusion": inclusion,
        "polygon": [[corner.lat, corner.lon] for corner in corners],
        "version": 1,
    }
