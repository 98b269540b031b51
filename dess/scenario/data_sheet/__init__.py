"""The data sheet of a mission in units, and the fields of a scenario that follow from it.

    [data_sheet]                # in the TOML file of a scenario
    endurance = "35 min"
    cruise = "15 m/s"

A full battery is 100 slots of cruising in still air: a slot is the hundredth part of the endurance,
a cell the way of a slot at cruising speed, and a data unit what the bandwidth carries in a slot at
1 bit/s/Hz. The cruising speed is the ground speed, which autopilots hold in a mission; what a slot
takes of the battery follows from the speed through the air (``dess.scenario.rotary_wing``).
"""

from statistics import fmean
from typing import Any, Self

from pydantic import model_validator

from dess.base.errors import InputError, shown
from dess.physics.energy import MOST_COST, PERCENT
from dess.physics.fleet import UavType
from dess.scenario.data_sheet.defaults import ASSUMED
from dess.scenario.data_sheet.power import MOST_TIME, Units
from dess.scenario.data_sheet.quantities import LORA
from dess.scenario.data_sheet.radio import LINK_BUDGET, Radio
from dess.scenario.data_sheet.types import MOST_CHARGING, Types
from dess.scenario.quantities import measured, printed

__all__ = ["LINK_BUDGET", "LORA", "OPEN", "DataSheet", "Units"]

_NEEDED = ("endurance", "cruise", "charging", "bandwidth")
MOST_REPAIR = 1e6  # the longest repairs [slots]

# From what in the sheet a field of the scenario follows; each is refused in the words of the sheet.
_ORIGINS = {
    "cell_size": ("cell", "endurance", "cruise"),
    "charge_rate": ("cell", "endurance", "charging"),
    "arrival_rate": ("data_rate", "bandwidth"),
    "arrivals.rates": ("data_rate", "bandwidth"),
    "arrivals.message": ("message", "endurance", "bandwidth"),
    "radio.steps": ("modulation", "rates", "bandwidth", "packet"),
    "initial_data": ("backlog", "endurance", "bandwidth"),
    "arrivals.initial": ("backlog", "endurance", "bandwidth"),
    "edge_snr": ("snr", *LINK_BUDGET, "free_space", "bandwidth"),
}

# The fields that a scenario with a sheet may set otherwise; what slots take is another table in a
# window of weather.
OPEN = ("flying_time", "charge_start", "charge_complete", "landing", "quota", "consumption.slots")


class DataSheet(Types, Radio):
    """What an engineer knows of the UAVs, the radio and the nodes, each with its unit."""

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        """A scenario can follow; ``data_rate`` may still come from the file of the nodes."""
        if self.is_on:
            has_budget = any(getattr(self, name) for name in LINK_BUDGET)
            if has_budget and self.snr:
                raise InputError("snr", "follows from tx_power", "one of both")
            needed = [*_NEEDED, "snr"]
            if has_budget:
                needed = [*_NEEDED, *LINK_BUDGET]
            if self.repair:
                needed.append("mtbf")
            if self.pad_repair:
                needed.append("pad_mtbf")
            if self.wind:
                needed.append("max_speed")
            for name in needed:
                if getattr(self, name) is None:
                    raise InputError(name, "is missing", self.form_of(name))
            self.fields()
        return self

    @property
    def assumed(self) -> dict[str, str]:
        """What the sheet does not say, and is assumed."""
        unused = {"delivery"}  # of years with weather alone
        if self.modulation == LORA or self.rates:
            unused.add("max_rate")
        if self.rates:
            unused.add("modulation")
        if self.snr:
            unused.add("free_space")
        assumed = {
            name: value
            for name, value in ASSUMED.items()
            if name not in unused and getattr(self, name) is None
        }
        if not self.hover:
            assumed["hover"] = printed(self.hovering_time, "s")
        return assumed

    def fields(self) -> dict[str, Any]:
        """The fields of a scenario that follow, those of sections dotted.

        Raises:
            InputError: If slots and cells are too coarse or too fine for the sheet.
        """
        full = self.battery_of_type(UavType.off())
        self.slots("charging", MOST_CHARGING)
        gain = self.charge_rate
        following: dict[str, Any] = {
            "cell_size": self.units.cell,
            "slot_length": 1.0,
            "landing": True,
            "quota": 0,
            "flying_time": full,
            "charge_start": 30,
            "charge_complete": full,
            "charge_rate": int(gain) if gain.denominator == 1 else float(gain),
            **self._data(),
            **self.radio_fields(),
        }
        if self.horizon:
            following["max_slots"] = int(self.slots("horizon", 100_000) + 1e-9)
        self.check_speeds()
        following["consumption.slots"] = self.costs()
        if max(following["consumption.slots"][0]) > MOST_COST:
            problem = f"a slot takes {max(following['consumption.slots'][0]) / PERCENT:.1f} %"
            raise InputError("max_speed", problem, f"{MOST_COST // PERCENT} % at most")
        if self.mtbf:
            following["failures.uav_rate"] = 1 / self.slots("mtbf")
            following["failures.uav_repair"] = 0.0
            if self.repair:
                following["failures.uav_repair"] = self.slots("repair", MOST_REPAIR)
        if self.pad_mtbf:
            following |= self._pad_failures()
        return following

    def _pad_failures(self) -> dict[str, Any]:
        """How often pads fail, and how long they are repaired: for all zones, or for each."""
        following: dict[str, Any] = {"failures.pad_rate": 0.0, "failures.pad_repair": 0.0}
        if isinstance(self.pad_mtbf, str):
            following["failures.pad_rate"] = 1 / self.slots("pad_mtbf")
        else:
            means = [self.slots_of("pad_mtbf", time, MOST_TIME) for time in self.pad_mtbf or ()]
            following["failures.pad_rates"] = tuple(1 / mean for mean in means)
        if isinstance(self.pad_repair, str):
            following["failures.pad_repair"] = self.slots("pad_repair", MOST_REPAIR)
        elif self.pad_repair:
            means = [self.slots_of("pad_repair", time, MOST_REPAIR) for time in self.pad_repair]
            following["failures.pad_repairs"] = tuple(means)
        return following

    def origin(self, field: str) -> str:
        """From what in the sheet a field of the scenario follows, as it was typed."""
        values = {name: getattr(self, name) for name in _ORIGINS.get(field, ())}
        named = [f"{name} {shown(value)}" for name, value in values.items() if value]
        return ", ".join(named) or "the data sheet"

    def _data(self) -> dict[str, Any]:
        """New data, their messages, and initial data [data units]."""
        message = self.number("message") / self.units.data
        fields: dict[str, Any] = {"initial_data": (0.0, 0.0), "arrivals.message": message}
        if self.data_rate:
            mean, of_nodes = self._of_nodes("data_rate", self.number("bandwidth"))
            fields |= {"arrival_rate": mean, "arrivals.rates": of_nodes}
        if self.backlog:
            mean, of_nodes = self._of_nodes("backlog", self.units.data)
            fields |= {"initial_data": (mean, mean), "arrivals.initial": of_nodes}
        return fields

    def _of_nodes(self, name: str, size: float) -> tuple[float, tuple[float, ...]]:
        """The mean of a field of the nodes in units of a size, and each if they are listed."""
        amount = getattr(self, name)
        units = self.extra(name)["units"]
        texts = amount
        if isinstance(amount, str):
            texts = (amount,)
        values = tuple(measured(text, units)[0] / size for text in texts)
        return fmean(values), () if isinstance(amount, str) else values
