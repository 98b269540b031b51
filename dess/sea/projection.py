"""Places on the Earth on the grid of a sea.

Degrees of WGS 84 are projected with the local equirectangular projection about a point, which
becomes the centre of the grid (J. P. Snyder, Map projections: a working manual, U.S. Geological
Survey 1987).
"""

import math
from typing import NamedTuple, Self

import numpy as np

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
