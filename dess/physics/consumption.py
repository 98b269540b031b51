"""What a slot in the air takes of the battery, by the move: thousandths of a percent.

Without the section a slot takes one percent, and the wind may take more of a move
(``dess.physics.wind``). With it each move and hovering have a cost of their own, below or above one
percent. A battery is still a whole number of percents; each UAV carries the thousandths that it has
spent of the next percent.
"""

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from dess.base.descriptions import Description
from dess.base.kernels import inlined
from dess.physics.section import Integer, Section, for_sections

PERCENT = 1000  # the thousandths of one percent
MOST = 11 * PERCENT  # the largest cost of a slot
SPEEDS = 8  # the most slots that a UAV takes for a cell (``dess.physics.fleet``)
ACTIONS = 5  # north, east, south, west and hovering

Cost = Annotated[Integer, Field(ge=1, le=2**15 - 1)]
Costs = tuple[Cost, Cost, Cost, Cost, Cost]


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

    def constants(self, slowest: int) -> dict[str, Any]:
        """The fields of ``MISSION`` that the section sets.

        Args:
            slowest: The most slots that a UAV of the fleet takes for a cell.
        """
        costs = [0] * (SPEEDS * ACTIONS)
        costs[: len(self.slots) * ACTIONS] = [cost for row in self.slots for cost in row]
        return {
            "has_consumption": self.is_on,
            "slot_costs": costs,
            "dearest_slot": max(costs[: slowest * ACTIONS]),
        }


@for_sections
def has_consumption(mission):
    """Whether each move and hovering have a cost of their own."""
    return mission.has_consumption


@inlined
def slot_cost(mission, slots_per_cell, action):
    """The battery that a slot takes [% / 1000], in missions with the section.

    Args:
        mission: ``MISSION`` record.
        slots_per_cell: The slots that the UAV takes for a cell.
        action: What it does: a move, or hovering in the air.
    """
    return np.int64(mission.slot_costs[(slots_per_cell - 1) * ACTIONS + action])


@for_sections
def spend_slot(mission, u):
    """Take the cost of a slot in the air from the battery of a UAV; it is never below 0."""
    spent = u.remainder + mission.flight_cost * slot_cost(mission, u.slots_per_cell, u.executed)
    u.battery = max(u.battery - spent // PERCENT, 0)
    u.remainder = spent % PERCENT


@for_sections
def thousandths_left(mission, u):
    """The battery of a UAV [% / 1000], in missions with the section."""
    return PERCENT * u.battery - u.remainder
