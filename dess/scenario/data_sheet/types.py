"""The types of UAVs beside a data sheet, whose times and speeds are in units too."""

import math
from fractions import Fraction
from typing import Any

from dess.base.errors import InputError, shown
from dess.physics.energy import SPEEDS
from dess.physics.fleet import IN_UNITS, UavType
from dess.scenario.data_sheet.power import Power
from dess.scenario.data_sheet.quantities import AT_SPEED
from dess.scenario.quantities import exactly, measured

MOST_CHARGING = 10_000  # the slots in which an empty battery is charged
_NEGLIGIBLE = Fraction(1, 10**11)  # the error of an endurance that is computed

# The cruising speed of a type goes a whole number of times into that of the sheet, but for a share
# of so much: so a third of 10 m/s can be typed.
_ROUNDED = Fraction(1, 1000)


class Types(Power):
    """What types of UAVs have in terms of a data sheet."""

    def type_in_slots(self, table: dict[str, Any]) -> dict[str, Any]:
        """What follows from the fields of a type of UAVs that are in units.

        Args:
            table: The fields of the type as they were given; those of other types than text are
                refused where the table is validated.

        Returns:
            The other fields of the type that follow.

        Raises:
            InputError: If a field is no quantity of its kind, if the type is longer in the air or
                faster than the sheet, or if what follows is given as well.
        """
        quantities = {name: table[name] for name in IN_UNITS if table.get(name) is not None}
        for name, value in quantities.items():
            try:
                self.check(name, value)
            except InputError as error:
                raise error.within(name) from None
        if not all(isinstance(value, str) for value in quantities.values()):
            return {}
        for name, other in (("flying_time", "endurance"), ("slots_per_cell", "cruise")):
            if other in quantities and table.get(name) is not None:
                raise InputError(name, f"is given beside {other}", "one of both")
        kind = UavType.model_validate(quantities)
        self.battery_of_type(kind)
        if kind.charging:
            self.slots_of("charging", kind.charging, MOST_CHARGING)
        if kind.cruise:
            return {"slots_per_cell": self._slots_per_cell_of(kind)}
        return {}

    def battery_of_type(self, kind: UavType) -> int:
        """The battery of a type of UAVs when it is full, less its reserve [%]."""
        share = self.share_of_type(kind)
        if share > 1 + _NEGLIGIBLE:
            problem = f"{shown(kind.endurance)} is longer than that of the data sheet"
            raise InputError("endurance", problem, f"{self.endurance} at most")
        reserve = exactly(self.reserve or "0 %", "percent")[0]
        return math.floor((share + _NEGLIGIBLE) * (100 - reserve))

    def share_of_type(self, kind: UavType) -> Fraction:
        """The full battery of a type of UAVs, its reserve included, in terms of the sheet's."""
        if not kind.endurance:
            return Fraction(1)
        return self._endurance_of_type(kind) / self.exact_endurance

    def charge_rate_of_type(self, kind: UavType) -> Fraction:
        """What a charging slot adds to a type of UAVs, exactly as the times were typed.

        A type that gives ``charging`` is charged in this time from its own empty to its own full;
        others gain what the sheet says.

        Returns:
            The rate in percent of the battery of the sheet.
        """
        if not kind.charging:
            return self.charge_rate
        endurance = self.exact_endurance
        if kind.endurance:
            endurance = self._endurance_of_type(kind)
        return self.slot_of_cruising * endurance / exactly(kind.charging, "s")[0]

    def _endurance_of_type(self, kind: UavType) -> Fraction:
        """The flying time of a type of UAVs at its cruising speed in still air [s]."""
        assert kind.endurance
        if " at " not in kind.endurance:
            return exactly(kind.endurance, "s")[0]
        endurance, speed = measured(kind.endurance, AT_SPEED)
        cruise = self.number("cruise") / self._slots_per_cell_of(kind)
        return Fraction(endurance * self.wing.power(speed) / self.wing.power(cruise))

    def _slots_per_cell_of(self, kind: UavType) -> int:
        """The slots that a type of UAVs takes for a cell."""
        if not kind.cruise:
            return kind.slots_per_cell
        assert self.cruise
        fastest = exactly(self.cruise, "m/s")[0]
        ratio = fastest / exactly(kind.cruise, "m/s")[0]
        slots = round(ratio)
        if ratio < 1 - _ROUNDED:
            problem = f"{shown(kind.cruise)} is faster than that of the data sheet"
            raise InputError("cruise", problem, f"{self.cruise} at most")
        if ratio > SPEEDS * (1 + _ROUNDED):
            problem = f"{shown(kind.cruise)} is less than an eighth of {self.cruise}"
            raise InputError("cruise", problem, f"{float(fastest / SPEEDS):.4g} m/s or more")
        if abs(ratio - slots) > slots * _ROUNDED:
            nearest = [
                f"{float(fastest / n):.4g} m/s" for n in (math.floor(ratio), math.ceil(ratio))
            ]
            problem = f"{shown(kind.cruise)} does not go into {self.cruise} a whole number of times"
            raise InputError("cruise", problem, " or ".join(nearest))
        return slots
