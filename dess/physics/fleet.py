"""Types of UAVs, for fleets whose UAVs differ.

A UAV that takes s mission slots for a move holds the cell that it flies to from the first of them
on. Until it is there, it has nothing to decide.
"""

from collections.abc import Sequence
from math import lcm
from typing import Any

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from dess.base.descriptions import Description
from dess.base.kernels import inlined
from dess.physics.section import Integer, Number, Section

# What a type may give in units beside a data sheet (``dess.scenario.data_sheet``).
IN_UNITS = ("endurance", "charging", "cruise")


class UavType(Section):
    """A type of UAV; UAV i of a mission has type ``i % len(fleet)``."""

    flying_time: Integer | None = Field(
        None,
        ge=1,
        le=100,
        description=Description(
            "battery at the start", unit="%", note="without it, that of the scenario"
        ),
    )
    slots_per_cell: Integer = Field(
        1, ge=1, le=8, description="mission slots that a move to the next cell takes"
    )
    quota: Integer | None = Field(
        None,
        ge=1,
        le=1_000_000,
        description=Description(
            "communication slots that the UAV must fill", note="without it, those of the scenario"
        ),
    )
    rate: Number = Field(
        1.0, ge=0.001, le=1000, description="factor of the rate at which the UAV collects data"
    )
    endurance: str | None = Field(
        None,
        description="flying time of a full battery in still air, that of the data sheet at most",
        examples=["20 min"],
    )
    charging: str | None = Field(
        None, description="time to charge its battery from empty to full", examples=["25 min"]
    )
    cruise: str | None = Field(
        None,
        description=Description(
            "cruising speed over ground",
            form="that of the data sheet, or a half, a third, ... of it",
        ),
        examples=["7.5 m/s"],
    )

    price: Number | None = Field(
        None,
        ge=0,
        le=10**12,
        description=Description(
            "price of a UAV of this type", note="without it, that of the question: uav"
        ),
    )

    @model_serializer(mode="wrap")
    def _without_what_is_not_given(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out price and units that are not given, and what follows from the others."""
        values = handler(self)
        off = {name for name in (*IN_UNITS, "price") if getattr(self, name) is None}
        if self.cruise is not None:
            off.add("slots_per_cell")
        return {name: value for name, value in values.items() if name not in off}


Fleet = Sequence[UavType]


def type_of(fleet: Fleet, uav: int) -> UavType:
    """The type of a UAV by its index."""
    if fleet:
        return fleet[uav % len(fleet)]
    return UavType.off()


def slowest(fleet: Fleet) -> int:
    """The most slots that a UAV takes for a cell."""
    return max((kind.slots_per_cell for kind in fleet), default=1)


def move_phases(fleet: Fleet) -> int:
    """The number of phases of moves: their mission slots, for each speed up to the slowest.

    A move that takes s slots has s phases (``move_phase``).
    """
    return slowest(fleet) * (slowest(fleet) + 1) // 2


def places_per_slot(fleet: Fleet) -> int:
    """The least number L so that each UAV flies a whole number of (1/L) cells in a mission slot."""
    return lcm(*(kind.slots_per_cell for kind in fleet))


@inlined
def move_phase(u):
    """The phase of a UAV's move in the present slot, from 0 on; the only one of s = 1 is 0."""
    s = u.slots_per_cell
    return s * (s - 1) // 2 + s - 1 - u.slots_left


@inlined
def continue_move(u):
    """Whether a UAV is in the middle of a move; if so, let it fly on for one slot."""
    if u.slots_left == 0:
        return False
    u.slots_left -= 1
    u.action = u.executed
    u.overruled = False
    return True


@inlined
def begins_move(u):
    """Whether a UAV that moves begins its move in the present slot."""
    return u.slots_left == u.slots_per_cell - 1


def share_of_move(m: int, u: Any, n: int) -> float:
    """The share of its move that is behind a UAV at communication slot ``n`` = 1..m."""
    s = u.slots_per_cell
    return ((s - 1 - u.slots_left) * m + n) / (s * m)
