"""The battery of a data sheet: what a slot is, and what flying, wind and charging take of it."""

import math
from fractions import Fraction
from typing import NamedTuple

from dess.base.errors import InputError, shown
from dess.physics.energy import PERCENT, SPEEDS, Costs
from dess.scenario.data_sheet.quantities import AT_SPEED, Quantities
from dess.scenario.quantities import exactly, measured, printed
from dess.scenario.rotary_wing import COURSES, RotaryWing, airspeed_along, largest_speed

MOST_TIME = 1e12  # the longest times [slots]


class Units(NamedTuple):
    """What a slot, a cell and a data unit of a scenario are.

    Attributes:
        slot: A mission slot [s].
        cell: The side of a cell [m].
        data: A data unit [bit].
    """

    slot: float
    cell: float
    data: float

    def __str__(self) -> str:
        """How coarse they are, in words."""
        data = f"a data unit {printed(self.data, 'bit')}"
        return f"a slot is {printed(self.slot, 's')}, a cell {printed(self.cell, 'm')}, {data}"


class Power(Quantities):
    """The battery of the UAVs of a data sheet."""

    @property
    def units(self) -> Units:
        """What a slot, a cell and a data unit are."""
        bandwidth = self.number("bandwidth")
        if self.cell:
            slot = self.number("cell") / self.number("cruise")
            return Units(slot, self.number("cell"), slot * bandwidth)
        slot = self.endurance_at_cruise / 100
        return Units(slot, slot * self.number("cruise"), slot * bandwidth)

    @property
    def slot_of_cruising(self) -> Fraction:
        """The battery that a slot of cruising takes in still air [%], exactly as typed."""
        if not self.cell:
            return Fraction(1)
        assert self.cruise
        slot = exactly(self.cell, "m")[0] / exactly(self.cruise, "m/s")[0]
        return 100 * slot / self.exact_endurance

    @property
    def charge_rate(self) -> Fraction:
        """The battery that a charging slot adds [%], exactly as the times were typed."""
        assert self.charging
        return self.slot_of_cruising * self.exact_endurance / exactly(self.charging, "s")[0]

    @property
    def exact_endurance(self) -> Fraction:
        """``endurance_at_cruise``, exactly as it was typed if it is given for the cruise."""
        assert self.endurance
        if self._endurance_at:
            return Fraction(self.endurance_at_cruise)
        return exactly(self.endurance, "s")[0]

    @property
    def wing(self) -> RotaryWing:
        """The rotary wing of the UAVs, whose drag follows from the hovering time."""
        wing = RotaryWing(self.number("tip_speed"), self.number("induced_speed"))
        if not self.hover:
            return wing
        endurance, speed = self._endurance_at or (self.number("endurance"), self.number("cruise"))
        wing = wing.with_power(speed, self.number("hover") / endurance)
        if wing.drag < 0:
            least = wing.power_without_drag(speed) * endurance
            problem = f"is too short for {shown(self.endurance)} of flight"
            allowed = f"{printed(least, 's')} and more, or a smaller induced_speed"
            self.refuse("hover", problem, allowed)
        return wing

    @property
    def endurance_at_cruise(self) -> float:
        """The flying time of a full battery at the cruising speed in still air [s]."""
        if not self._endurance_at:
            return self.number("endurance")
        endurance, speed = self._endurance_at
        wing = self.wing
        return endurance * wing.power(speed) / wing.power(self.number("cruise"))

    @property
    def hovering_time(self) -> float:
        """The hovering time of a full battery in still air [s]."""
        return self.endurance_at_cruise * self.wing.power(self.number("cruise"))

    @property
    def delivery_ms(self) -> int:
        """The time until a lost UAV is replaced where no spare is left [ms]."""
        return round(1000 * self.number("delivery"))

    @property
    def _endurance_at(self) -> tuple[float, float] | None:
        """The flying time [s] and the speed for which it is given [m/s]; None for the cruise."""
        if self.endurance and " at " in self.endurance:
            endurance, speed = measured(self.endurance, AT_SPEED)
            return endurance, speed
        return None

    def costs(self) -> tuple[Costs, ...]:
        """What slots take of the battery, for UAVs that take 1, 2, ... slots for a cell.

        Returns:
            For each of them the costs of the moves north, east, south and west and of hovering, in
            thousandths of a percent, rounded up.
        """
        wind, direction = 0.0, 0.0
        if self.wind:
            wind, direction = measured(self.wind, "m/s from deg")
        wing = self.wing
        of_cruising = float(PERCENT * self.slot_of_cruising)
        costs = []
        for slots in range(1, SPEEDS + 1):
            speed = self.number("cruise") / slots
            airspeeds = [airspeed_along(course, speed, wind, direction) for course in COURSES]
            of_cruise = wing.power(speed)
            shares = [wing.power(airspeed) / of_cruise for airspeed in (*airspeeds, wind)]
            # A share that is whole but for the rounding of floats is not rounded up.
            north, east, south, west, hover = (
                max(math.ceil(of_cruising * share - 1e-6), 1) for share in shares
            )
            costs.append((north, east, south, west, hover))
        return tuple(costs)

    def slots(self, name: str, most: float = MOST_TIME) -> float:
        """A time in slots, of which there are at least one and no more than ``most``."""
        return self.slots_of(name, getattr(self, name), most)

    def slots_of(self, name: str, time: str, most: float) -> float:
        """The same of a time that is not that of the sheet; ``name`` is its field."""
        slot = self.units.slot
        slots = measured(time, "s")[0] / slot
        least = printed(slot, "s")
        if slots < 1:
            problem = f"{shown(time)} is less than a slot of {least}"
            raise InputError(name, problem, f"{least} or more")
        if slots > most:
            problem = f"{shown(time)} is {slots:,.0f} slots of {least}"
            raise InputError(name, problem, f"{printed(most * slot, 's')} at most")
        return slots

    def strongest_wind(self, direction: float) -> float:
        """The strongest wind [m/s] from a direction [deg] in which all moves are possible.

        It is rounded down to 0.01 m/s.
        """
        largest = largest_speed(self.number("cruise"), direction, self.number("max_speed"))
        return _rounded_down(largest)

    def check_speeds(self) -> None:
        """Refuse a largest airspeed below the cruising speed, and a wind that it cannot fly in."""
        if not self.max_speed:
            return
        cruise = self.number("cruise")
        most = self.number("max_speed")
        if most < cruise:
            self.refuse("max_speed", f"is less than the cruise {self.cruise}", str(self.cruise))
        if not self.wind:
            return
        wind, direction = measured(self.wind, "m/s from deg")
        strongest = self.strongest_wind(direction)
        if wind > strongest:
            fastest = _rounded_down(largest_speed(wind, direction, most))
            problem = f"is too strong for {self.cruise} over ground and {self.max_speed} in the air"
            allowed = f"{strongest:g} m/s from there at most"
            if fastest > 0:
                allowed += f", or a cruise of {fastest:g} m/s at most"
            self.refuse("wind", problem, allowed)


def _rounded_down(speed: float) -> float:
    """A speed rounded down to 0.01 m/s."""
    return math.floor(100 * speed) / 100
