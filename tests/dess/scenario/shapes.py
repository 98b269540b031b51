"""Shapes of GeoJSON, and a small grid at the equator."""

import math
from typing import Any

from dess.scenario.projection import EARTH_RADIUS, Projection

# A cell is a hundredth of a degree of latitude and, at the equator, of longitude; 0, 0 is the
# centre of the grid.
CELL = 1111.95
# Cells of exactly this size, so that what has hundredths of degrees lies on edges of cells.
EXACT = Projection((0.0, 0.0), (8, 6), math.radians(0.01) * EARTH_RADIUS)
EQUATOR = Projection((0.0, 0.0), (8, 6), CELL)


def feature(kind: str, coordinates: Any, **properties: Any) -> dict[str, Any]:
    """A feature with a geometry of a kind."""
    shape = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "geometry": shape, "properties": properties}


def collection(*features: dict[str, Any]) -> dict[str, Any]:
    """A document of features."""
    return {"type": "FeatureCollection", "features": [*features]}


def box(west: float, south: float, east: float, north: float) -> list[list[float]]:
    """A ring around a rectangle."""
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]
