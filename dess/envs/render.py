"""A picture of the present state of one mission, for the environment's ``render``."""

from typing import Any

import numpy as np

from dess.base.libraries import needs
from dess.model.state import State
from dess.physics.chart import NO_FLY
from dess.scenario.scenario import ScenarioSpace

_CELL = 16  # pixels
_SEA = (233, 241, 247)
_LINES = (212, 224, 234)
_ZONE = (190, 205, 190)
_LAND = (214, 205, 186)
_NO_DATA = np.array((255, 255, 255))
_FULL = np.array((31, 78, 121))
_IDLE = (255, 255, 255)
_CHARGING = (0, 0, 0)
# Colours for colour-blind readers, after Okabe and Ito.
_FLEET = ((213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233))


def draw(space: ScenarioSpace, state: State, environment: int = 0) -> np.ndarray:
    """Draw the zones, the no-fly cells, the nodes and the active UAVs of one mission.

    A node is darker the more data it has. A UAV that charges has a black frame.

    Args:
        space: The scenario of the mission.
        state: The state that contains the mission.
        environment: The index of the mission in the state.

    Returns:
        An image of shape (16 H, 16 W, 3) and type uint8 of W x H cells, with north on top.
    """
    uavs = state.uavs[environment]
    residual = state.residual[environment]
    cells = np.full((*space.chart.zones.shape, 3), _SEA, np.uint8)
    cells[space.chart.zones >= 0] = _ZONE
    cells[space.chart.zones == NO_FLY] = _LAND
    image = cells.repeat(_CELL, 0).repeat(_CELL, 1)
    image[::_CELL] = image[:, ::_CELL] = _LINES
    full = max(space.initial_data[1], float(residual.max()), 1.0)
    for (x, y), data in zip(space.nodes, residual, strict=True):
        _square(image, x, y, 3, _FULL)
        _square(image, x, y, 4, _NO_DATA + (_FULL - _NO_DATA) * (data / full))
    for i, u in enumerate(uavs):
        if u["active"]:
            _square(image, u["x"], u["y"], 1, _CHARGING if u["charging"] else _IDLE)
            _square(image, u["x"], u["y"], 3, _FLEET[i % len(_FLEET)])
    return image


class Window:
    """Shows pictures in a window of matplotlib, one after the other."""

    def __init__(self) -> None:
        """Open the window.

        Raises:
            MissingLibraryError: If matplotlib is not installed.
        """
        needs("reports", "render_mode 'human'")
        from matplotlib import pyplot

        self._pyplot = pyplot
        self._figure, self._axes = pyplot.subplots()
        self._axes.axis("off")

    def show(self, picture: np.ndarray, seconds: float) -> None:
        """Show a picture for this time [s] at least."""
        for image in self._axes.images:
            image.remove()
        self._axes.imshow(picture)
        if self._pyplot.get_backend() != "agg":  # which matplotlib takes where there is no screen
            self._pyplot.pause(seconds)

    def close(self) -> None:
        """Close the window."""
        self._pyplot.close(self._figure)


def _square(image: np.ndarray, x: int, y: int, margin: int, colour: Any) -> None:
    """Paint a cell, except for a margin [pixels] at its edges."""
    top = y * _CELL + margin
    left = x * _CELL + margin
    size = _CELL + 1 - 2 * margin
    image[top : top + size, left : left + size] = colour
