"""Positions in CSV and GeoJSON files: cells of the grid, or degrees projected on it."""

import csv
import io
import math
from pathlib import Path
from typing import Annotated, NamedTuple, Self

import numpy as np
from pydantic import AfterValidator

from dess.errors import InputError, shown
from dess.files.reading import read_text

EARTH_RADIUS = 6_371_008.8  # mean radius of WGS 84 [m]


class Projection(NamedTuple):
    """The projection of a sea.

    Attributes:
        middle: Longitude and latitude of the centre of the grid [degrees].
        size: Cells of the grid from west to east and from north to south.
        cell_size: Side of a cell [m].
    """

    middle: tuple[float, float]
    size: tuple[int, int]
    cell_size: float

    @classmethod
    def about(cls, degrees: np.ndarray, size: tuple[int, int], cell_size: float) -> Self:
        """The projection about the centre of the bounding box of (K, 2) places on the Earth."""
        if np.ptp(degrees[:, 0]) > 180:  # on both sides of the 180th meridian
            degrees = degrees + [360, 0] * (degrees < 0)
        lon, lat = (degrees.min(0) + degrees.max(0)) / 2
        return cls((float(lon), float(lat)), size, cell_size)

    def cells(self, degrees: np.ndarray) -> np.ndarray:
        """The (K, 2) places on the grid [cells] of (K, 2) places on the Earth; y grows south."""
        away = degrees - self.middle
        away[:, 0] -= 360 * np.round(away[:, 0] / 360)  # the short way around the Earth
        degree = math.radians(1) * EARTH_RADIUS / self.cell_size  # of latitude [cells]
        east = degree * math.cos(math.radians(self.middle[1]))
        return np.array(self.size) / 2 + away * [east, -degree]


LIMIT = 2**20  # bytes of the largest file

# The pairs of columns, and the largest number of each; cells off the grid are refused later.
GEOGRAPHIC = ("lon", "lat")
LIMITS = {("x", "y"): (99_999, 99_999), GEOGRAPHIC: (180, 90)}


class Positions(NamedTuple):
    """What a file has.

    Attributes:
        is_geographic: Whether the places are degrees, and not cells.
        names: Where each place stands in the file, such as ``line 3``.
        places: (K, 2) longitude and latitude [degrees], or column and row of the cell.
    """

    is_geographic: bool
    names: list[str]
    places: np.ndarray


def _on_earth(position: list[float]) -> list[float]:
    if len(position) < 2:
        raise ValueError("has not two numbers; allowed: [lon, lat]")
    for name, most, value in zip(GEOGRAPHIC, LIMITS[GEOGRAPHIC], position, strict=False):
        if abs(value) > most:
            raise ValueError(f"{name} is {value:g}; allowed: -{most}..{most}")
    return position


# A position in GeoJSON: longitude, latitude [degrees] and perhaps an altitude.
OnEarth = Annotated[list[float], AfterValidator(_on_earth)]


def csv_positions(path: Path) -> Positions:
    """The positions in a CSV file, in the order of its lines.

    Raises:
        InputError: If the file cannot be read, or has no such columns or numbers.
    """
    try:
        text = read_text(path, LIMIT, "utf-8-sig", "a CSV file")
        lines = csv.reader(io.StringIO(text), strict=True)
        columns = [name.strip() for name in next(lines, [])]
        rows = [(f"line {lines.line_num}", row) for row in lines if any(map(str.strip, row))]
    except csv.Error as error:
        raise InputError(f"{path}: is not a CSV file: {error}; allowed: CSV with commas") from None
    found = [pair for pair in LIMITS if {*pair} <= {*columns}]
    if len(found) != 1:
        there = ", ".join(columns) or "none"
        raise InputError(f"{path}: has columns {there}; allowed: x and y, or lon and lat")
    is_geographic, places = found == [GEOGRAPHIC], []
    for line, texts in rows:
        values = dict.fromkeys(columns, "") | dict(zip(columns, texts, strict=False))
        numbers = [
            _number(values[name].strip(), f"{path}: {line}: {name}", most, is_geographic)
            for name, most in zip(found[0], LIMITS[found[0]], strict=True)
        ]
        places.append(numbers)
    return Positions(is_geographic, [line for line, _ in rows], np.reshape(places, (-1, 2)))


def _number(text: str, place: str, most: int, is_geographic: bool) -> float:
    """A number of at most this size; a cell has integers."""
    try:
        number = float(text)
    except ValueError:
        raise InputError(f"{place} is {shown(text)}; allowed: a number") from None
    if not -most <= number <= most:
        raise InputError(f"{place} is {number:g}; allowed: {-most:,}..{most:,}")
    if not is_geographic and not number.is_integer():
        raise InputError(f"{place} is {number:g}; allowed: an integer (a cell)")
    return number
