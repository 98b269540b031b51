"""Options that commands share and how they are described; ``KEY=VALUE`` as ``--set`` takes it.

Values are in TOML syntax: ``setting("initial_data=[5, 20]")`` is ``("initial_data", [5, 20])``.
"""

import math
import re
from collections.abc import Callable
from inspect import getdoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from dess.errors import InputError, one_of, shown
from dess.files.parsing import parse_toml
from reports.cli import completion

if TYPE_CHECKING:
    from dess import ScenarioSpace

SET = "--set"
RESULTS, PAGES = Path("results"), Path("build/reports")
FIELD = "a field of the scenario and a value in TOML syntax, e.g. uavs=2 or initial_data=[5, 20]"
PARAMETER = (
    "a parameter of the notebooks and a value in TOML syntax, e.g. missions=500, "
    """or text in quotes: 'scenario="bay"'"""
)

ScenarioOption = Annotated[
    str,
    typer.Option(
        "--scenario",
        metavar="NAME|FILE",
        autocompletion=completion.scenarios,
        help="A shipped scenario, a generated one such as coast:7, or a TOML file.",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        SET,
        metavar="KEY=VALUE",
        autocompletion=completion.fields,
        help="Set a field of the scenario to a value in TOML syntax; repeatable.",
    ),
]
SeedOption = Annotated[int, typer.Option("--seed", help="Seed of all random draws.")]
WorkersOption = Annotated[int, typer.Option("--workers", min=1, help="Number of processes.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]


def command(app: typer.Typer, name: str | None = None) -> Callable[[Callable], Callable]:
    """Make a command of a function; the part ``Args`` of its docstring describes the options."""

    def register(function: Callable) -> Callable:
        summary, _, described = (getdoc(function) or "").partition("\n\nArgs:\n")
        hints = get_type_hints(function, include_extras=True)
        for parameter, text in re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", described, re.M):
            if not hasattr(hints[parameter], "__metadata__"):
                hints[parameter] = Annotated[hints[parameter], typer.Option()]
            hints[parameter].__metadata__[0].help = re.sub(r"\n {8}", " ", text)
        function.__annotations__ = hints
        return app.command(name, help=summary)(function)

    return register


def load_space(name: str, settings: list[str] | None) -> "ScenarioSpace":
    """A scenario by name or file, with the fields that ``--set`` sets.

    Raises:
        InputError: If there is no such scenario, or a setting is not valid.
    """
    from dess import load_scenario

    return load_scenario(name, **dict(setting(text) for text in settings or []))


def setting(text: str, option: str = SET, allowed: str = FIELD) -> tuple[str, Any]:
    """Parse ``KEY=VALUE``.

    Args:
        text: The argument.
        option: The option it was given to, for the message.
        allowed: What the option accepts, for the message.

    Raises:
        InputError: If the text has another form.
    """
    key, equals, value = text.partition("=")
    try:
        parsed = parse_toml(f"value = {value}", option)
    except InputError:
        parsed = {}
    if not equals or parsed.keys() != {"value"} or not _is_plain(parsed["value"]):
        if option == SET and value.strip() in choices(key.strip()):
            return key.strip(), value.strip()
        if option == SET and value.strip():
            check_words(key.strip(), value.strip())
        raise InputError(f"{option}: {shown(text)} is not KEY=VALUE; allowed: {allowed}")
    return key.strip(), parsed["value"]


def choices(field: str) -> list[str]:
    """The words that a field of a scenario may be, which need no quotes; empty for all others."""
    from dess.errors import choices_of
    from dess.scenario import ScenarioSpace, fields_of

    known = fields_of(ScenarioSpace).get(field)
    return choices_of(known) if known is not None else []


def check_words(field: str, value: str) -> None:
    """Refuse a value that is no TOML, such as ``lots``, in the words of the field of a scenario.

    Raises:
        InputError: If the scenario has such a field, and if it has not.
    """
    from dess.errors import form_of, kind_of
    from dess.scenario import ScenarioSpace, fields_of

    fields = fields_of(ScenarioSpace)
    if field not in fields:
        raise InputError(f"{SET}: {field}: unknown key{one_of(field, fields)}")
    known = fields[field]
    if words := choices(field):
        raise InputError(f"{SET}: {field}: {shown(value)} is unknown{one_of(value, words)}")
    problem = f"is not {kind_of(known)}" if kind_of(known) else "has the wrong form"
    raise InputError(f"{SET}: {field}: {shown(value)} {problem}; allowed: {form_of(known)}")


def _is_plain(value: Any) -> bool:
    """Whether fields and parameters can have a value: dates and nan are not allowed."""
    if isinstance(value, list | dict):
        return all(map(_is_plain, value.values() if isinstance(value, dict) else value))
    return isinstance(value, str | int) or (isinstance(value, float) and math.isfinite(value))
