"""Files that QGroundControl reads: a flight with its geofence and rally points (version 1).

The format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html
"""

import json
from collections.abc import Iterator, Sequence
from typing import Any

from dess.analysis.flights.fence import Fence
from dess.analysis.flights.route import GeoPoint, Route, WayPoint

# Commands of MAVLink (MAV_CMD), and what the altitudes of items are relative to (MAV_FRAME).
WAY_POINT, LOITER, LAND, TAKE_OFF, CHANGE_SPEED = 16, 19, 21, 22, 178
_ABOVE_HOME, _NO_PLACE = 3, 2
# Of MAV_AUTOPILOT and MAV_TYPE.
_PX4, _QUADROTOR = 12, 2
_RELATIVE = 1  # the altitude mode of QGroundControl
_GROUND_SPEED, _SAME_THROTTLE = 1, -1


def plan_text(route: Route, fence: Fence, rally: Sequence[GeoPoint]) -> str:
    """The file of a flight; its rally points are the UAV's own places in the zones."""
    return json.dumps(_make_document(route, fence, rally), indent=4) + "\n"


def _make_document(route: Route, fence: Fence, rally: Sequence[GeoPoint]) -> dict[str, Any]:
    home = route.points[0].place
    craft = route.craft
    return {
        "fileType": "Plan",
        "geoFence": fence.make_document(),
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": craft.speed,
            "firmwareType": _PX4,
            "globalPlanAltitudeMode": _RELATIVE,
            "hoverSpeed": craft.speed,
            "items": [*_list_items(route)],
            "plannedHomePosition": [home.lat, home.lon, 0],
            "vehicleType": _QUADROTOR,
            "version": 2,
        },
        "rallyPoints": {
            "points": [[place.lat, place.lon, craft.altitude] for place in rally],
            "version": 2,
        },
        "version": 1,
    }


def _list_items(route: Route) -> Iterator[dict[str, Any]]:
    """The items of a flight, numbered from 1."""
    take_off, *points, landing = route.points
    craft = route.craft
    items = [
        _make_item(TAKE_OFF, [0, 0, 0, None], take_off, craft.altitude),
        _change_speed(craft.speed),
        *(_item_at(point, craft.altitude) for point in points),
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
