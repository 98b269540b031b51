"""What a slot in the air takes of the battery: one table of thousandths of a percent.

Each mission has a table by the speed of a UAV and by what it does. In still air all entries are one
percent. Sections of a scenario make other tables: ``Consumption`` gives the entries (a data sheet
has them from the power of a rotary wing), ``Wind`` adds what moves against it take. A battery is a
whole number of percents; each UAV carries the thousandths that it has spent of the next percent.

Where gusts blow, moves into different cells differ. What a gust takes is a pure function of the
seed and the cell, so it is computed where it is needed (``slot_cost_at``).
"""

import math
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from dess.base.descriptions import Description
from dess.base.elementary import cos, sin
from dess.base.kernels import inlined, kernel, shared_kernel
from dess.physics import streams
from dess.physics.section import Integer, Number, Section, for_sections

PERCENT = 1000  # the thousandths of one percent
MOST_COST = 11 * PERCENT  # the largest cost of a slot in ``Consumption``
MOST_WIND = 10  # the largest surcharge of a move in the mean wind [%]
SPEEDS = 8  # the most slots that a UAV takes for a cell (``dess.physics.fleet``)
ACTIONS = 5  # north, east, south, west and hovering
HOVERING = ACTIONS - 1
# The fields of ``MISSION`` that tell what slots take; ``slot_cost_at`` reads no others.
ENERGY = ("grid", "slot_costs", "pushes", "gusts", "gust_seed")
# What rounding may add to a cost [% / 1000]: a wind from the east is none from the north.
_ROUNDING = 1e-6

Cost = Annotated[Integer, Field(ge=1, le=2**15 - 1)]
Costs = tuple[Cost, Cost, Cost, Cost, Cost]
Moves = tuple[float, float, float, float]
Push = Annotated[Number, Field(ge=0, le=MOST_WIND)]


class Consumption(Section):
    """The battery that slots in the air take."""

    slots: tuple[Costs, ...] = Field(
        (),
        max_length=SPEEDS,
        description=Description(
            "battery that a slot takes, for UAVs that take 1, 2, ... slots for a cell",
            unit="% / 1000",
            form="[north, east, south, west, hover] for each, integers from 1 on",
        ),
    )

    def table(self) -> np.ndarray:
        """(S, 5) what slots take [% / 1000], for the speeds that the section has."""
        return np.array(self.slots, np.int64)


class Wind(Section):
    """A field of wind over the grid, drawn from its own seed and the same in all missions.

    The wind in a cell is the mean wind plus a gust. Its components are pushes: what the battery
    loses when the UAV moves one cell against them [%].
    """

    strength: Number = Field(
        0.0,
        ge=0,
        le=MOST_WIND,
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
        le=MOST_WIND,
        description=Description("standard deviation of the wind from cell to cell", unit="%"),
    )
    seed: Integer = Field(0, ge=0, le=2**32 - 1, description="seed of the field of wind")
    moves: tuple[Push, Push, Push, Push] = Field(
        (0.0, 0.0, 0.0, 0.0),
        description=Description(
            "battery that moves cost more beside this", unit="%", form="[north, east, south, west]"
        ),
    )

    @property
    def blows(self) -> bool:
        """Whether there is any wind; a seed or a direction alone make none."""
        return any((self.strength, self.gusts, *self.moves))

    def pushes(self) -> Moves:
        """What the mean wind takes of moves to the north, east, south and west [% per cell]."""
        towards = math.radians(self.direction)
        north, east, south, west = self.moves
        x = -self.strength * sin(towards)
        y = self.strength * cos(towards)
        return y + north, -x + east, -y + south, x + west

    def table(self) -> np.ndarray:
        """(S, 5) what slots take in the mean wind [% / 1000]."""
        costs = np.full((SPEEDS, ACTIONS), PERCENT, np.int64)
        for slots in range(1, SPEEDS + 1):
            for action, push in enumerate(self.pushes()):
                costs[slots - 1, action] = cost_against(push, slots)
        return costs


def energy_constants(
    consumption: Consumption, wind: Wind, size: tuple[int, int], slowest: int
) -> dict[str, Any]:
    """The fields of ``MISSION`` that tell what slots take.

    Args:
        consumption, wind: The sections of the scenario; at most one of them is on.
        size: Columns and rows of the grid.
        slowest: The most slots that a UAV of the fleet takes for a cell.
    """
    costs = np.full((SPEEDS, ACTIONS), PERCENT, np.int64)
    if consumption.is_on:
        costs[: len(consumption.slots)] = consumption.table()
    if wind.blows:
        costs = wind.table()
    most_expensive = costs[:slowest].max()
    if wind.gusts > 0:
        strongest = _strongest_push(wind.pushes(), wind.gusts, wind.seed, size)
        most_expensive = max(most_expensive, cost_against(strongest, 1))
    return {
        "has_costs": consumption.is_on or wind.blows,
        "slot_costs": costs.reshape(-1),
        "max_slot_cost": most_expensive,
        # In wind a UAV that waits hovers; where hovering may cost the most, any slot may.
        "waiting_slot": most_expensive if consumption.is_on else PERCENT,
        **_gust_constants(wind),
    }


def _gust_constants(wind: Wind) -> dict[str, Any]:
    """The fields that tell what slots take where gusts blow, and else are zero."""
    if wind.gusts == 0:
        return {}
    return {"pushes": wind.pushes(), "gusts": wind.gusts, "gust_seed": wind.seed}


@inlined
def cost_against(push, slots_per_cell):
    """What a slot of a move takes against a push [% / 1000]; a tail wind saves nothing.

    Args:
        push: What the wind takes of the whole move [%].
        slots_per_cell: The slots of the move, each of which takes a part of the push.
    """
    more = max(push, 0.0) * PERCENT / slots_per_cell
    return PERCENT + np.int64(math.ceil(more - _ROUNDING))


@inlined
def _push_at(mean, gusts, seed, action, cell):
    """What the wind takes of a move into a cell [%], less than 0 with a tail wind.

    Args:
        mean: What the mean wind takes.
        gusts: Standard deviation of the wind from cell to cell [% per cell].
        seed: Seed of the field.
        action: The move.
        cell: The number of the cell, counted row by row.
    """
    words = streams.block(seed, 0, streams.WIND, 0, 0, cell)
    if action == 0:
        return mean + gusts * streams.normal(words[1])
    if action == 1:
        return mean - gusts * streams.normal(words[0])
    if action == 2:
        return mean - gusts * streams.normal(words[1])
    return mean + gusts * streams.normal(words[0])


@lru_cache(maxsize=16)
def _strongest_push(pushes: Moves, gusts: float, seed: int, size: tuple[int, int]) -> float:
    """The most that the wind takes of a move into any cell [%]."""
    return float(_find_strongest_push(np.array(pushes), gusts, np.uint64(seed), size[0] * size[1]))


@kernel
def _find_strongest_push(pushes, gusts, seed, cells):
    strongest = 0.0
    for action in range(HOVERING):
        for cell in range(cells):
            strongest = max(strongest, _push_at(pushes[action], gusts, seed, action, cell))
    return strongest


@for_sections
def has_costs(mission):
    """Whether slots take anything else than one percent each."""
    return mission.has_costs


@inlined
def max_slot_cost(mission):
    """The most that a slot takes [% / 1000]."""
    return PERCENT + _more_at_most(mission)


@for_sections
def _more_at_most(mission):
    return mission.max_slot_cost - PERCENT


@inlined
def waiting_slot(mission):
    """The battery that the return guard counts for a slot of waiting [% / 1000]."""
    return PERCENT + _more_of_waiting(mission)


@for_sections
def _more_of_waiting(mission):
    return mission.waiting_slot - PERCENT


@inlined
def slot_cost(mission, slots_per_cell, action):
    """The battery that a slot takes without gusts [% / 1000].

    Args:
        mission: ``MISSION`` record.
        slots_per_cell: The slots that the UAV takes for a cell.
        action: What it does: a move, or hovering in the air.
    """
    return np.int64(mission.slot_costs[(slots_per_cell - 1) * ACTIONS + action])


@inlined
def slot_cost_at(mission, slots_per_cell, action, x, y):
    """The battery that a slot of a move into cell ``x, y`` takes, or of hovering [% / 1000]."""
    if _blows_in_gusts(mission) and action != HOVERING:
        return _slot_cost_in_gusts(mission, slots_per_cell, action, x, y)
    return slot_cost(mission, slots_per_cell, action)


@for_sections
def _blows_in_gusts(mission):
    return mission.gusts > 0.0


@shared_kernel
def _slot_cost_in_gusts(mission, slots_per_cell, action, x, y):
    cell = y * mission.grid + x
    push = _push_at(mission.pushes[action], mission.gusts, mission.gust_seed, action, cell)
    return cost_against(push, slots_per_cell)


@inlined
def move_cost(mission, slots_per_cell, action, x, y):
    """The battery that a whole move into cell ``x, y`` takes [% / 1000]."""
    return slots_per_cell * slot_cost_at(mission, slots_per_cell, action, x, y)


@kernel
def fill_move_costs(mission, slots_per_cell, moves):
    """Write what the moves north, east, south and west into all cells take [% / 1000].

    Args:
        mission: ``MISSION`` record.
        slots_per_cell: The slots that the UAV takes for a cell.
        moves: (4, H, W) the table to write.
    """
    for action in range(moves.shape[0]):
        for y in range(moves.shape[1]):
            for x in range(moves.shape[2]):
                moves[action, y, x] = move_cost(mission, slots_per_cell, action, x, y)


@inlined
def spend_slot(mission, u):
    """Take the cost of a slot in the air from the battery of a UAV; it is never below 0."""
    cost = slot_cost_at(mission, u.slots_per_cell, u.executed, u.x, u.y)
    spent = u.remainder + mission.flight_cost * cost
    u.battery = max(u.battery - spent // PERCENT, 0)
    u.remainder = spent % PERCENT


@inlined
def thousandths_left(u):
    """The battery of a UAV [% / 1000]."""
    return PERCENT * u.battery - u.remainder
