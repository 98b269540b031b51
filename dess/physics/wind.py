"""Wind: moves against it cost more battery, and so does the way to a parking cell.

The wind in a cell is the mean wind plus a gust. Its components are pushes: what the battery loses
when the UAV moves one cell against them [%]. ``dess.model.ways_home`` has the cheapest ways.
"""

import math
from functools import lru_cache
from typing import Annotated

import numpy as np
from pydantic import Field

from dess.base.descriptions import Description
from dess.base.elementary import cos, sin
from dess.base.kernels import inlined, kernel
from dess.physics import streams
from dess.physics.section import Integer, Number, Section, for_sections

MOST = 10  # the largest surcharge of a move in the mean wind [%]

Moves = tuple[float, float, float, float]
Push = Annotated[Number, Field(ge=0, le=MOST)]


class Wind(Section):
    """A field of wind over the grid, drawn from its own seed and the same in all missions."""

    strength: Number = Field(
        0.0,
        ge=0,
        le=MOST,
        description=Description(
            "battery that a move against the mean wind costs more", unit="%", note="0 for none"
        ),
    )
    direction: Number = Field(
        0.0,
        ge=0,
        le=360,
        description="where the mean wind comes from [degrees from north, clockwise]",
    )
    gusts: Number = Field(
        0.0,
        ge=0,
        le=MOST,
        description=Description("standard deviation of the wind from cell to cell", unit="%"),
    )
    seed: Integer = Field(0, ge=0, le=2**32 - 1, description="seed of the field of wind")
    moves: tuple[Push, Push, Push, Push] = Field(
        (0.0, 0.0, 0.0, 0.0),
        description=Description(
            "battery that moves cost more beside this", unit="%", form="[north, east, south, west]"
        ),
    )

    def pushes(self) -> Moves:
        """What the mean wind takes of moves to the north, east, south and west [% per cell]."""
        towards = math.radians(self.direction)
        north, east, south, west = self.moves
        x = -self.strength * sin(towards)
        y = self.strength * cos(towards)
        return y + north, -x + east, -y + south, x + west


@inlined
def surcharge(columns, north, east, south, west, gusts, seed, step_x, step_y, x, y):
    """The battery [%] that a move into cell ``x, y`` costs beyond that in still air.

    Batteries are integers, so a fraction is rounded up or down by a draw per cell; its expected
    value is the fraction. A tail wind saves nothing.

    Args:
        columns: Cells of the grid from west to east.
        north, east, south, west: What the mean wind takes of moves [% per cell].
        gusts: Standard deviation of the wind from cell to cell [% per cell].
        seed: Seed of the field.
        step_x, step_y: The step of the move [cells].
        x, y: The cell that the move leads to.
    """
    words = streams.block(seed, 0, streams.WIND, 0, 0, y * columns + x)
    mean = (south if step_y > 0 else north) if step_x == 0 else (east if step_x > 0 else west)
    along = streams.normal(words[0]) * step_x + streams.normal(words[1]) * step_y
    against = mean - gusts * along
    if against <= 0.0:
        return 0
    return int(math.floor(against + streams.uniform(words[2 if step_y == 0 else 3])))


@for_sections
def move_surcharge(mission, step_x, step_y, x, y):
    """The surcharge [%] of a move in a mission, 0 of no step; see ``surcharge``."""
    if mission.wind_most == 0 or (step_x == 0 and step_y == 0):
        return 0
    return surcharge(
        mission.grid, mission.wind_north, mission.wind_east, mission.wind_south, mission.wind_west,
        mission.wind_gusts, mission.wind_seed, step_x, step_y, x, y,
    )  # fmt: skip


@lru_cache(maxsize=16)
def surcharges(
    size: tuple[int, int], north: float, east: float, south: float, west: float, gusts: float,
    seed: int,
) -> np.ndarray:  # fmt: skip
    """(4, H, W) surcharges [%] of the moves north, east, south and west into cell ``y, x``."""
    columns, rows = size
    table = np.zeros((4, rows, columns), np.int64)
    if north or east or south or west or gusts:
        fill_surcharges(north, east, south, west, gusts, seed, table)
    table.flags.writeable = False
    return table


@kernel
def fill_surcharges(north, east, south, west, gusts, seed, table):
    """Write the (4, H, W) surcharges of ``surcharges`` into a table."""
    rows, columns = table.shape[1:]
    for action, (step_x, step_y) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
        for y in range(rows):
            for x in range(columns):
                table[action, y, x] = surcharge(
                    columns, north, east, south, west, gusts, seed, step_x, step_y, x, y
                )


# The fields of ``MISSION`` that describe the wind, in the order in which ``surcharges`` takes them.
FIELDS = tuple(f"wind_{name}" for name in ("north", "east", "south", "west", "gusts", "seed"))


def constants(wind: Wind, size: tuple[int, int]) -> dict[str, float]:
    """The fields of ``MISSION`` that describe the wind."""
    field = (*wind.pushes(), wind.gusts, wind.seed)
    return dict(zip(FIELDS, field, strict=True)) | {"wind_most": surcharges(size, *field).max()}
