"""Places of users: rows of CSV files, and features of GeoJSON, in degrees or cells."""

from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from dess.base.errors import shown, unknown_name
from dess.physics.section import Strict

# The pairs of columns, and the largest number of each; cells off the grid are refused later.
GEOGRAPHIC = ("lon", "lat")
LIMITS = {("x", "y"): (99_999, 99_999), GEOGRAPHIC: (180, 90)}
ROUNDING = 1e-6  # degrees by which a file may be beyond a limit
# What a feature consists of, as GeoJSON calls it.
POINT, LINE, POLYGON = "Point", "LineString", "Polygon"

Shape = tuple[str, list[np.ndarray]]  # POINT, LINE or POLYGON, and its rings of (K, 2) places


class Place(NamedTuple):
    """A row of a CSV file, or a feature.

    Attributes:
        where: Where it stands in the file, such as ``line 3``.
        properties: The columns or the properties.
        shapes: What it consists of; none if it is empty.
    """

    where: str
    properties: Mapping[str, Any]
    shapes: list[Shape]

    def property(self, name: str, known: Iterable[str] = ()) -> Any:
        """The property of this name, or else the first of the known ones, whatever the case.

        Raises:
            InputError: If it has none of this name.
        """
        if name and name not in self.properties:
            raise unknown_name(self.where, f"has no {name}", name, self.properties)
        lower = {str(key).lower(): value for key, value in self.properties.items()}
        values = [self.properties[name]] if name else [lower.get(key) for key in known]
        return next((value for value in values if value not in (None, "")), None)


class Places(NamedTuple):
    """The places of a file, degrees or cells."""

    is_geographic: bool
    places: list[Place]


class Source(Strict):
    """A file that a scenario names, and what is taken of it."""

    file: str = Field(description="the name of a file beside the scenario, or in a folder there")
    where: dict[str, str] = Field(
        default={}, description="the properties of what is taken, e.g. {Country = 'DK*'}"
    )

    def chosen(self, places: list[Place], path: Path) -> list[Place]:
        """The places that have the wanted properties; ``*`` and ``?`` stand for other letters.

        Raises:
            InputError: If the file, whose path is for the message, has places and none is chosen.
        """
        chosen = places
        for name, pattern in self.where.items():
            present = chosen
            chosen = [p for p in present if fnmatchcase(str(p.properties.get(name)), pattern)]
            if present and not chosen:
                values = [str(p.properties[name]) for p in present if name in p.properties]
                if not values:
                    names = [other for place in present for other in place.properties]
                    raise unknown_name(path, f"has no {name}", name, names)
                problem = f"where: no place has {name} = {shown(pattern)}"
                raise unknown_name(path, problem, pattern, values)
        return chosen
