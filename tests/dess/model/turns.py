"""The symmetries of a sea."""

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from dess.model.state import STEP_X, STEP_Y
from dess.scenario.scenario import ScenarioSpace
from tests.drawn import Cell

STEPS = list(zip(STEP_X.tolist(), STEP_Y.tolist(), strict=True))


class Turn(NamedTuple):
    """One of the eight symmetries of a sea of W x H cells: x and y change places, then mirrors."""

    transposed: bool
    west_east: bool
    north_south: bool
    size: tuple[int, int]

    @classmethod
    def all_of(cls, space: ScenarioSpace) -> "list[Turn]":
        return [cls(*flags, space.size) for flags in product((False, True), repeat=3)]

    @property
    def turned_size(self) -> tuple[int, int]:
        return self.size[::-1] if self.transposed else self.size

    def cell(self, x: Any, y: Any) -> Cell:
        """Where a cell is then; or cells, by arrays of their columns and rows."""
        width, height = self.turned_size
        x, y = (y, x) if self.transposed else (x, y)
        return width - 1 - x if self.west_east else x, height - 1 - y if self.north_south else y

    def rectangle(self, x: int, y: int, width: int, height: int) -> tuple[int, ...]:
        corners = self.cell(x, y), self.cell(x + width - 1, y + height - 1)
        (left, top), (right, bottom) = map(min, *corners), map(max, *corners)
        return left, top, right - left + 1, bottom - top + 1

    @property
    def actions(self) -> np.ndarray:
        """Which action an action becomes."""
        x, y = self.cell(0, 0)
        turned = [(a - x, b - y) for a, b in (self.cell(*step) for step in STEPS)]
        return np.array([STEPS.index(step) for step in turned])

    def sea(self, space: ScenarioSpace) -> ScenarioSpace:
        """The sea turned; the wind blows from where an action of its direction leads."""
        grid, rows = self.turned_size
        comes_from = self.actions[int(space.wind.direction) // 90]
        return ScenarioSpace.of(
            space,
            **{"grid": grid, "rows": rows, "zone": self.rectangle(*space.zone)},
            zones=[{"cells": self.rectangle(*z.cells), "pads": z.pads} for z in space.zones],
            nodes=[self.cell(*node) for node in space.nodes],
            no_fly=[self.cell(*cell) for cell in space.no_fly],
            **{"wind.direction": 90.0 * comes_from},
        )
