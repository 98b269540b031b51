"""The exception for all bad input, and the words of its messages."""

import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from reprlib import Repr
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from dess.base.descriptions import description_of

if TYPE_CHECKING:  # the command line raises InputError long before anything needs pydantic
    from pydantic import BaseModel, ValidationError
    from pydantic.fields import FieldInfo

# The longest list of allowed names [characters], and the most names of which all are listed even
# where some of them are close to the unknown one.
_NAMES, _CLOSE = 180, 12

# What is wrong with a value, by pydantic's name of the error, or its first word.
_PROBLEMS = {
    **dict.fromkeys(("greater", "less", "finite"), "is out of range"),
    **dict.fromkeys(("dict", "model", "mapping"), "is not a table"),
    "int": "is not an integer",
    "float": "is not a number",
    "bool": "is not a truth value",
    "string_type": "is not text in quotes",
}
_WORDS = {int: "an integer", float: "a number", bool: "a truth value", str: "text in quotes"}

# A longer value is cut where a message quotes it, and a longer name where others are compared.
_QUOTED = 60
_REPR = Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = _QUOTED
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = _QUOTED // 3


class InputError(ValueError):
    """Bad input: one line that says where, what, and what is allowed.

        >>> print(InputError("uavs", "0 is too few", "1..64").within("scenario bay"))
        scenario bay: uavs: 0 is too few; allowed: 1..64

    Args:
        where: The place of the input, from the outside in, such as ``plan.toml: design``; empty if
            only the caller knows it and adds it with ``within``.
        problem: What is wrong there.
        allowed: What is allowed there; empty if the problem says it.

    Attributes:
        where: As in the arguments, as text.
        problem: As in the arguments.
        allowed: As in the arguments.
    """

    def __init__(self, where: str | Path, problem: str, allowed: str = "") -> None:
        self.where = str(where)
        self.problem = problem
        self.allowed = allowed
        super().__init__(self.where, problem, allowed)

    def __str__(self) -> str:
        if self.allowed:
            return f"{self.complaint}; allowed: {self.allowed}"
        return self.complaint

    @property
    def complaint(self) -> str:
        """Where and what, without what is allowed."""
        if self.where:
            return f"{self.where}: {self.problem}"
        return self.problem

    def within(self, place: str | Path) -> "InputError":
        """The same error of input that is a part of a larger one."""
        where = str(place)
        if self.where:
            where = f"{place}: {self.where}"
        return InputError(where, self.problem, self.allowed)

    def _render_traceback_(self) -> list[str]:
        """What a notebook shows of it, in the place of a traceback."""
        return [f"InputError: {self}"]


def check_type(name: str, value: object, kinds: Any, allowed: str) -> None:
    """Refuse a value that is of none of some types.

    Raises:
        InputError: If it is of another one.
    """
    if not isinstance(value, kinds):
        kind = type(value).__name__
        raise InputError(name, f"{shown(value)} is of type {kind}", allowed)


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
    if number < 0x10000:
        return f"\\u{number:04x}"
    return f"\\U{number:08x}"


def cut(text: str, length: int) -> str:
    """The text, without its middle if it is longer than ``length``."""
    if len(text) <= length:
        return text
    end = (length - 5) // 2
    return f"{text[: length - 5 - end]} ... {text[-end:]}"


def listed(names: Iterable[str]) -> str:
    """Names as a message lists them: of many only the first, and the number of the others."""
    listed_names = [*names]
    length = 0
    for number, name in enumerate(listed_names):
        length += len(name) + 2
        if length > _NAMES and number:
            return f"{', '.join(listed_names[:number])} and {len(listed_names) - number} others"
    return ", ".join(listed_names)


def unknown_name(
    where: str | Path, problem: str, name: object, names: Iterable[str], also: str = ""
) -> InputError:
    """The error about an unknown name: it says what may be meant, and what is allowed.

        >>> print(unknown_name("prices", "'pads' is unknown", "pads", ["uav", "pad"]))
        prices: 'pads' is unknown (did you mean pad?); allowed: uav, pad

    Args:
        where: The place of the name.
        problem: What is said about the name.
        name: The unknown name.
        names: The known names. Of many, only those that are close are printed, if there are some.
        also: What else is allowed, such as ``a TOML file``.
    """
    distinct = list(dict.fromkeys(names))
    close = _close_names(name, distinct)
    text = listed(distinct)
    if close and len(distinct) > _CLOSE:
        text = f"{', '.join(close)} and {len(distinct) - len(close)} others"
    allowed = ", or ".join(part for part in (text, also) if part)
    return InputError(where, problem + _question(close), allowed or "none")


def suggestion(name: object, names: Iterable[str]) -> str:
    """Which of the known names may be meant by another, as a question; empty if none is close."""
    return _question(_close_names(name, names))


def _close_names(name: object, names: Iterable[str]) -> list[str]:
    lower = {other.lower(): other for other in reversed([*names])}
    asked = name[:_QUOTED].lower() if isinstance(name, str) else shown(name)
    return [lower[match] for match in get_close_matches(asked, lower, cutoff=0.7)]


def _question(names: Sequence[str]) -> str:
    if not names:
        return ""
    return f" (did you mean {' or '.join(names)}?)"


def check_known(name: str, value: object, known: Iterable[str], also: str = "") -> None:
    """Refuse a value that is none of some names.

    Args:
        name: What has the value.
        value: The value.
        known: The names.
        also: What else is allowed, for the message.

    Raises:
        InputError: If it is another one.
    """
    if value not in (names := [*known]):
        raise unknown_name(name, f"{shown(value)} is unknown", value, names, also)


def validated(
    model: "type[BaseModel]", values: dict[str, Any], where: str, context: str = ""
) -> Any:
    """The model of these values.

    Args:
        model: The model.
        values: The values.
        where: Their name or path.
        context: What the validators of the model are told.

    Raises:
        InputError: If they are not valid.
    """
    from pydantic import ValidationError

    try:
        return model.model_validate(values, context=context)
    except ValidationError as error:
        raise to_input_error(error, where, model) from None


def to_input_error(error: "ValidationError", where: str, model: "type[BaseModel]") -> InputError:
    """The first error of pydantic: place and key, problem and allowed values.

    Args:
        error: The errors.
        where: Name or path of the input.
        model: The model that was validated.
    """
    errors = error.errors()
    # A key that is spelled wrongly is also missing: tell the cause.
    first = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])
    kind, value, loc = first["type"], first["input"], first["loc"]
    fields, field, is_whole = _field_at(model, loc)
    is_short = kind == "missing" and not is_whole  # an item of a list is missing
    path = [cut(str(part), _QUOTED) for part in loc[: -1 if is_short else None] if part != "[key]"]
    place = where
    if path:
        place = f"{where}: {'.'.join(path)}"
    if kind == "extra_forbidden":
        return unknown_name(place, "unknown key", loc[-1], fields)
    if kind == "literal_error":
        choices = [word.strip("'") for word in re.split(", | or ", first["ctx"]["expected"])]
        return unknown_name(place, f"{shown(value)} is unknown", value, choices)
    if kind == "union_tag_invalid":
        choices = re.findall("'([^']*)'", first["ctx"]["expected_tags"])
        named = first["ctx"]["discriminator"].strip("'")
        tag = first["ctx"]["tag"]
        return unknown_name(f"{place}.{named}", f"{shown(tag)} is unknown", tag, choices)
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        return cause.within(place)
    allowed = f"a table of {listed(fields)}"
    if field:
        allowed = form_of(field)
    if kind == "value_error":
        return InputError(place, str(cause), allowed)
    if kind == "missing" and field and is_whole:
        return InputError(place, "is missing", form_of(field, described=True))
    problem = _problem(kind)
    if is_short:
        problem = "is too short"
    return InputError(place, f"{shown(value)} {problem}", allowed)


def _problem(kind: str) -> str:
    """What is wrong with a value, by pydantic's name of the error."""
    if "too_" in kind:
        return f"is too {kind.rpartition('_')[2]}"
    return _PROBLEMS.get(kind) or _PROBLEMS.get(kind.partition("_")[0], "has the wrong form")


def form_of(field: "FieldInfo", described: bool = False) -> str:
    """What the value of a field of a model may be, in words, such as ``a number 0..100``.

    Lists and tables have their description as well; if it has a form, only that.

    Args:
        field: The field.
        described: Whether a single value has its description, too.
    """
    description = description_of(field)
    single = bool(kind_of(field) or choices_of(field))
    if (form := description.form) and not single:
        length = _length(field.metadata)
        if length:
            return f"{form} ({length.strip()})"
        return form
    text = _form(field.annotation, field.metadata)
    if description and (described or not single):
        return f"{text} ({description})"
    return text


def _form(annotation: Any, metadata: Sequence[Any]) -> str:
    """What the values of a type may be, in words."""
    origin = get_origin(annotation)
    parts = get_args(annotation)
    if origin is Annotated:
        limits = [m for part in parts[1:] for m in getattr(part, "metadata", [part])]
        return _form(parts[0], [*limits, *metadata])
    if origin in (Union, UnionType):
        kinds = (_form(part, metadata) for part in parts if part is not NoneType)
        return " or ".join(dict.fromkeys(kinds))
    if origin is Literal:
        return listed(str(part) or "empty" for part in parts)
    if origin is tuple and parts[1:] != (...,):
        return f"[{', '.join(_form(part, ()) for part in parts)}]"
    if origin in (tuple, list, dict):
        what, item = ("table", "value") if origin is dict else ("list", "item")
        inner = _form(parts[origin is dict], ())
        return f"a {what}{_length(metadata)}" + (f", each {item} {inner}" if inner else "")
    if hasattr(annotation, "model_fields"):
        return f"a table of {listed(_keys(annotation))}"
    if annotation is bool:
        return "true or false"
    if annotation is str:
        patterns = [f" like {m.pattern}" for m in metadata if getattr(m, "pattern", None)]
        return f"{_WORDS[str]}{_length(metadata)}{''.join(patterns)}"
    return f"{_WORDS.get(annotation, '')} {_limits(metadata, 'ge', 'le')}".strip()


def kind_of(field: "FieldInfo") -> str:
    """The type of a single value in words, such as ``a number``; empty for all others."""
    kinds = [kind for kind in _leaves(field.annotation) if kind is not NoneType]
    if len(kinds) == 1:
        return _WORDS.get(kinds[0], "")
    return ""


def choices_of(field: "FieldInfo") -> list[str]:
    """The words that the value of a field may be; empty if it is no choice of words."""
    is_choice = get_origin(field.annotation) is Literal
    if is_choice:
        return [*map(str, get_args(field.annotation))]
    return []


def _length(metadata: Sequence[Any]) -> str:
    limits = _limits(metadata, "min_length", "max_length")
    if limits:
        return f" of length {limits}"
    return ""


def _limits(metadata: Sequence[Any], least: str, most: str) -> str:
    """The limits in pydantic's metadata, such as ``2..256`` or ``above 0``."""
    words = {"gt": "above", least: "from", "lt": "below", most: "up to"}
    ends = {
        end: f"{getattr(limit, end):,}"
        for limit in metadata
        for end in words
        if getattr(limit, end, None) is not None
    }
    if ends.keys() == {least, most}:
        return "..".join(dict.fromkeys((ends[least], ends[most])))
    return ", ".join(f"{words[end]} {limit}" for end, limit in ends.items())


def _field_at(
    model: "type[BaseModel]", loc: Iterable[int | str]
) -> tuple[dict[str, "FieldInfo"], "FieldInfo | None", bool]:
    """What a place in the input names.

    Returns:
        The fields that may stand there, the innermost field that contains the place, and whether
        the place is the whole field, not a part of it.
    """
    fields = _keys(model)
    field = None
    is_whole = False
    for part in loc:
        is_whole = part in fields
        if is_whole:
            field = fields[str(part)]
            tables = [kind for kind in _leaves(field.annotation) if hasattr(kind, "model_fields")]
            fields = {}
            if len(tables) == 1:
                fields = _keys(tables[0])
    return fields, field, is_whole


def _keys(model: "type[BaseModel]") -> dict[str, "FieldInfo"]:
    """The fields of a model by the names that the input has for them."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def _leaves(annotation: Any) -> list[Any]:
    """The types that a union or a list is made of; any other annotation itself."""
    origin = get_origin(annotation)
    parts = get_args(annotation)
    if origin is Annotated:
        return _leaves(parts[0])
    if origin in (Union, UnionType):
        return [leaf for part in parts for leaf in _leaves(part)]
    if origin in (tuple, list, dict) and hasattr(parts[origin is dict], "model_fields"):
        return _leaves(parts[origin is dict])
    return [annotation]
