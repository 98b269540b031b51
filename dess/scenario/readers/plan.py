"""Plans of QGroundControl, of which the geofence is read: no-fly zones as polygons."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from dess.base.elementary import cos, sin
from dess.base.errors import InputError
from dess.base.files.documents import Document
from dess.base.files.reading import TEXT_LIMIT
from dess.scenario.places import POLYGON, Place, Places
from dess.scenario.projection import EARTH_RADIUS
from dess.scenario.readers.geojson import positions_of

# The sides of a circle, its largest radius [m], and how far beyond all of a geofence UAVs are kept
# out [degrees].
_SIDES, _MOST_RADIUS, _FAR = 64, 10**6, 90


class _PlanPolygon(Document, extra="ignore"):
    polygon: list[Any] = Field(description="corners, [lat, lon] each")
    inclusion: bool


class _Circle(Document, extra="ignore"):
    center: list[Any] = Field(description="[lat, lon]")
    radius: float = Field(gt=0, le=_MOST_RADIUS, description="of a circle [m]")


class _PlanCircle(Document, extra="ignore"):
    circle: _Circle
    inclusion: bool


class _GeoFence(Document, extra="ignore"):
    polygons: list[_PlanPolygon] = []
    circles: list[_PlanCircle] = []


class _PlanDocument(Document, extra="ignore"):
    """A plan of QGroundControl, of which the geofence is read."""

    geoFence: _GeoFence = Field(description="a geofence")  # noqa: N815


def read_plan(path: Path) -> Places:
    """The no-fly zones of the geofence of a plan of QGroundControl (``.plan``).

    What UAVs are kept out of is a feature each; all that lies outside of the polygons and circles
    in which they are kept is one feature more. A circle is a polygon of ``_SIDES`` sides.

    Raises:
        InputError: If it cannot be read, or is no plan.
    """
    fence = _PlanDocument.load(path, absent="a plan of QGroundControl", limit=TEXT_LIMIT).geoFence
    rings = []
    for number, polygon in enumerate(fence.polygons):
        where = f"geoFence.polygons.{number}"
        ring = _corners(polygon.polygon, f"{path}: {where}.polygon")
        if len(ring) < 3:
            raise InputError(f"{path}: {where}.polygon", "is no polygon", "three corners or more")
        rings.append((where, np.concatenate([ring, ring[:1]]), polygon.inclusion))
    for number, item in enumerate(fence.circles):
        where = f"geoFence.circles.{number}"
        [centre] = _corners([item.circle.center], f"{path}: {where}.circle.center")
        rings.append((where, _ring_about(centre, item.circle.radius), item.inclusion))
    places = [
        Place(where, {"id": None}, [(POLYGON, [ring])])
        for where, ring, inclusion in rings
        if not inclusion
    ]
    inside = [ring for _, ring, inclusion in rings if inclusion]
    if inside:
        places.append(Place("geoFence", {"id": None}, [(POLYGON, [_around(inside), *inside])]))
    return Places(True, places)


def _corners(value: Any, place: str) -> np.ndarray:
    """(K, 2) longitudes and latitudes of a list of [lat, lon]."""
    if isinstance(value, list):
        value = [[*reversed(c[:2])] if isinstance(c, list) else c for c in value]
    return positions_of(value, place, "[lat, lon]")


def _ring_about(centre: np.ndarray, radius: float) -> np.ndarray:
    """(K, 2) longitudes and latitudes around a circle."""
    degree = radius / EARTH_RADIUS / math.radians(1)
    turns = [2 * math.pi * side / _SIDES for side in range(_SIDES + 1)]
    narrow = cos(math.radians(centre[1]))
    away = np.array([[cos(angle) / narrow, sin(angle)] for angle in turns])
    ring = centre + degree * away
    ring[-1] = ring[0]
    return ring


def _around(rings: list[np.ndarray]) -> np.ndarray:
    """A ring far around others."""
    corners = np.concatenate(rings)
    west, south = corners.min(0) - _FAR
    east, north = corners.max(0) + _FAR
    return np.array([(west, south), (east, south), (east, north), (west, north), (west, south)])
