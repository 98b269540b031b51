"""The values of a field on the command line of ``dess sweep``.

values_of("uavs=2..5")  # ("uavs", (2, 3, 4, 5))
values_of("arrival_rate=0.01..0.05:5")  # ("arrival_rate", (0.01, 0.02, 0.03, 0.04, 0.05))
values_of("pads=1,2,4")  # ("pads", (1, 2, 4))
values_of("initial_data=[5, 10],[10, 20]")  # ("initial_data", ([5, 10], [10, 20]))
"""

import re
from collections.abc import Iterable
from decimal import Decimal, InvalidOperation
from typing import Any

from dess.errors import InputError, one_of
from reports.cli.settings import check_words, choices, setting

ALLOWED = (
    "a field of the scenario and its values: 2..5, 0.01..0.05:5 (five values), or 1,2,4 in TOML "
    "syntax"
)
_RANGE = re.compile(r"(?P<low>[^\[\]'\",]*?)\.\.(?P<high>[^\[\]'\",:]*)(:(?P<count>.*))?")


def all_values(texts: Iterable[str]) -> dict[str, tuple[Any, ...]]:
    """The values of all fields.

    Raises:
        InputError: If a text has another form, or a field is set twice.
    """
    return _once("--set", map(values_of, texts))


def all_settings(texts: Iterable[str], option: str, allowed: str) -> dict[str, Any]:
    """The keys and values of an option such as ``--price uav=20000``.

    Raises:
        InputError: If a text has another form, or a key is set twice.
    """
    return _once(option, (setting(text, option, allowed) for text in texts))


def values_of(text: str) -> tuple[str, tuple[Any, ...]]:
    """A field and its values: one is fixed, several are swept.

    Raises:
        InputError: If the text has another form, or a range is none.
    """
    from analysis.sweeps import values as sweeps
    from dess.scenario import ScenarioSpace, fields_of

    field, equals, values = text.partition("=")
    field = field.strip()
    fields = fields_of(ScenarioSpace)
    if equals and field not in fields:
        raise InputError(f"--set: {field}: unknown key{one_of(field, fields)}")
    if found := _RANGE.fullmatch(values.strip()):
        return field, sweeps.listed(field, _range(field, text, **found.groupdict()))
    try:
        listed = setting(f"{field}=[{values}]" if equals else text)[1]
    except InputError:
        listed = [word.strip() for word in values.split(",")]
        if unknown := [word for word in listed if word not in choices(field)]:
            for word in filter(str.isidentifier, unknown):
                check_words(field, word)
            raise _refused(text, "is not KEY=VALUES", ALLOWED) from None
    return field, sweeps.listed(field, listed)


def _range(field: str, text: str, low: str, high: str, count: str | None) -> Any:
    """The values of ``low..high`` or ``low..high:count``."""
    from analysis.study.design import INTEGERS

    first, last = _number(text, low), _number(text, high)
    if first > last:
        number = "" if count is None else f":{count}"
        turned = f"{field}={high.strip()}..{low.strip()}{number}"
        raise _refused(text, "begins with the larger number", turned)
    if count is not None:
        return _spaced(text, first, last, count, field in INTEGERS)
    if field not in INTEGERS:
        raise _refused(text, "has no number of values", f"{text}:5, for five of them")
    if not _is_whole(first) or not _is_whole(last):
        raise _refused(text, "has an end that is not an integer", f"integers, as {field} has")
    return range(int(first), int(last) + 1)


def _spaced(text: str, first: Decimal, last: Decimal, count: str, is_integer: bool) -> list[Any]:
    """Evenly spaced numbers, both ends included."""
    from analysis.study.design import MAX_SIZE

    number = int(count) if count.strip().isdecimal() else 0
    if not 2 <= number <= MAX_SIZE:
        raise _refused(text, "has no number of values", f"2 to {MAX_SIZE:,} after the colon")
    values = [first + (last - first) * place / (number - 1) for place in range(number)]
    if is_integer:
        if not all(map(_is_whole, values)):
            raise _refused(text, f"has {number} values that are not integers", "another number")
        return [int(value) for value in values]
    return [float(value) for value in values]


def _is_whole(number: Decimal) -> bool:
    return number == number.to_integral_value()  # unlike %, also where it has very many digits


def _number(text: str, end: str) -> Decimal:
    try:
        number = Decimal(end.strip())
        if abs(number) <= Decimal("1e300"):
            return number
    except InvalidOperation:
        pass
    raise _refused(text, f"has an end {end.strip()!r} that is not a number", ALLOWED)


def _refused(text: str, problem: str, allowed: str) -> InputError:
    return InputError(f"--set: {text!r} {problem}; allowed: {allowed}")


def _once(option: str, pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise InputError(f"{option}: {key} is given twice; allowed: once")
        found[key] = value
    return found
