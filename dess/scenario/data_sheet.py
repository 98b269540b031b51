"""The data sheet of a mission in units, and the fields of a scenario that follow from it.

    [data_sheet]                # in the TOML file of a scenario
    endurance = "35 min"
    cruise = "15 m/s"

A full battery is 100 slots: a slot is the hundredth part of the endurance, a cell the way of a slot
at cruising speed, and a data unit what the bandwidth carries in a slot at 1 bit/s/Hz.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from statistics import fmean
from typing import Any, NamedTuple, NoReturn, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from dess.base.descriptions import Description, description_of
from dess.base.elementary import log10
from dess.base.errors import InputError, shown
from dess.physics.section import Section
from dess.physics.wind import Moves, largest_wind, moves_in
from dess.scenario.quantities import KINDS, exactly, form_of, measured, printed, refuse

_NEEDED = ("endurance", "cruise", "charging", "bandwidth")
LINK_BUDGET = ("tx_power", "noise_figure", "frequency")

# From what in the sheet a field of the scenario follows; each is refused in the words of the sheet.
_ORIGINS = {
    "cell_size": ("endurance", "cruise"),
    "charge_rate": ("endurance", "charging"),
    "arrival_rate": ("data_rate", "bandwidth"),
    "arrivals.rates": ("data_rate", "bandwidth"),
    "initial_data": ("backlog", "endurance", "bandwidth"),
    "arrivals.initial": ("backlog", "endurance", "bandwidth"),
    "edge_snr": ("snr", *LINK_BUDGET, "free_space", "bandwidth"),
}

# The fields that a scenario with a sheet may set otherwise.
OPEN = ("flying_time", "charge_start", "charge_complete", "landing", "quota")


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


_DISTANCES = (0.01, 1e6)  # at which an SNR can be given [m]


def _check_limits(text: str, units: str, limits: Sequence[tuple[float, float]]) -> None:
    """Refuse a quantity of which a number is out of range."""
    names = units.split(" ")[::2]
    for number, unit, (least, most) in zip(measured(text, units), names, limits, strict=True):
        if not least <= number <= most:
            raise InputError("", f"{shown(text)} is out of range", f"{least:g}..{most:g} {unit}")


def _quantity(
    units: str,
    description: str,
    least: float = 1e-6,
    most: float = 1e15,
    example: str = "",
    second: tuple[float, float] | None = None,
) -> Any:
    """A field in units of ``KINDS``, with the limits of its first number and of the second one."""
    limits = [(least, most)]
    if second:
        limits.append(second)
    extra: dict[str, Any] = {"units": units, "limits": limits}
    examples = [example or KINDS[units][1]]
    return Field(None, description=description, examples=examples, json_schema_extra=extra)


class DataSheet(Section):
    """What an engineer knows of the UAVs, the radio and the nodes, each with its unit."""

    endurance: str | None = _quantity("s", "flying time of a full battery")
    cruise: str | None = _quantity("m/s", "cruising speed in still air")
    charging: str | None = _quantity("s", "time to charge a battery from empty to full")
    reserve: str | None = _quantity("percent", "share of the battery that is never used", 0, 60)
    horizon: str | None = _quantity("s", "length of a mission, or else max_slots", example="8 h")
    data_rate: str | tuple[str, ...] | None = _quantity(
        "bit/s", Description("new data of a node", form="one for all, or a list for each"), 0
    )
    backlog: str | tuple[str, ...] | None = _quantity(
        "bit",
        Description(
            "data of a node at the start, or else none", form="one for all, or a list for each"
        ),
        0,
    )
    bandwidth: str | None = _quantity("Hz", "bandwidth of the radio")
    snr: str | None = _quantity("dB at m", "mean SNR at a distance", -200, 200, second=_DISTANCES)
    tx_power: str | None = _quantity("dBm", "transmitted power (EIRP), without snr", -99, 99)
    noise_figure: str | None = _quantity("dB", "noise figure of the receiver", 0, 99, "6 dB")
    frequency: str | None = _quantity("Hz", "carrier frequency", 1e6, 1e12, "868 MHz")
    free_space: str | None = _quantity(
        "m",
        "where free space ends and path_loss_exponent begins, or else 1 m",
        *_DISTANCES,
        "1 m",
    )
    range: str | None = _quantity("m", "distance beyond which there is no service", 0.01, 1e7)
    max_rate: str | None = _quantity("bit/s/Hz", "largest spectral efficiency", 0.001, 1000)
    wind: str | None = _quantity(
        "m/s from deg", "mean wind, and where it comes from", 0, second=(-360, 360)
    )
    mtbf: str | None = _quantity("s", "mean flying time of a UAV between failures", example="30 d")
    repair: str | None = _quantity("s", "mean time of a repair, or else it is lost", example="2 h")

    @classmethod
    def extra(cls, name: str) -> dict[str, Any]:
        """The units of a field, and the limits of its numbers."""
        return cls.model_fields[name].json_schema_extra  # type: ignore[return-value]

    @field_validator("*", mode="before")
    @classmethod
    def _is_quantity(cls, value: Any, info: ValidationInfo) -> Any:
        cls.check(info.field_name or "", value)
        return value

    @classmethod
    def check(cls, name: str, value: Any) -> None:
        """Refuse a value of a field that is no quantity of its kind.

        Raises:
            InputError: If it has no unit or another one, or is out of range.
        """
        units, limits = cls.extra(name)["units"], cls.extra(name)["limits"]
        items: Any = (value,)
        if isinstance(value, list | tuple):
            items = value
        for item in items:
            if isinstance(item, bool | int | float):
                refuse(item, "has no unit", units)
            if isinstance(item, str):
                _check_limits(item, units, limits)
            elif item is not None:
                problem = f"is of type {type(item).__name__}, not text"
                refuse(item, problem, units, f"text in quotes: {form_of(units)}")

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
            for name in needed:
                if getattr(self, name) is None:
                    raise InputError(name, "is missing", self.form_of(name))
            self.fields()
        return self

    @classmethod
    def example(cls, name: str) -> tuple[str, str]:
        """A quantity that a field may have, and its meaning."""
        field = cls.model_fields[name]
        return (field.examples or [""])[0], field.description or ""

    @classmethod
    def form_of(cls, name: str) -> str:
        """What a field means, with an example."""
        brief = description_of(cls.model_fields[name]).brief
        return f'{brief}, such as "{cls.example(name)[0]}"'

    @property
    def units(self) -> Units:
        """What a slot, a cell and a data unit are."""
        slot = self.number("endurance") / 100
        return Units(slot, slot * self.number("cruise"), slot * self.number("bandwidth"))

    @property
    def charge_rate(self) -> Fraction:
        """The battery that a charging slot adds [%], exactly as the times were typed."""
        endurance, charging = self.endurance, self.charging
        assert endurance and charging
        return exactly(endurance, "s")[0] / exactly(charging, "s")[0]

    def number(self, name: str, missing: float = 0.0) -> float:
        """The first number of a field in SI units, bits, percent or decibels."""
        text = getattr(self, name)
        if text:
            return measured(text, self.extra(name)["units"])[0]
        return missing

    def fields(self) -> dict[str, Any]:
        """The fields of a scenario that follow, those of sections dotted.

        Raises:
            InputError: If slots and cells are too coarse or too fine for the sheet.
        """
        full = 100 - math.ceil(self.number("reserve") - 1e-9)
        self._slots("charging", 10_000)
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
            **self._radio(),
        }
        if self.horizon:
            following["max_slots"] = int(self._slots("horizon", 100_000) + 1e-9)
        if self.wind:
            following["wind.moves"] = self._wind(*measured(self.wind, "m/s from deg"))
        if self.mtbf:
            following["failures.uav_rate"] = 1 / self._slots("mtbf")
            following["failures.uav_repair"] = 0.0
            if self.repair:
                following["failures.uav_repair"] = self._slots("repair", 1e6)
        return following

    def origin(self, field: str) -> str:
        """From what in the sheet a field of the scenario follows, as it was typed."""
        values = {name: getattr(self, name) for name in _ORIGINS.get(field, ())}
        named = [f"{name} {shown(value)}" for name, value in values.items() if value]
        return ", ".join(named) or "the data sheet"

    def _refuse(self, name: str, problem: str, allowed: str) -> NoReturn:
        raise InputError(name, f"{shown(getattr(self, name))} {problem}", allowed)

    def _slots(self, name: str, most: float = 1e12) -> float:
        """A time in slots, of which there are at least one and no more than ``most``."""
        slot = self.units.slot
        slots = self.number(name) / slot
        least = printed(slot, "s")
        if slots < 1:
            self._refuse(name, f"is less than a slot of {least}", f"{least} or more")
        if slots > most:
            problem = f"is {slots:,.0f} slots of {least}"
            self._refuse(name, problem, f"{printed(most * slot, 's')} at most")
        return slots

    def _data(self) -> dict[str, Any]:
        """New data and initial data [data units]."""
        fields: dict[str, Any] = {"initial_data": (0.0, 0.0)}
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

    def _radio(self) -> dict[str, Any]:
        """The SNR at a distance, the range and the largest rate."""
        if self.snr:
            snr, anchor = measured(self.snr, "dB at m")
        else:  # Friis' equation, and thermal noise at 290 K
            anchor = self.number("free_space", 1.0)
            loss = 20 * log10(4 * math.pi * anchor * self.number("frequency") / 299_792_458)
            noise = 10 * log10(1.380649e-20 * 290 * self.number("bandwidth"))
            snr = self.number("tx_power") - loss - noise - self.number("noise_figure")
        reach = self.number("range")
        cell = self.units.cell
        if self.range and reach < cell:
            size = printed(cell, "m")
            problem = f"is less than a cell of {size}, the way of a slot at {self.cruise}"
            self._refuse("range", problem, f"{size} or more")
        return {
            **{"edge_snr": snr, "radio.anchor": anchor},
            **{"radio.range": reach, "radio.max_rate": self.number("max_rate")},
        }

    def _wind(self, speed: float, direction: float) -> Moves:
        """The surcharge of each move [% per cell]."""
        cruise = self.number("cruise")
        most = math.floor(100 * largest_wind(direction, cruise)) / 100
        if speed > most:
            problem = f"is too strong for {self.cruise}"
            self._refuse("wind", problem, f"{most:g} m/s at most")
        return moves_in(speed, direction, cruise)
