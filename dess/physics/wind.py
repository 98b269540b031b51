"""Wind: moves against it cost more battery, and so does the way to a parking cell.

The wind in a cell is the mean wind plus a gust. Its components are pushes: what the battery loses
when the UAV moves one cell against them [%]. The cost of a way depends on the wind and on the speed
of the UAV; a table has the cheapest way from every cell (Bellman and Ford's algorithm)::

    table = reach_of(view.state.missions, view.world.chart)
    table[c, s - 1, y, x]       # [%] to parking cell c, for a UAV that takes s slots per cell

Without wind and slow UAVs there is no table.
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
from dess.physics.chart import NO_FLY, Chart, read_only
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


def moves_in(wind: float, direction: float, cruise: float) -> Moves:
    """What a wind from a direction [degrees] takes of the four moves [% per cell].

    The ground speed along a move is what the wind adds along it, and what the cruising speed has
    left when it holds against the wind across it.

    Args:
        wind, cruise: Speeds [m/s]; the wind must not be above ``largest_wind``.
        direction: Where the wind comes from [degrees from north, clockwise].
    """
    extra_slots = []
    for course in (0, 90, 180, 270):
        angle = math.radians(direction - course)
        ground = _along(cruise, wind, angle)
        extra_slots.append(max(cruise / ground - 1, 0.0))
    north, east, south, west = extra_slots
    return north, east, south, west


def largest_wind(direction: float, cruise: float) -> float:
    """The wind [m/s] in which a move against it costs ``MOST`` percent more (law of cosines)."""
    ground = cruise / (MOST + 1)
    turn = math.radians(direction % 90)
    angle = min(turn, math.pi / 2 - turn)
    return _along(cruise, ground, angle)


def _along(cruise: float, speed: float, angle: float) -> float:
    """What a cruising speed has left along a course, with so much speed at an angle to it."""
    across = speed * sin(angle)
    return math.sqrt(cruise * cruise - across * across) - speed * cos(angle)


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


FAR = 2**15 - 1  # [%]: further than any cell
_MOST_ENTRIES = 2**26  # 128 MB


# The table of extended missions without wind and slow UAVs, which needs none.
_CALM = read_only(np.zeros((0, 0, 0, 0), np.int16))


@inlined
def is_calm(reach):
    """Whether every cell costs one percent, by the table of ``reach_of``."""
    return reach is None or len(reach) == 0


def reach_of(missions: np.ndarray, chart: Chart) -> np.ndarray | None:
    """(C, S, H, W) battery [%] to each of C parking cells, for 1 to S slots per cell.

    If every cell costs one percent, C is 0, or the table is None in missions without sections, so
    that the compiler leaves out its code. If it would be larger than 128 MB, S is 0: then every
    cell may cost the most.

    Args:
        missions: (B,) ``MISSION`` records of one batch, which share wind and fleet.
        chart: Their chart.
    """
    if "is_plain" in (missions.dtype.names or ()):  # neither wind nor slow UAVs
        return None
    if missions[0]["wind_most"] == 0 and missions[0]["slowest"] == 1:
        return _CALM
    return _table(missions, chart, len(chart.parking))


def ways_home(missions: np.ndarray, chart: Chart) -> np.ndarray:
    """(S, H, W) battery [%] from each cell to the nearest zone cell, for 1 to S slots per cell.

    Args:
        missions: (B,) ``MISSION`` records of one batch, which share wind and fleet.
        chart: Their chart.
    """
    return _table(missions, chart, 1)[0]


def _table(missions: np.ndarray, chart: Chart, groups: int) -> np.ndarray:
    """(G, S, H, W) battery [%] to the nearest of each of G groups of parking cells."""
    sea = (chart.zones.shape, chart.zones.tobytes(), chart.parking.tobytes())
    return _filled(*sea, groups, *(missions[0][field].item() for field in ("slowest", *FIELDS)))


@lru_cache(maxsize=16)
def _filled(
    shape: tuple[int, int], zones: bytes, parking: bytes, groups: int, slowest: int, *wind
) -> np.ndarray:
    cells = np.frombuffer(zones, np.int8).reshape(shape)
    if groups * slowest * cells.size > _MOST_ENTRIES:
        return read_only(np.zeros((groups, 0, 0, 0), np.int16))
    table = np.full((groups, slowest, *shape), FAR, np.int16)
    extras = surcharges(shape[::-1], *wind)
    for group, homes in enumerate(np.frombuffer(parking, np.int64).reshape(groups, -1, 2)):
        table[group, :, homes[:, 1], homes[:, 0]] = 0
        for s in range(slowest):
            relax(cells, extras, s + 1, table[group, s])
    return read_only(table)


@kernel
def relax(zones, extras, slots, costs):
    """Lower the costs of all cells to those of the cheapest ways to the cell that costs nothing."""
    rows, columns = zones.shape
    changed, forth = True, True
    while changed:
        changed = False
        for place in range(zones.size):
            cell = place if forth else zones.size - 1 - place
            y = cell // columns
            x = cell % columns
            if zones[y, x] == NO_FLY:
                continue
            for action, (step_x, step_y) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
                a = x + step_x
                b = y + step_y
                if 0 <= a < columns and 0 <= b < rows and costs[b, a] < FAR:
                    cost = min(costs[b, a] + slots + extras[action, b, a], FAR - 1)
                    if cost < costs[y, x]:
                        costs[y, x] = cost
                        changed = True
        forth = not forth
