"""How far places of files reach by their properties: radii of circles, limits of altitude."""

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from dess.base.errors import InputError, shown
from dess.scenario import places
from dess.scenario.places import Place
from dess.scenario.quantities import quantity_of

MOST_METRES = 10**6  # of a width, a buffer or a radius

# What a place says of its extent, by the last word of a property: its radius, perhaps with a unit
# as in "Radius (km)"; what is not read; from and up to which altitude it reaches.
_RADIUS = re.compile(r"radius[ _.-]*[(\[]?([a-z]*)[)\]]?", re.IGNORECASE)
_UNREAD = re.compile(
    "radius|diameter|width|buffer|wkt|polygon|ellipse|semi.?(?:major|minor)|(?<![a-z])range|extent",
    re.IGNORECASE,
)
_LOWER = re.compile(r"lower|floor|min_?alt", re.IGNORECASE)
_UPPER = re.compile(r"upper|ceil|max_?alt", re.IGNORECASE)
_OF_A_LIMIT = re.compile(r"ref|datum|unit|uom", re.IGNORECASE)
_UNIT = re.compile(r"unit|uom", re.IGNORECASE)
# In hundreds of feet, as FL100 or as 100 with the unit FL.
_FLIGHT_LEVEL = re.compile(r"FL ?([0-9]{1,3})|([0-9]{1,3}) FL", re.IGNORECASE)


def _statements(values: Mapping[str, Any], within: str = "") -> Iterator[tuple[str, Any]]:
    """The properties of a place that are not empty, those of tables in them dotted."""
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _statements(value, f"{within}{name}.")
        elif value not in (None, ""):
            yield f"{within}{name}", value


def radii_of(place: Place) -> dict[str, str]:
    """The radii of a circle, with their units, by the names of the properties that say them."""
    radii = {}
    for name, value in _statements(place.properties):
        match = _RADIUS.fullmatch(name.rpartition(".")[2])
        if match:
            text = str(value).strip()
            if not text[-1:].isalpha():
                unit = match[1].lower() or "m"
                text = f"{text} {'NM' if unit == 'nm' else unit}"
            radii[name] = text
    return radii


def radius_of(place: Place, path: Path) -> float:
    """The radius of a circle [m], the largest that it has; 0 without one.

    Raises:
        InputError: If it is none.
    """
    largest = 0.0
    for name, text in radii_of(place).items():
        if _has_points(place):
            where = f"{path}: {place.where}: {name}"
            radius = quantity_of(text, where, "m")
            if not 0 <= radius <= MOST_METRES:
                allowed = f"metres from 0 to {MOST_METRES:,}, or a distance with its unit"
                raise InputError(where, f"{shown(text)} is out of range", allowed)
            largest = max(largest, radius)
    return largest


def _has_points(place: Place) -> bool:
    return any(kind == places.POINT for kind, _ in place.shapes)


def unread_names(place: Place) -> list[str]:
    """The properties of a place that seem to say how far it reaches, and are not read."""
    radii = radii_of(place)
    if not _has_points(place):
        radii = {}
    return [
        name
        for name, _ in _statements(place.properties)
        if _UNREAD.search(name.rpartition(".")[2]) and name not in radii
    ]


def lies_elsewhere(place: Place, altitude: float) -> bool:
    """Whether a place begins above an altitude [m], or ends below it."""
    lower = _limits(place, _LOWER)
    upper = [limit for limit in _limits(place, _UPPER) if limit > 0]  # 0 is often for none
    return max(lower, default=0.0) > altitude or min(upper, default=altitude) < altitude


def _limits(place: Place, kind: re.Pattern[str]) -> list[float]:
    """The limits of altitude of a kind that a place has [m]; without a unit they are metres."""
    limits = []
    statements = dict(_statements(place.properties))
    for name, value in statements.items():
        table, _, word = name.rpartition(".")
        if not kind.search(name) or _OF_A_LIMIT.search(word):
            continue
        text = str(value).strip()
        if not text[-1:].isalpha() and not _FLIGHT_LEVEL.fullmatch(text):
            beside = [n for n in statements if n.rpartition(".")[0] == table and _UNIT.search(n)]
            beside.sort(key=lambda other: not kind.search(other))  # its own unit, if it has one
            units = [str(statements[other]).lower() for other in beside]
            text = f"{text} {next(filter(str.isalpha, units), 'm')}"
        level = _FLIGHT_LEVEL.fullmatch(text)
        if level:
            text = f"{level[1] or level[2]}00 ft"
        with suppress(InputError):  # a word, such as that for the surface of the sea
            limits.append(quantity_of(text, name, "m"))
    return limits
