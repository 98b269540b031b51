"""The exception for all bad input, and the words of its messages."""

from collections.abc import Iterable
from difflib import get_close_matches
from reprlib import Repr
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

if TYPE_CHECKING:  # the command line raises InputError long before anything needs pydantic
    from pydantic import BaseModel, ValidationError
    from pydantic.fields import FieldInfo

# A list of allowed names that is longer is left out where a name is close to the unknown one.
_FEW = 12

# Pydantic's error types for values out of range, of another type, and for malformed lists.
_OUT_OF_RANGE = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
_OTHER_TYPE = ("int_type", "int_from_float", "float_type", "bool_type", "string_type")
_WRONG_FORM = ("tuple_type", "missing", "too_long")

_WORDS = {int: "an integer", float: "a number", bool: "a truth value", str: "text in quotes"}

# A longer value is cut where a message quotes it, and a longer name where others are compared.
_QUOTED = 60
_REPR = Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = _QUOTED
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = _QUOTED // 3


class InputError(ValueError):
    """Bad input: one line that says where, what, and what is allowed."""


def shown(value: object) -> str:
    """A value of the input as a message quotes it: in Python's notation, printable and short."""
    try:
        text = printable(_REPR.repr(value))
    except (ValueError, RecursionError):  # an integer of thousands of digits
        text = "..."
    return cut(text, _QUOTED)


def printable(text: str) -> str:
    """The text in one line, with escapes for all characters that could change the display.

    These are control characters, such as those that move the cursor of a terminal, characters that
    change the direction of text, and everything else that has no picture.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escape(ord(c)) for c in text)


def _escape(number: int) -> str:
    return f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"


def cut(text: str, length: int) -> str:
    """The text, without its middle if it is longer than ``length``."""
    if len(text) <= length:
        return text
    end = (length - 5) // 2
    return f"{text[: length - 5 - end]} ... {text[-end:]}"


def one_of(name: object, names: Iterable[str], also: str = "") -> str:
    """The end of a message about an unknown name: what may be meant, and what is allowed.

        >>> "price 'uvs' is unknown" + one_of("uvs", ["uav", "pad"])
        "price 'uvs' is unknown (did you mean uav?); allowed: uav, pad"

    Args:
        name: The unknown name.
        names: The known names. A long list of them is not printed if one of them is close.
        also: What else is allowed, such as ``a TOML file``.
    """
    known = list(dict.fromkeys(names))
    lower = {other.lower(): other for other in reversed(known)}
    asked = name[:_QUOTED].lower() if isinstance(name, str) else shown(name)
    close = [lower[match] for match in get_close_matches(asked, lower, cutoff=0.7)]
    meant = f" (did you mean {' or '.join(close)}?)" if close else ""
    allowed = ", ".join(known)
    if close and len(known) > _FEW:
        allowed = f"{', '.join(close)} and {len(known) - len(close)} others"
    if also:
        allowed += f", or {also}" if known else also
    return f"{meant}; allowed: {allowed or 'none'}"


def validation_line(error: "ValidationError", where: str, model: "type[BaseModel]") -> str:
    """The first error of pydantic as one line: place, key, problem and allowed values.

    Args:
        error: The errors.
        where: Name or path of the input.
        model: The model that was validated.
    """
    errors = error.errors()
    # A key that is spelled wrongly is also missing: tell the cause.
    first = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])
    kind, value, loc = first["type"], first["input"], first["loc"]
    place = f"{where}: {'.'.join(map(str, loc))}" if loc else where
    fields, field, is_whole = _field_at(model, loc)
    if kind == "extra_forbidden":
        return f"{place}: unknown key{one_of(loc[-1], fields)}"
    message = first["msg"].removeprefix("Value error, ")
    if kind == "value_error" or field is None:
        return f"{place}: {message}" + (f", not {shown(value)}" if kind != "value_error" else "")
    if kind == "missing" and is_whole:
        return f"{place}: is missing; allowed: {field.description}"
    if kind == "literal_error" and is_whole:
        return f"{place}: {shown(value)} is unknown{one_of(value, choices_of(field))}"
    problems = {kind: "is out of range" for kind in _OUT_OF_RANGE if is_whole}
    problems |= {kind: f"is not {kind_of(field)}" for kind in _OTHER_TYPE if is_whole}
    problems |= {kind: "has the wrong form" for kind in _WRONG_FORM}
    if kind in problems:
        return f"{place}: {shown(value)} {problems[kind]}; allowed: {form_of(field)}"
    return f"{place}: {message}, not {shown(value)}"


def form_of(field: "FieldInfo") -> str:
    """What the value of a field of a model may be, in words, such as ``a number 0..100``."""
    if choices := choices_of(field):
        return ", ".join(choices)
    kind = kind_of(field)
    if kind == _WORDS[bool]:
        return "true or false"
    if kind:
        return f"{kind} {_limits(field)}".strip()
    description = field.description or "another value"
    return description.partition(": ")[2] or description


def kind_of(field: "FieldInfo") -> str:
    """The type of a single value in words, such as ``a number``; empty for all others."""
    kinds = [kind for kind in _leaves(field.annotation) if kind is not NoneType]
    return _WORDS.get(kinds[0], "") if len(kinds) == 1 else ""


def choices_of(field: "FieldInfo") -> list[str]:
    """The words that the value of a field may be; empty if it is no choice of words."""
    is_choice = get_origin(field.annotation) is Literal
    return [*map(str, get_args(field.annotation))] if is_choice else []


def _limits(field: "FieldInfo") -> str:
    """The limits of a number, such as ``2..256`` or ``above 0``."""
    ends = {
        end: f"{getattr(limit, end):,}"
        for limit in field.metadata
        for end in ("gt", "ge", "lt", "le")
        if hasattr(limit, end)
    }
    if ends.keys() == {"ge", "le"}:
        return f"{ends['ge']}..{ends['le']}"
    words = {"gt": "above", "ge": "from", "lt": "below", "le": "up to"}
    return ", ".join(f"{words[end]} {limit}" for end, limit in ends.items())


def _field_at(
    model: "type[BaseModel]", loc: Iterable[int | str]
) -> tuple[dict[str, "FieldInfo"], "FieldInfo | None", bool]:
    """What a place in the input names.

    Returns:
        The fields that may stand there, the innermost field that contains the place, and whether
        the place is the whole field, not a part of it.
    """
    fields, field, is_whole = model.model_fields, None, False
    for part in loc:
        is_whole = part in fields
        if is_whole:
            field = fields[str(part)]
            tables = [kind for kind in _leaves(field.annotation) if hasattr(kind, "model_fields")]
            fields = tables[0].model_fields if len(tables) == 1 else {}
    return fields, field, is_whole


def _leaves(annotation: Any) -> list[Any]:
    """The types that a union or a list is made of; any other annotation itself."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _leaves(parts[0])
    if origin in (Union, UnionType):
        return [leaf for part in parts for leaf in _leaves(part)]
    if origin is tuple and parts[1:] == (...,) and hasattr(parts[0], "model_fields"):
        return _leaves(parts[0])
    return [annotation]
