"""The projection of a sea: cells of its grid, and degrees on the Earth.

Degrees are projected about the centre of the grid (equirectangular projection).
"""

import math
from collections.abc import Iterator
from typing import NamedTuple, Self

import numpy as np

from dess.base.elementary import cos, hypot
from dess.physics.chart import Cell

EARTH_RADIUS = 6_371_008.8  # mean radius of WGS 84 [m]
# An edge that is longer [degrees] crosses the 180th meridian instead.
_LONGEST = 270

Size = tuple[int, int]  # cells of the grid from west to east, and from north to south


def is_on_grid(cell: Cell, size: Size) -> bool:
    """Whether a cell is on the grid."""
    return 0 <= cell[0] < size[0] and 0 <= cell[1] < size[1]


class Projection(NamedTuple):
    """The projection of a sea.

    Attributes:
        centre: Longitude and latitude of the centre of the grid [degrees].
        size: Cells of the grid from west to east and from north to south.
        cell_size: Side of a cell [m].
    """

    centre: tuple[float, float]
    size: Size
    cell_size: float

    @classmethod
    def about(cls, degrees: np.ndarray, size: Size, cell_size: float) -> Self:
        """The projection about the centre of the bounding box of (K, 2) places on the Earth."""
        if np.ptp(degrees[:, 0]) > 180:  # on both sides of the 180th meridian
            degrees = degrees + [360, 0] * (degrees < 0)
        lon, lat = (degrees.min(0) + degrees.max(0)) / 2
        if lon > 180:
            lon -= 360
        return cls((float(lon), float(lat)), size, cell_size)

    @property
    def _degree(self) -> np.ndarray:
        """A degree to the east and one to the north [cells]; y grows south."""
        degree = math.radians(1) * EARTH_RADIUS / self.cell_size
        return np.array([degree * cos(math.radians(self.centre[1])), -degree])

    def cells(self, degrees: np.ndarray) -> np.ndarray:
        """The (K, 2) places on the grid [cells] of (K, 2) places on the Earth."""
        away = degrees - self.centre
        away[:, 0] -= 360 * np.round(away[:, 0] / 360)  # the short way around the Earth
        return np.array(self.size) / 2 + away * self._degree

    def degrees(self, places: np.ndarray) -> np.ndarray:
        """The (K, 2) places on the Earth of (K, 2) places on the grid [cells].

        Longitudes go on beyond 180 degrees where the grid does, so that no path jumps by 360.
        """
        return (places - np.array(self.size) / 2) / self._degree + self.centre

    def distance_error(self, places: np.ndarray) -> float:
        """The largest error of distances in the rectangle around (K, 2) places [cells], as a share.

        Distances between its corners, and from them a hundredth of a cell to the east, are compared
        with those on the Earth (great circles).
        """
        low, high = places.min(0), places.max(0)
        corners = np.array([low, high, [low[0], high[1]], [high[0], low[1]]])
        spots = np.concatenate([corners, corners + [0.01, 0]])
        first, second = np.triu_indices(len(spots), 1)
        across = spots[first] - spots[second]
        on_grid = hypot(across[:, 0], across[:, 1]) * self.cell_size
        degrees = np.radians(self.degrees(spots))
        half = np.sin((degrees[first] - degrees[second]) / 2) ** 2
        lats = np.cos(degrees[:, 1])
        on_earth = np.arcsin(np.sqrt(half[:, 1] + lats[first] * lats[second] * half[:, 0]))
        is_known = on_grid > 0
        errors = on_grid[is_known] / (2 * EARTH_RADIUS * on_earth[is_known]) - 1
        return float(np.abs(errors).max())

    def shapes(self, rings: list[np.ndarray]) -> Iterator[list[np.ndarray]]:
        """The rings of a shape on the grid [cells]; once more for each turn around the Earth.

        A ring is unwrapped as a whole: its first place may be anywhere, the others follow it.
        """
        rings = [_unwrapped(ring) for ring in rings]
        middles = [(ring[:, 0].min() + ring[:, 0].max()) / 2 for ring in rings]
        turns = np.round((np.array(middles) - middles[0]) / 360)  # of holes, away from the outer
        first = np.round((middles[0] - self.centre[0]) / 360)
        for turn in (-1, 0, 1):
            degrees = [
                ring - self.centre - [360 * (first + of_ring - turn), 0]
                for ring, of_ring in zip(rings, turns, strict=True)
            ]
            yield [np.array(self.size) / 2 + ring * self._degree for ring in degrees]


def _unwrapped(ring: np.ndarray) -> np.ndarray:
    """A ring or line whose long edges cross the 180th meridian instead.

    An edge of 360 degrees is one of a map that is cut there, and a ring that does not close any
    more goes around a pole: both stay as they are.
    """
    steps = np.diff(ring[:, 0])
    is_long = (np.abs(steps) > _LONGEST) & (np.abs(steps) < 360)
    turns = np.cumsum(-np.sign(steps) * is_long)
    if len(turns) and turns[-1] and (ring[0] == ring[-1]).all():
        return ring
    return ring + np.stack([360 * np.append(0, turns), np.zeros(len(ring))], axis=1)
