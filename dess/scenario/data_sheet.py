"""The data sheet of a mission in units, and the fields of a scenario that follow from it.

    [data_sheet]                # in the TOML file of a scenario
    endurance = "35 min"
    cruise = "15 m/s"

A full battery is 100 slots of cruising in still air: a slot is the hundredth part of the endurance,
a cell the way of a slot at cruising speed, and a data unit what the bandwidth carries in a slot at
1 bit/s/Hz. The cruising speed is the ground speed, which autopilots hold in a mission; what a slot
takes of the battery follows from the speed through the air (``dess.scenario.rotary_wing``).
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from statistics import fmean
from typing import Any, Literal, NamedTuple, NoReturn, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from dess.base.descriptions import Description, description_of
from dess.base.elementary import log10
from dess.base.errors import InputError, shown
from dess.physics.energy import MOST, PERCENT, SPEEDS, Costs
from dess.physics.fleet import IN_UNITS, UavType
from dess.physics.radio import MOST_STEPS
from dess.physics.section import Section
from dess.scenario.quantities import KINDS, exactly, form_of, measured, printed, refuse
from dess.scenario.rotary_wing import (
    COURSES,
    INDUCED_SPEED,
    TIP_SPEED,
    RotaryWing,
    airspeed_along,
    largest_speed,
)

_NEEDED = ("endurance", "cruise", "charging", "bandwidth")
LINK_BUDGET = ("tx_power", "noise_figure", "frequency")

# From what in the sheet a field of the scenario follows; each is refused in the words of the sheet.
_ORIGINS = {
    "cell_size": ("endurance", "cruise"),
    "charge_rate": ("endurance", "charging"),
    "arrival_rate": ("data_rate", "bandwidth"),
    "arrivals.rates": ("data_rate", "bandwidth"),
    "arrivals.message": ("message", "endurance", "bandwidth"),
    "radio.steps": ("modulation", "rates", "bandwidth", "packet"),
    "initial_data": ("backlog", "endurance", "bandwidth"),
    "arrivals.initial": ("backlog", "endurance", "bandwidth"),
    "edge_snr": ("snr", *LINK_BUDGET, "free_space", "bandwidth"),
}

# What is assumed where the sheet does not say it.
_ASSUMED = {
    "modulation": "shannon",
    "max_rate": "6 bit/s/Hz",
    "altitude": "10 m",
    "message": "1 kB",
    "free_space": "1 m",
    "tip_speed": f"{TIP_SPEED:g} m/s",
    "induced_speed": f"{INDUCED_SPEED:g} m/s",
    "climb": "3 m/s",
}

LORA = "lora"
# The least SNR [dB] at which LoRa receives a spreading factor, the slowest first (Semtech, data
# sheet of SX1276/77/78/79); the bandwidths [Hz] that it has, and its usual coding rate; the symbols
# [s] from which on its low data rate optimisation leaves out two bits of each.
_LORA_SNR = {12: -20.0, 11: -17.5, 10: -15.0, 9: -12.5, 8: -10.0, 7: -7.5}
_LORA_BANDWIDTHS = (7.8e3, 1.625e6)
_LORA_CODING = Fraction(4, 5)
_LONG_SYMBOL = 0.016
_PREAMBLE = 8 + 4.25  # symbols
# The header that LoRaWAN adds to a packet, and the most that a packet of its European band has
# beside it, by spreading factor [bytes] (LoRaWAN 1.0.4; RP002, EU863-870).
_LORAWAN_HEADER = 13
_LORAWAN_MOST = {12: 51, 11: 51, 10: 51, 9: 115, 8: 222, 7: 222}

# A step of a rate: from which SNR on it is which, and the limits of both.
_STEP = (("dB", (-200, 200)), ("bit/s", (1e-6, 1e15)))

_MOST_TIME, _MOST_REPAIR = 1e12, 1e6  # the longest times, and the longest repairs [slots]
_MOST_CHARGING = 10_000  # the slots in which an empty battery is charged
_NEGLIGIBLE = Fraction(1, 10**11)  # the error of an endurance that is computed

# The cruising speed of a type goes a whole number of times into that of the sheet, but for a share
# of so much: so a third of 10 m/s can be typed.
_ROUNDED = Fraction(1, 1000)

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


_AT_SPEED = "s at m/s"
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


def _as_listed(value: Any) -> Any:
    """A tuple as the list that was typed."""
    if isinstance(value, tuple):
        return [*value]
    return value


class DataSheet(Section):
    """What an engineer knows of the UAVs, the radio and the nodes, each with its unit."""

    endurance: str | None = _quantity(
        "s",
        Description(
            "flying time of a full battery in still air",
            form="at the cruising speed, or a time at a speed",
        ),
    )
    cruise: str | None = _quantity("m/s", "cruising speed over ground")
    max_speed: str | None = _quantity(
        "m/s", "largest speed through the air, needed with wind", example="23 m/s"
    )
    hover: str | None = _quantity(
        "s", "hovering time of a full battery in still air, or else that of a usual rotary wing"
    )
    tip_speed: str | None = _quantity(
        "m/s", f"speed of the rotor's tips, or else {TIP_SPEED:g} m/s", 1, 1000, "120 m/s"
    )
    induced_speed: str | None = _quantity(
        "m/s",
        f"speed of the air through the rotor when hovering, or else {INDUCED_SPEED:g} m/s",
        0.1,
        100,
        "4.03 m/s",
    )
    climb: str | None = _quantity(
        "m/s", "rate of climb and descent in plans, or else 3 m/s", 0.1, 100, "3 m/s"
    )
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
    message: str | None = _quantity("bit", "what a node makes at once", 1, example="1 kB")
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
    modulation: Literal["shannon", "lora"] | None = Field(
        None, description="how the rate follows from the SNR, without rates", examples=[LORA]
    )
    max_rate: str | None = _quantity(
        "bit/s/Hz", "largest spectral efficiency of shannon", 0.001, 1000
    )
    rates: tuple[tuple[str, str], ...] | None = Field(
        None,
        description=Description("from which SNR on the rate is which", form="a list, both rising"),
        examples=['[["-7.5 dB", "5.5 kbit/s"], ["0 dB", "50 kbit/s"]]'],
    )
    packet: str | None = _quantity(
        "bit", "size of a lora packet, whose preamble and header then take time", 8, 2040, "51 B"
    )
    duty_cycle: str | None = _quantity(
        "percent", "share of the time in which a node may send", 0.01, 100, "1 %"
    )
    altitude: str | None = _quantity("m", "flying altitude above the nodes", 1, 500, "10 m")
    wind: str | None = _quantity(
        "m/s from deg", "mean wind, and where it comes from", 0, second=(-360, 360)
    )
    mtbf: str | None = _quantity("s", "mean flying time of a UAV between failures", example="30 d")
    repair: str | None = _quantity("s", "mean time of a repair, or else it is lost", example="2 h")
    pad_mtbf: str | tuple[str, ...] | None = _quantity(
        "s",
        Description(
            "mean time of a charging pad between failures",
            form="one for all, or a list for each zone",
        ),
        example="90 d",
    )
    pad_repair: str | tuple[str, ...] | None = _quantity(
        "s",
        Description(
            "mean time of the repair of a pad, or else it is lost",
            form="one for all, or a list for each zone",
        ),
        example="1 d",
    )

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
        if name == "rates":
            cls._check_rates(value)
        elif name != "modulation":
            cls._check_quantities(name, value)

    @classmethod
    def _check_quantities(cls, name: str, value: Any) -> None:
        """Refuse a value, or an item of a list, that is no quantity of its kind."""
        units, limits = cls.extra(name)["units"], cls.extra(name)["limits"]
        items: Any = (value,)
        if isinstance(value, list | tuple):
            items = value
        for item in items:
            if isinstance(item, bool | int | float):
                refuse(item, "has no unit", units)
            if name == "endurance" and isinstance(item, str) and " at " in item:
                _check_limits(item, _AT_SPEED, [*limits, *limits])
            elif isinstance(item, str):
                _check_limits(item, units, limits)
            elif item is not None:
                problem = f"is of type {type(item).__name__}, not text"
                refuse(item, problem, units, f"text in quotes: {form_of(units)}")

    @classmethod
    def _check_rates(cls, value: Any) -> None:
        """Refuse what is no list of pairs of an SNR and a rate."""
        if value is None:
            return
        allowed = f"a list of at most {MOST_STEPS} pairs, such as {cls.example('rates')[0]}"
        pairs: Any = ()
        if isinstance(value, list | tuple):
            pairs = value
        if not 0 < len(pairs) <= MOST_STEPS:
            raise InputError("", f"{shown(_as_listed(value))} has no such pairs", allowed)
        for pair in pairs:
            if not (isinstance(pair, list | tuple) and len(pair) == len(_STEP)):
                raise InputError("", f"{shown(_as_listed(pair))} is no pair", allowed)
            for item, (units, limits) in zip(pair, _STEP, strict=True):
                if not isinstance(item, str):
                    refuse(item, "has no unit", units)
                _check_limits(item, units, [limits])

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

    @classmethod
    def example(cls, name: str) -> tuple[str, str]:
        """A quantity that a field may have, and its meaning."""
        field = cls.model_fields[name]
        return str((field.examples or [""])[0]), field.description or ""

    @classmethod
    def form_of(cls, name: str) -> str:
        """What a field means, with an example."""
        brief = description_of(cls.model_fields[name]).brief
        example = cls.example(name)[0]
        if name != "rates":
            example = f'"{example}"'
        return f"{brief}, such as {example}"

    @property
    def units(self) -> Units:
        """What a slot, a cell and a data unit are."""
        slot = self.endurance_at_cruise / 100
        return Units(slot, slot * self.number("cruise"), slot * self.number("bandwidth"))

    @property
    def charge_rate(self) -> Fraction:
        """The battery that a charging slot adds [%], exactly as the times were typed."""
        assert self.charging
        return self._exact_endurance / exactly(self.charging, "s")[0]

    @property
    def _exact_endurance(self) -> Fraction:
        """``endurance_at_cruise``, exactly as it was typed if it is given for the cruise."""
        assert self.endurance
        if self._endurance_at:
            return Fraction(self.endurance_at_cruise)
        return exactly(self.endurance, "s")[0]

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
            self._slots_of("charging", kind.charging, _MOST_CHARGING)
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
        return self._endurance_of_type(kind) / self._exact_endurance

    def charge_rate_of_type(self, kind: UavType) -> Fraction:
        """What a charging slot adds to a type of UAVs, exactly as the times were typed.

        A type that gives ``charging`` is charged in this time from its own empty to its own full;
        others gain what the sheet says.

        Returns:
            The rate in percent of the battery of the sheet.
        """
        if not kind.charging:
            return self.charge_rate
        endurance = self._exact_endurance
        if kind.endurance:
            endurance = self._endurance_of_type(kind)
        return endurance / exactly(kind.charging, "s")[0]

    def _endurance_of_type(self, kind: UavType) -> Fraction:
        """The flying time of a type of UAVs at its cruising speed in still air [s]."""
        assert kind.endurance
        if " at " not in kind.endurance:
            return exactly(kind.endurance, "s")[0]
        endurance, speed = measured(kind.endurance, _AT_SPEED)
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
            self._refuse("hover", problem, allowed)
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
    def _endurance_at(self) -> tuple[float, float] | None:
        """The flying time [s] and the speed for which it is given [m/s]; None for the cruise."""
        if self.endurance and " at " in self.endurance:
            endurance, speed = measured(self.endurance, _AT_SPEED)
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
        costs = []
        for slots in range(1, SPEEDS + 1):
            speed = self.number("cruise") / slots
            airspeeds = [airspeed_along(course, speed, wind, direction) for course in COURSES]
            of_cruise = wing.power(speed)
            shares = [wing.power(airspeed) / of_cruise for airspeed in (*airspeeds, wind)]
            # A share that is whole but for the rounding of floats is not rounded up.
            north, east, south, west, hover = (
                max(math.ceil(PERCENT * share - 1e-6), 1) for share in shares
            )
            costs.append((north, east, south, west, hover))
        return tuple(costs)

    def number(self, name: str, missing: float = 0.0) -> float:
        """The first number of a field in SI units, bits, percent or decibels."""
        text = getattr(self, name) or _ASSUMED.get(name)
        if text:
            return measured(text, self.extra(name)["units"])[0]
        return missing

    @property
    def assumed(self) -> dict[str, str]:
        """What the sheet does not say, and is assumed."""
        unused = set()
        if self.modulation == LORA or self.rates:
            unused.add("max_rate")
        if self.rates:
            unused.add("modulation")
        if self.snr:
            unused.add("free_space")
        assumed = {
            name: value
            for name, value in _ASSUMED.items()
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
        self._slots("charging", _MOST_CHARGING)
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
        self._check_speeds()
        following["consumption.slots"] = self.costs()
        if max(following["consumption.slots"][0]) > MOST:
            problem = f"a slot takes {max(following['consumption.slots'][0]) / PERCENT:.1f} %"
            raise InputError("max_speed", problem, f"{MOST // PERCENT} % at most")
        if self.mtbf:
            following["failures.uav_rate"] = 1 / self._slots("mtbf")
            following["failures.uav_repair"] = 0.0
            if self.repair:
                following["failures.uav_repair"] = self._slots("repair", _MOST_REPAIR)
        if self.pad_mtbf:
            following |= self._pad_failures()
        return following

    def _pad_failures(self) -> dict[str, Any]:
        """How often pads fail, and how long they are repaired: for all zones, or for each."""
        following: dict[str, Any] = {"failures.pad_rate": 0.0, "failures.pad_repair": 0.0}
        if isinstance(self.pad_mtbf, str):
            following["failures.pad_rate"] = 1 / self._slots("pad_mtbf")
        else:
            means = [self._slots_of("pad_mtbf", time, _MOST_TIME) for time in self.pad_mtbf or ()]
            following["failures.pad_rates"] = tuple(1 / mean for mean in means)
        if isinstance(self.pad_repair, str):
            following["failures.pad_repair"] = self._slots("pad_repair", _MOST_REPAIR)
        elif self.pad_repair:
            means = [self._slots_of("pad_repair", time, _MOST_REPAIR) for time in self.pad_repair]
            following["failures.pad_repairs"] = tuple(means)
        return following

    def origin(self, field: str) -> str:
        """From what in the sheet a field of the scenario follows, as it was typed."""
        values = {name: getattr(self, name) for name in _ORIGINS.get(field, ())}
        named = [f"{name} {shown(value)}" for name, value in values.items() if value]
        return ", ".join(named) or "the data sheet"

    def _refuse(self, name: str, problem: str, allowed: str) -> NoReturn:
        raise InputError(name, f"{shown(getattr(self, name))} {problem}", allowed)

    def _slots(self, name: str, most: float = _MOST_TIME) -> float:
        """A time in slots, of which there are at least one and no more than ``most``."""
        return self._slots_of(name, getattr(self, name), most)

    def _slots_of(self, name: str, time: str, most: float) -> float:
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

    def _radio(self) -> dict[str, Any]:
        """The altitude, the SNR at a distance, the range and the rates."""
        if self.snr:
            snr, anchor = measured(self.snr, "dB at m")
        else:  # Friis' equation, and thermal noise at 290 K
            anchor = self.number("free_space")
            loss = 20 * log10(4 * math.pi * anchor * self.number("frequency") / 299_792_458)
            noise = 10 * log10(1.380649e-20 * 290 * self.number("bandwidth"))
            snr = self.number("tx_power") - loss - noise - self.number("noise_figure")
        reach = self.number("range")
        cell = self.units.cell
        if self.range and reach < cell:
            size = printed(cell, "m")
            problem = f"is less than a cell of {size}, the way of a slot at {self.cruise}"
            self._refuse("range", problem, f"{size} or more")
        altitude = self.number("altitude")
        if self.range and reach <= altitude:
            height = printed(altitude, "m")
            self._refuse("range", f"ends above the sea, {height} below", f"above {height}")
        steps = self._steps()
        max_rate = 0.0
        if not steps:
            max_rate = self.number("max_rate")
        return {
            "altitude": altitude,
            "edge_snr": snr,
            "radio.anchor": anchor,
            "radio.range": reach,
            "radio.max_rate": max_rate,
            "radio.steps": steps,
            "radio.duty_cycle": self.number("duty_cycle", 100.0) / 100,
        }

    def _steps(self) -> tuple[tuple[float, float], ...]:
        """From which SNR [dB] on the spectral efficiency is which [bit/s/Hz]; none for shannon."""
        for name, other in (("modulation", "rates"), ("max_rate", "rates")):
            if getattr(self, name) and getattr(self, other):
                raise InputError(name, f"is given beside {other}", "one of both")
        if self.modulation == LORA:
            return self._lora_steps()
        if self.packet:
            self._refuse("packet", "is of lora", 'modulation = "lora", or no packet')
        bandwidth = self.number("bandwidth")
        steps: list[tuple[float, float]] = []
        for pair in self.rates or ():
            numbers = [
                measured(text, units)[0] for text, (units, _) in zip(pair, _STEP, strict=True)
            ]
            snr, efficiency = numbers[0], numbers[1] / bandwidth
            if steps and not (snr > steps[-1][0] and efficiency > steps[-1][1]):
                before = (self.rates or ())[len(steps) - 1]
                problem = f"{shown(_as_listed(pair))} comes after {shown(_as_listed(before))}"
                raise InputError("rates", problem, "pairs whose SNR and rate rise")
            steps.append((snr, efficiency))
        return tuple(steps)

    def _lora_steps(self) -> tuple[tuple[float, float], ...]:
        """The steps of LoRa's spreading factors."""
        if self.max_rate:
            raise InputError("max_rate", "is given beside lora, which has rates", "one of both")
        least, most = _LORA_BANDWIDTHS
        if not least <= self.number("bandwidth") <= most:
            self._refuse("bandwidth", "is none of lora", "7.8 kHz..1.625 MHz")
        size = self.number("packet") / 8
        if not size.is_integer():
            self._refuse("packet", "is no whole number of bytes", "1 B to 255 B")
        return tuple(
            (snr, self._lora_rate(factor, int(size)) / self.number("bandwidth"))
            for factor, snr in _LORA_SNR.items()
        )

    def _lora_rate(self, factor: int, size: int = 0) -> float:
        """The rate of a spreading factor in packets of a size [bytes], or of its symbols alone.

        Returns:
            The rate [bit/s].
        """
        symbol = (1 << factor) / self.number("bandwidth")
        bits = factor
        if symbol >= _LONG_SYMBOL:
            bits -= 2
        if not size:
            return float(bits * _LORA_CODING) / symbol
        # Semtech, data sheet of SX1276/77/78/79, 4.1.1.7: with an explicit header and a checksum.
        blocks = max(math.ceil((8 * size - 4 * factor + 28 + 16) / (4 * bits)), 0)
        symbols = _PREAMBLE + 8 + blocks * 4 / _LORA_CODING
        return 8 * size / (float(symbols) * symbol)

    def lorawan_overhead(self, factor: int) -> float:
        """How many times as long as its data a full LoRaWAN packet takes with all that is sent."""
        most = _LORAWAN_MOST[factor]
        sent = most + _LORAWAN_HEADER
        return self._lora_rate(factor) / self._lora_rate(factor, sent) * sent / most

    def strongest_wind(self, direction: float) -> float:
        """The strongest wind [m/s] from a direction [deg] in which all moves are possible.

        It is rounded down to 0.01 m/s.
        """
        largest = largest_speed(self.number("cruise"), direction, self.number("max_speed"))
        return _rounded_down(largest)

    def _check_speeds(self) -> None:
        """Refuse a largest airspeed below the cruising speed, and a wind that it cannot fly in."""
        if not self.max_speed:
            return
        cruise = self.number("cruise")
        most = self.number("max_speed")
        if most < cruise:
            self._refuse("max_speed", f"is less than the cruise {self.cruise}", str(self.cruise))
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
            self._refuse("wind", problem, allowed)


def _rounded_down(speed: float) -> float:
    """A speed rounded down to 0.01 m/s."""
    return math.floor(100 * speed) / 100
