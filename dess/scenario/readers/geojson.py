"""GeoJSON files: features with their properties and shapes."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from dess.base.errors import InputError, validated
from dess.base.files.documents import Document
from dess.base.files.reading import TEXT_LIMIT
from dess.scenario.places import GEOGRAPHIC, LIMITS, LINE, POLYGON, ROUNDING, Place, Places, Shape

_GEOJSON = "a GeoJSON FeatureCollection"


class _Geometry(Document, extra="allow"):
    type: Literal[
        "Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon",
        "GeometryCollection",
    ]  # fmt: skip
    coordinates: list[Any] = Field([], description="positions, or lists of them")
    geometries: list[dict[str, Any]] = Field([], description="geometries")


class _Feature(Document, extra="allow"):
    id: str | int | float | None = None
    geometry: _Geometry | None = Field(None, description="a geometry")
    properties: dict[str, Any] | None = None


class Features(Document, extra="ignore"):
    """A GeoJSON file."""

    features: tuple[_Feature, ...] = Field(min_length=1, description=_GEOJSON)


def read_geojson(path: Path) -> Places:
    """The features of a GeoJSON file; those without a geometry have no shapes.

    Members that GeoJSON does not know are properties as well. A geometry within another one that
    has such members, as zones of ED-318 have them, is a place of its own.

    Raises:
        InputError: If it cannot be read, or is no GeoJSON.
    """
    places = []
    features = Features.load(path, absent=_GEOJSON, limit=TEXT_LIMIT).features
    for number, feature in enumerate(features):
        where = f"features.{number}"
        properties = {"id": feature.id} | _foreign(feature) | (feature.properties or {})
        of_feature = Place(where, properties, [])
        if feature.geometry:
            of_feature = Place(where, properties | _foreign(feature.geometry), [])
            for inner, geometry in _geometries(feature.geometry, f"{where}.geometry"):
                shapes = _shapes(geometry, f"{path}: {inner}")
                if geometry is not feature.geometry and _foreign(geometry):
                    places.append(Place(inner, properties | _foreign(geometry), [*shapes]))
                else:
                    of_feature.shapes.extend(shapes)
        places.append(of_feature)
    return Places(True, places)


def _foreign(part: _Feature | _Geometry) -> dict[str, Any]:
    """The members of a part of a file that GeoJSON does not know."""
    members = part.model_extra or {}
    return {name: value for name, value in members.items() if name not in ("type", "bbox")}


def _geometries(geometry: _Geometry, place: str) -> Iterator[tuple[str, _Geometry]]:
    """The geometries of a feature, the inner ones first, each with where it stands."""
    for number, inner in enumerate(geometry.geometries):
        where = f"{place}.geometries.{number}"
        yield from _geometries(validated(_Geometry, inner, where), where)
    yield place, geometry


def _shapes(geometry: _Geometry, place: str) -> Iterator[Shape]:
    """The parts of a geometry of GeoJSON, those that are empty left out."""
    kind = geometry.type.removeprefix("Multi")
    place = f"{place}.coordinates"
    parts = {place: geometry.coordinates}
    if kind != geometry.type:
        parts = {f"{place}.{n}": part for n, part in enumerate(geometry.coordinates)}
    for where, part in parts.items():
        if part and kind == POLYGON:
            rings = [part]
            if isinstance(part, list):
                rings = part
            yield kind, [_ring(ring, f"{where}.{n}") for n, ring in enumerate(rings)]
        elif part and kind == LINE:
            yield kind, [_line(part, where)]
        elif part:
            yield kind, [positions_of([part], where)]


def _ring(value: Any, place: str) -> np.ndarray:
    ring = positions_of(value, place)
    if len(ring) < 4 or (ring[0] != ring[-1]).any():
        allowed = "four positions or more, the last as the first"
        raise InputError(place, "is no ring", allowed)
    return ring


def _line(value: Any, place: str) -> np.ndarray:
    line = positions_of(value, place)
    if len(line) < 2:
        raise InputError(place, "is no line", "two positions or more")
    return line


def positions_of(value: Any, place: str, form: str = "[lon, lat]") -> np.ndarray:
    """The (K, 2) degrees of a list of positions; messages say their ``form``."""
    try:
        positions = np.array([position[:2] for position in value], float).reshape(len(value), 2)
    except (TypeError, ValueError, OverflowError, KeyError):
        raise InputError(place, "has not two numbers", form) from None
    most = np.array(LIMITS[GEOGRAPHIC])
    for number, axis in np.argwhere(~(np.abs(positions) <= most + ROUNDING)):
        where = place
        if len(positions) > 1:
            where = f"{place}.{number}"
        name = GEOGRAPHIC[axis]
        limit = most[axis]
        problem = f"{name} is {positions[number, axis]:g}"
        raise InputError(where, problem, f"-{limit}..{limit}")
    return np.clip(positions, -most, most)
