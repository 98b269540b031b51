"""The quantities of a data sheet as they are typed: their units, limits, meanings and examples."""

from collections.abc import Sequence
from typing import Any, Literal, NoReturn

from pydantic import Field, ValidationInfo, field_validator

from dess.base.descriptions import Description, description_of
from dess.base.errors import InputError, shown
from dess.physics.radio import MOST_STEPS
from dess.physics.section import Integer, Section
from dess.scenario.data_sheet.defaults import ASSUMED
from dess.scenario.quantities import KINDS, form_of, measured, refuse
from dess.scenario.rotary_wing import INDUCED_SPEED, TIP_SPEED

LORA = "lora"

# A step of a rate: from which SNR on it is which, and the limits of both.
STEP = (("dB", (-200, 200)), ("bit/s", (1e-6, 1e15)))

AT_SPEED = "s at m/s"
_DISTANCES = (0.01, 1e6)  # at which an SNR can be given [m]


def check_limits(text: str, units: str, limits: Sequence[tuple[float, float]]) -> None:
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


def as_listed(value: Any) -> Any:
    """A tuple as the list that was typed."""
    if isinstance(value, tuple):
        return [*value]
    return value


class Quantities(Section):
    """What an engineer types of the UAVs, the radio and the nodes, each with its unit."""

    endurance: str | None = _quantity(
        "s",
        Description(
            "flying time of a full battery in still air",
            form="at the cruising speed, or a time at a speed",
        ),
    )
    cruise: str | None = _quantity("m/s", "cruising speed over ground")
    cell: str | None = _quantity(
        "m", "side of a cell, or else the way of a hundredth of the endurance", example="315 m"
    )
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
    idle: str | None = _quantity(
        "s", "how long nodes have collected data before the mission, or else not", example="16 h"
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

    spares: Integer = Field(
        0,
        ge=0,
        le=100,
        description="UAVs that stand in for lost ones, in years with weather",
    )
    delivery: str | None = _quantity(
        "s", "time until a lost UAV is replaced where no spare is left", example="14 d"
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
        elif name not in ("modulation", "spares"):
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
                check_limits(item, AT_SPEED, [*limits, *limits])
            elif isinstance(item, str):
                check_limits(item, units, limits)
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
            raise InputError("", f"{shown(as_listed(value))} has no such pairs", allowed)
        for pair in pairs:
            if not (isinstance(pair, list | tuple) and len(pair) == len(STEP)):
                raise InputError("", f"{shown(as_listed(pair))} is no pair", allowed)
            for item, (units, limits) in zip(pair, STEP, strict=True):
                if not isinstance(item, str):
                    refuse(item, "has no unit", units)
                check_limits(item, units, [limits])

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

    def number(self, name: str, missing: float = 0.0) -> float:
        """The first number of a field in SI units, bits, percent or decibels."""
        text = getattr(self, name) or ASSUMED.get(name)
        if text:
            return measured(text, self.extra(name)["units"])[0]
        return missing

    def refuse(self, name: str, problem: str, allowed: str) -> NoReturn:
        """Refuse what a field has.

        Raises:
            InputError: Always.
        """
        raise InputError(name, f"{shown(getattr(self, name))} {problem}", allowed)
