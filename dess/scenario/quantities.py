"""Quantities as people write them: a number and a unit, such as ``35 min`` or ``3 MB/h``.

    >>> measured("12 dB at 2 km", "dB at m")
    (12.0, 2000.0)

``UNITS`` lists every unit that is read, and its size. A number may have a decimal comma.
"""

import re
from decimal import ROUND_DOWN, ROUND_UP, Context
from fractions import Fraction
from functools import cache, lru_cache
from typing import NoReturn

from dess.base.elementary import log10
from dess.base.errors import InputError, shown, suggestion

# What a quantity is and an example, by its units. A word in between parts two quantities.
KINDS = {
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
    "dB at m": ("a ratio at a distance", "12 dB at 2 km"),
    "s at m/s": ("a time at a speed", "55 min at 8 m/s"),
    "deg": ("a direction", "220 deg"),
    "m/s from deg": ("a speed and where it comes from", "10 m/s from SW"),
}

# The units of each kind, and what one of them is in the first unit of the kind. Spellings of one
# unit stand together. Speeds and data rates are also a distance or an amount over a time.
UNITS: dict[str, dict[tuple[str, ...], Fraction]] = {
    "s": {
        ("s", "sec", "second", "seconds"): Fraction(1),
        ("ms",): Fraction(1, 1000),
        ("min", "minute", "minutes"): Fraction(60),
        ("h", "hr", "hour", "hours"): Fraction(3600),
        ("d", "day", "days"): Fraction(86_400),
        ("week", "weeks"): Fraction(7 * 86_400),
        ("year", "years"): Fraction(31_557_600),  # of 365.25 days
    },
    "m": {
        ("m", "metre", "metres", "meter", "meters"): Fraction(1),
        ("cm",): Fraction(1, 100),
        ("km",): Fraction(1000),
        ("ft", "foot", "feet"): Fraction(3048, 10_000),
        ("mi", "mile", "miles"): Fraction(1_609_344, 1000),
        ("nmi", "NM", "nautical mile", "nautical miles"): Fraction(1852),
    },
    "m/s": {
        ("knot", "knots", "kn", "kt", "kts"): Fraction(1852, 3600),
        ("kmh", "kph", "kmph"): Fraction(1000, 3600),
        ("mph",): Fraction(1_609_344, 3_600_000),
    },
    "bit": {
        ("bit", "bits"): Fraction(1),
        ("kbit",): Fraction(10**3),
        ("Mbit",): Fraction(10**6),
        ("Gbit",): Fraction(10**9),
        ("B", "byte", "bytes"): Fraction(8),
        ("kB",): Fraction(8 * 10**3),
        ("MB",): Fraction(8 * 10**6),
        ("GB",): Fraction(8 * 10**9),
        ("TB",): Fraction(8 * 10**12),
        ("KiB",): Fraction(8 * 2**10),
        ("MiB",): Fraction(8 * 2**20),
        ("GiB",): Fraction(8 * 2**30),
    },
    "bit/s": {
        ("bps",): Fraction(1),
        ("kbps",): Fraction(10**3),
        ("Mbps",): Fraction(10**6),
        ("Gbps",): Fraction(10**9),
    },
    "Hz": {
        ("Hz",): Fraction(1),
        ("kHz",): Fraction(10**3),
        ("MHz",): Fraction(10**6),
        ("GHz",): Fraction(10**9),
    },
    "bit/s/Hz": {("bit/s/Hz", "bits/s/Hz", "bps/Hz"): Fraction(1)},
    "percent": {("%", "percent"): Fraction(1)},
    "dB": {("dB",): Fraction(1)},
    # Decibels above a milliwatt; those of a watt have 30 more.
    "dBm": {
        ("dBm",): Fraction(1),
        ("dBW",): Fraction(30),
        ("uW", "µW", "μW"): Fraction(1, 1000),
        ("mW",): Fraction(1),
        ("W",): Fraction(1000),
        ("kW",): Fraction(10**6),
    },
    "deg": {("deg", "degree", "degrees", "°"): Fraction(1)},
}
_OVER_TIME = {"m/s": "m", "bit/s": "bit"}
POINTS = re.findall(r"\w+", "N NNE NE ENE E ESE SE SSE S SSW SW WSW W WNW NW NNW")

# A number has at most 30 digits before and after its comma: no more are ever typed.
_DIGITS = "[0-9]{1,30}"
_NUMBER = re.compile(
    rf"([-+]?(?:{_DIGITS}(?:[.,](?:{_DIGITS})?)?|[.,]{_DIGITS})(?:e[-+]?[0-9]{{1,2}})?) ?(\D*)",
    re.I,
)
# A comma in these could part thousands as well as decimals.
_THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2},[0-9]{3}")


@lru_cache(maxsize=4096)
def measured(text: str, units: str) -> tuple[float, ...]:
    """The numbers of a quantity in the units of ``KINDS``: ``12 dB at 2 km`` as 12 and 2000.

    Raises:
        InputError: If it has no unit, or one of another kind.
    """
    return tuple(float(number) for number in exactly(text, units))


@lru_cache(maxsize=4096)
def exactly(text: str, units: str) -> tuple[Fraction, ...]:
    """The numbers of ``measured`` as fractions, exact as they were typed; powers are rounded.

    Raises:
        InputError: If it has no unit, or one of another kind.
    """
    unit, *others = units.split(" ")
    texts = [text]
    if others:
        texts = re.split(rf"\s+{others[0]}\s+", text)
    if len(texts) != len(units.split(" ")[::2]):
        refuse(text, f"is not {KINDS[units][0]}", units)
    return tuple(_number(*part, units) for part in zip(texts, (unit, *others[1:]), strict=True))


def quantity_of(text: str, place: str, unit: str) -> float:
    """A quantity in a unit; ``place`` says in messages where it stands."""
    try:
        return measured(text, unit)[0]
    except InputError as error:
        raise error.within(place) from None


def _number(text: str, unit: str, units: str) -> Fraction:
    """A single quantity in a unit; ``units`` is for the message."""
    text = " ".join(text.split())
    if unit == "deg" and text.upper() in POINTS:
        return Fraction(POINTS.index(text.upper()) * 360, len(POINTS))
    match = _NUMBER.fullmatch(text)
    if not match:
        refuse(text, "is not a number and a unit", units)
    number = match[1]
    name = re.sub(" ?/ ?", "/", match[2].strip())
    if not name:
        refuse(text, "has no unit", units)
    size = _sizes(unit).get(name)
    if size is None:
        _refuse_unit(text, name, unit, units)
    if may_part_thousands(number):
        problem = "has a comma that may part thousands or decimals"
        refuse(text, problem, units, f"{number.replace(',', '')} or {number.replace(',', '.')}")
    amount = Fraction(number.replace(",", "."))
    if unit == "dBm":
        return _decibels(amount, name, text)
    return amount * size


def may_part_thousands(number: str) -> bool:
    """Whether the comma of a number may part thousands as well as decimals, as in ``1,000``."""
    return _THOUSANDS.fullmatch(number) is not None


def _decibels(amount: Fraction, name: str, text: str) -> Fraction:
    """A power in decibels above a milliwatt."""
    size = _sizes("dBm")[name]
    if name.startswith("dB"):
        return amount + (size if name == "dBW" else 0)
    if amount <= 0:
        refuse(text, "is not above 0", "dBm")
    return Fraction(10 * log10(float(amount * size)))


def _refuse_unit(text: str, name: str, unit: str, units: str) -> NoReturn:
    kinds = [kind for kind in UNITS if kind != unit and name in _sizes(kind)]
    if kinds:
        refuse(text, "has a unit of another kind", units)
    is_rate = unit in _OVER_TIME
    names = _sizes(unit) if is_rate and "/" in name else _single(unit)
    refuse(text, f"has an unknown unit{suggestion(name, names)}", units)


@cache
def _single(unit: str) -> dict[str, Fraction]:
    """The units of a kind that are a word, and ``m/s`` or ``bit/s`` with usual others."""
    sizes = {name: size for names, size in UNITS[unit].items() for name in names}
    usual = {"m/s": ("m/s", "km/h"), "bit/s": ("MB/h", "kB/h", "kbit/s", "bit/s")}.get(unit, ())
    return {name: _sizes(unit)[name] for name in usual} | sizes


@cache
def _sizes(unit: str) -> dict[str, Fraction]:
    """Every spelling of the units of a kind, with its size."""
    sizes = {name: size for names, size in UNITS[unit].items() for name in names}
    for above, amount in _sizes(_OVER_TIME[unit]).items() if unit in _OVER_TIME else ():
        for below, time in _sizes("s").items():
            sizes[f"{above}/{below}"] = amount / time
    return sizes


def unit_of(text: str, units: str) -> str:
    """The unit of a quantity, or of the first of two, as it was typed.

    Raises:
        InputError: If it has no unit, or one of another kind.
    """
    measured(text, units)
    return re.split(" from | at ", _split(text)[1])[0]


def times(text: str, factor: float) -> str:
    """A quantity, or the first of two, times a factor: ``5 m/s from SW`` as ``10 m/s from SW``."""
    number, rest = _split(text)
    return f"{float(number) * factor:g} {rest}"


def rounded(text: str, digits: int, is_up: bool = False) -> str:
    """A quantity, or the first of two, rounded down (or up) to so many significant digits."""
    number, rest = _split(text)
    direction = ROUND_DOWN
    if is_up:
        direction = ROUND_UP
    return f"{float(Context(digits, direction).create_decimal(number)):g} {rest}"


def _split(text: str) -> tuple[str, str]:
    """The number of a quantity, or of the first of two, and what follows it."""
    amount, *others = re.split(r"(?= from | at )", " ".join(text.split()), maxsplit=1)
    match = _NUMBER.fullmatch(amount)
    assert match
    return match[1].replace(",", "."), f"{match[2]}{''.join(others)}"


def refuse(value: object, problem: str, units: str, allowed: str = "") -> NoReturn:
    """Refuse a value that is no quantity of these units, in one line."""
    raise InputError("", f"{shown(value)} {problem}", allowed or form_of(units))


def form_of(units: str) -> str:
    """What a quantity of these units is, with an example."""
    kind, example = KINDS[units]
    return f'{kind}, such as "{example}"'


# Units in which amounts are printed.
_PRINTED = {
    "s": ("s", "min", "h", "d"),
    "m": ("m", "km"),
    "bit": ("bit", "B", "kB", "MB", "GB"),
    "bit/s": ("bit/s", "kbit/s", "Mbit/s", "Gbit/s"),
}


def printed(value: float, unit: str) -> str:
    """An amount of a unit of ``_PRINTED`` in the unit that suits it: 2100 s as ``35 min``."""
    sizes = {name: float(_sizes(unit)[name]) for name in _PRINTED[unit]}
    name = max(
        (name for name in sizes if sizes[name] <= value), key=sizes.__getitem__, default=unit
    )
    return f"{value / sizes[name]:.4g} {name}"
