"""The data sheet of a mission in units, and the fields of a scenario that follow from it.

    [data_sheet]                # in the TOML file of a scenario
    endurance = "35 min"
    cruise = "15 m/s"

A full battery is 100 slots: a slot is the hundredth part of the endurance, a cell the way of a slot
at cruising speed, and a data unit what the bandwidth carries in a slot at 1 bit/s/Hz. The library
pint reads the units; it is imported when there is a sheet.
"""

import math
import re
from functools import cache, lru_cache
from typing import Any, NamedTuple, NoReturn, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic.fields import FieldInfo

from dess.code.libraries import needs
from dess.errors import InputError, listed, shown
from dess.sections.section import Section
from dess.sections.wind import Moves, largest_wind, moves_in

# What a quantity is and an example, by its units. The words in between part two quantities.
_KINDS = {
    "s": ("a time", "35 min"),
    "m/s": ("a speed", "15 m/s"),
    "m": ("a distance", "2 km"),
    "bit/s": ("a data rate", "3 MB/h"),
    "bit": ("an amount of data", "20 MB"),
    "Hz": ("a frequency", "125 kHz"),
    "bit/s/Hz": ("a spectral efficiency", "6 bit/s/Hz"),
    "percent": ("a share", "20 %"),
    "dB": ("a ratio", "12 dB"),
    "dBm": ("a power", "20 dBm"),
    "deg": ("a direction", "225 deg"),
    "dB at m": ("a ratio at a distance", "12 dB at 2 km"),
    "m/s from deg": ("a speed and where it comes from", "10 m/s from SW"),
}
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d\d?)?) ?([a-zµμ%°/ ]*)", re.I)
_POINTS = re.findall(r"\w+", "N NNE NE ENE E ESE SE SSE S SSW SW WSW W WNW NW NNW")

# Units in which amounts are printed, with their sizes.
_PRINTED = {
    "s": {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0},
    "m": {"m": 1.0, "km": 1000.0},
    "bit": {"bit": 1.0, "B": 8.0, "kB": 8e3, "MB": 8e6, "GB": 8e9},
}


@cache
def _registry() -> Any:
    needs("units", "a data sheet")
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def measured(text: str, where: str = "", unit: str = "") -> float:
    """A quantity such as ``35 min`` in a unit of ``_KINDS``.

    Raises:
        InputError: If it has no unit, or one of another kind; ``where`` says where it stands.
    """
    try:
        return _measured(text, unit)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


@lru_cache(maxsize=1024)
def _measured(text: str, unit: str) -> float:
    text = " ".join(text.split())
    if unit == "deg" and text.upper() in _POINTS:
        return _POINTS.index(text.upper()) * 360 / len(_POINTS)
    found = _NUMBER.fullmatch(text)
    if not found or not found[2]:
        _refuse(text, "has no unit" if found else "is not a number and a unit", unit)
    registry, wanted = _registry(), _registry().Quantity(1.0, unit)
    try:
        given = registry.Quantity(float(found[1]), registry.parse_units(found[2]))
    except Exception:  # pint raises errors of many types for what is no unit
        _refuse(text, "has an unknown unit", unit)
    if given.to_root_units().units != wanted.to_root_units().units:
        _refuse(text, f"is not {_KINDS[unit][0]}", unit)
    return float(given.to(unit).magnitude)


def printed(value: float, unit: str) -> str:
    """An amount of ``s``, ``m`` or ``bit`` in the unit that suits it: ``2100`` s as ``35 min``."""
    fitting = [of for of in _PRINTED[unit].items() if of[1] <= value] or [*_PRINTED[unit].items()]
    name, size = fitting[-1] if value >= 1 else fitting[0]
    return f"{value / size:.4g} {name}"


def times(text: str, factor: float) -> str:
    """A quantity, or the first of two, times a factor: ``5 m/s from SW`` as ``10 m/s from SW``."""
    amount, *others = re.split(r"(?= from | at )", " ".join(text.split()), maxsplit=1)
    found = _NUMBER.fullmatch(amount)
    assert found
    return f"{float(found[1]) * factor:g} {found[2]}{''.join(others)}"


def _refuse(value: object, problem: str, units: str) -> NoReturn:
    kind, example = _KINDS[units]
    raise InputError(f'{shown(value)} {problem}; allowed: {kind}, such as "{example}"')


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


def _quantity(units: str, description: str, least: float = 1e-6, most: float = 1e15) -> Any:
    """A field in units, of which there are words in ``_KINDS``."""
    limits: dict[str, Any] = {"units": units, "least": least, "most": most}
    return Field(None, description=description, json_schema_extra=limits)


class DataSheet(Section):
    """What an engineer knows of the UAVs, the radio and the nodes, each with its unit."""

    endurance: str | None = _quantity("s", "flying time of a full battery")
    cruise: str | None = _quantity("m/s", "cruising speed in still air")
    charging: str | None = _quantity("s", "time to charge a battery from empty to full")
    reserve: str | None = _quantity("percent", "share of the battery that is never used", 0, 60)
    horizon: str | None = _quantity("s", "length of a mission; without it, max_slots")
    data_rate: str | tuple[str, ...] | None = _quantity(
        "bit/s", "new data of a node: one for all, or a list of one per node", 0
    )
    backlog: str | tuple[str, ...] | None = _quantity(
        "bit", "data of a node at the start, none by default: one for all, or a list", 0
    )
    bandwidth: str | None = _quantity("Hz", "bandwidth of the radio")
    snr: str | None = _quantity("dB at m", "mean SNR at a distance", -200, 200)
    tx_power: str | None = _quantity(
        "dBm", "transmitted power with the gains of the antennas, where snr is not given", -99, 99
    )
    noise_figure: str | None = _quantity("dB", "noise figure of the receiver", 0, 99)
    frequency: str | None = _quantity("Hz", "carrier frequency", 1e6, 1e12)
    free_space: str | None = _quantity(
        "m", "where free space ends and path_loss_exponent begins; without it, 1 m", 0.01, 1e6
    )
    range: str | None = _quantity("m", "distance beyond which there is no service", 0.01, 1e7)
    max_rate: str | None = _quantity("bit/s/Hz", "largest spectral efficiency", 0.001, 1000)
    wind: str | None = _quantity("m/s from deg", "mean wind, and where it comes from", 0)
    mtbf: str | None = _quantity("s", "mean flying time of a UAV between failures")
    repair: str | None = _quantity("s", "mean time of a repair; without it, a UAV is lost")

    @field_validator("*", mode="before")
    @classmethod
    def _is_quantity(cls, value: Any, info: ValidationInfo) -> Any:
        field = cls.model_fields[info.field_name or ""]
        is_list = isinstance(value, list | tuple) and "list" in (field.description or "")
        for item in value if is_list else () if value is None else (value,):
            _check(item, **_extra(field))
        return value

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        """A scenario can follow; ``data_rate`` may still come from the file of the nodes."""
        if self.is_on:
            budget = ("tx_power", "noise_figure", "frequency")
            given = [name for name in (*budget, "free_space") if getattr(self, name)]
            for name in ("endurance", "cruise", "charging", "bandwidth"):
                self.require(name)
            for name in budget if given and not self.snr else ("snr",):
                self.require(name)
            if given and self.snr:
                raise InputError(f"snr: follows from {listed(given)}; allowed: one of both")
            if self.repair:
                self.require("mtbf")
            self.fields()
        return self

    def require(self, name: str) -> None:
        """Refuse a sheet without a field.

        Raises:
            InputError: If it is missing.
        """
        if getattr(self, name) is None:
            field = type(self).model_fields[name]
            kind, example = _KINDS[_extra(field)["units"]]
            what = f'{kind}, such as "{example}" ({field.description})'
            raise InputError(f"{name}: is missing; allowed: {what}")

    @property
    def units(self) -> Units:
        """What a slot, a cell and a data unit are."""
        slot = self._in("endurance", "s") / 100
        return Units(slot, slot * self._in("cruise", "m/s"), slot * self._in("bandwidth", "Hz"))

    def fields(self) -> dict[str, Any]:
        """The fields of a scenario that follow, those of sections dotted.

        Raises:
            InputError: If a slot, a cell or a data unit is too coarse or too fine for one.
        """
        cell = self.units.cell
        if not 0.01 <= cell <= 100_000:
            self._refuse("cruise", f"makes cells of {printed(cell, 'm')}", "0.01 m to 100 km")
        full = 100 - math.ceil(self._in("reserve", "percent") - 1e-9)
        gain = 100 / self._slots("charging", 10_000)
        found: dict[str, Any] = {
            **{"cell_size": cell, "slot_length": 1.0, "landing": True, "quota": 0},
            **{"flying_time": full, "charge_start": 30, "charge_complete": full},
            "charge_rate": int(gain) if gain.is_integer() else gain,
            **self._data(),
            **self._radio(),
        }
        if self.horizon:
            found["max_slots"] = int(self._slots("horizon", 100_000) + 1e-9)
        if self.wind:
            found["wind.moves"] = self._wind()
        if self.mtbf:
            found["failures.uav_rate"] = 1 / self._slots("mtbf", math.inf)
            repair = self._slots("repair", 1_000_000) if self.repair else 0.0
            found["failures.uav_repair"] = repair
        return found

    def _in(self, name: str, unit: str) -> float:
        text = getattr(self, name)
        return _measured(text, unit) if text else 0.0

    def _refuse(self, name: str, problem: str, allowed: str) -> NoReturn:
        value = getattr(self, name)
        raise InputError(f"{name}: {shown(value)} {problem}; allowed: {allowed}")

    def _slots(self, name: str, most: float) -> float:
        """A time in slots, of which there are at least one and no more than ``most``."""
        slot = self.units.slot
        slots = self._in(name, "s") / slot
        if not 1 <= slots <= most:
            what = "is less than a slot" if slots < 1 else f"is {slots:,.0f} slots"
            limit = f" to {printed(most * slot, 's')}" if most < math.inf else " or more"
            slot_text = printed(slot, "s")
            self._refuse(name, f"{what} of {slot_text}", f"{slot_text}{limit}")
        return slots

    def _data(self) -> dict[str, Any]:
        """New data and initial data [data units]."""
        found: dict[str, Any] = {"initial_data": (0.0, 0.0)}
        for name, size, most in (
            ("data_rate", self._in("bandwidth", "Hz"), 100),
            ("backlog", self.units.data, 10**9),
        ):
            given = getattr(self, name)
            unit = _extra(type(self).model_fields[name])["units"]
            values = [_measured(text, unit) / size for text in _each(given)]
            if values and max(values) > most:
                self._refuse(name, "is too much", f"{most * size:g} {unit}")
            mean = sum(values) / max(len(values), 1)
            if values and name == "data_rate":
                found["arrival_rate"] = mean
                found["arrivals.rates"] = () if isinstance(given, str) else tuple(values)
            elif values:
                found["initial_data"] = (mean, mean)
                found["arrivals.initial"] = () if isinstance(given, str) else tuple(values)
        return found

    def _radio(self) -> dict[str, Any]:
        """The SNR at a distance, the range and the largest rate."""
        if self.snr:
            snr, distance = self.snr.split(" at ")
            found = {"edge_snr": _measured(snr, "dB"), "radio.anchor": _measured(distance, "m")}
        else:  # Friis' equation, and thermal noise at 290 K
            anchor = self._in("free_space", "m") or 1.0
            waves = 4 * math.pi * anchor * self._in("frequency", "Hz") / 299_792_458
            noise = 10 * math.log10(1.380649e-20 * 290 * self._in("bandwidth", "Hz"))
            power = self._in("tx_power", "dBm") - 20 * math.log10(waves)
            snr_there = power - noise - self._in("noise_figure", "dB")
            found = {"edge_snr": snr_there, "radio.anchor": anchor}
        reach, cell = self._in("range", "m"), self.units.cell
        if self.range and reach < cell:
            size = printed(cell, "m")
            self._refuse("range", f"is less than a cell of {size}", f"{size} or more")
        rate = self._in("max_rate", "bit/s/Hz")
        return {**found, "radio.range": reach, "radio.max_rate": rate}

    def _wind(self) -> Moves:
        """The surcharge of each move [% per cell]."""
        strength, direction = (self.wind or "").split(" from ")
        speed, towards = _measured(strength, "m/s"), _measured(direction, "deg")
        cruise = self._in("cruise", "m/s")
        most = largest_wind(towards, cruise)
        if speed > most:
            allowed = f"{math.floor(most * 100) / 100:g} m/s at most"
            self._refuse("wind", f"cannot be flown against at {self.cruise}", allowed)
        return moves_in(speed, towards, cruise)


def _each(given: str | tuple[str, ...] | None) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else given or ()


def _extra(field: FieldInfo) -> dict[str, Any]:
    extra = field.json_schema_extra
    assert isinstance(extra, dict)
    return extra


def _check(value: Any, units: str, least: float, most: float) -> None:
    """Refuse what is no quantity in these units, or out of range."""
    if isinstance(value, bool | int | float):
        _refuse(value, "has no unit", units)
    first, *word = units.split()
    if not isinstance(value, str):
        return  # its type is refused
    given, *others = value.split(f" {word[0]} ") if word else [value]
    if len(others) != len(word) // 2:
        _refuse(value, "is not of this form", units)
    for other in others:
        _measured(other, word[1])
    if not least <= _measured(given, first) <= most:
        raise InputError(f"{shown(value)} is out of range; allowed: {least:g}..{most:g} {first}")


# The fields that a scenario with a sheet may set otherwise.
OPEN = ("flying_time", "charge_start", "charge_complete", "landing", "quota")
