"""The options and arguments that commands share, and their completion by the shell."""

import ast
import json
import math
import re
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from inspect import getdoc, getsource
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_type_hints

import typer

from dess.base.commands import command_line
from dess.base.errors import InputError, shown, unknown_name
from dess.base.files.reading import parse_toml
from dess.reports.cli.console import print_text


def complete_policies(start: str) -> list[str]:
    """Names of policies; of a team ``P,P,...`` the last one."""
    from dess.policies import names

    before, comma, last = start.rpartition(",")
    return [f"{before}{comma}{name}" for name in _names_beginning_with(names(), last)]


def use_current_names(teams: list[str] | None) -> list[str] | None:
    """Teams by the present names of their policies; of a former name, one line tells it."""
    from dess.policies.registry import current_name

    current = [current_name(team) for team in teams or []]
    for team, name in zip(teams or [], current, strict=True):
        if team != name:
            print_text(f"dess: the policy {team} is now {name}", sys.stderr)
    return current or teams


def complete_scenarios(start: str) -> list[str]:
    """Names of shipped scenarios, and of families of generated ones up to the seed."""
    from dess.scenario.scenario import scenario_families, scenario_names

    families = [name.removesuffix("SEED") for name in scenario_families()]
    return _names_beginning_with([*scenario_names(), *families], start)


def complete_studies(start: str) -> list[str]:
    """Names of shipped studies."""
    from dess.analysis import study_names

    return _names_beginning_with(study_names(), start)


def complete_configs(start: str) -> list[str]:
    """Names of shipped configs of trainings."""
    from dess.policies.learner.config import config_names

    return _names_beginning_with(config_names(), start)


def complete_fields(start: str) -> list[str]:
    """Fields of a scenario, as ``--set`` takes them."""
    from dess.scenario.fields import fields_of
    from dess.scenario.scenario import ScenarioSpace

    return [f"{name}=" for name in _names_beginning_with(fields_of(ScenarioSpace), start)]


def _names_beginning_with(names: Iterable[str], start: str) -> list[str]:
    return [name for name in names if name.startswith(start)]


if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

    from dess import ScenarioSpace
    from dess.analysis.results.shards import Shard
    from dess.analysis.study.study import Study
    from dess.model.processes import TypedProcess

SET = "--set"
RESULTS = Path("results")
PAGES = Path("build/reports")
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
        autocompletion=complete_scenarios,
        help="A shipped scenario, a generated one such as coast:7, or a TOML file.",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        SET,
        metavar="KEY=VALUE",
        autocompletion=complete_fields,
        help="Set a field of the scenario to a value in TOML syntax, a quantity such as 35 min "
        "without quotes; repeatable.",
    ),
]
SeedOption = Annotated[int, typer.Option("--seed", help="Seed of all random draws.")]
ProcessOption = Annotated[
    list[str] | None,
    typer.Option(
        "--process",
        metavar="FILE.py:FUNCTION",
        help="A process of a Python file, which takes part in every mission; repeatable. Only the "
        "SimPy engine runs it.",
    ),
]
YearsOption = Annotated[
    int | None,
    typer.Option(
        "--years",
        min=1,
        help="Years of weather, in place of missions.  [default: 10 where a scenario has weather]",
    ),
]
WorkersOption = Annotated[int, typer.Option("--workers", min=1, help="Number of processes.")]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Run on the cluster of this dask.distributed scheduler, tls://HOST:PORT or tcp://.",
    ),
]
ShardOption = Annotated[
    str | None,
    typer.Option(
        "--shard",
        metavar="I/N",
        help="Run one of N shards, such as 2/4; dess study merge joins them.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]


class Machines(NamedTuple):
    """Where missions are simulated: by processes of this machine, or on a cluster."""

    workers: int
    scheduler: str | None


def parse_shard(text: str | None, studies: "Iterable[Study]", **refused: object) -> "Shard | None":
    """The shard that is run; None for whole studies.

    Args:
        text: What is typed.
        studies: What is divided.
        **refused: Options that are of whole studies.

    Raises:
        InputError: If it is no shard, a study cannot be divided, or one of the options is given.
    """
    if text is None:
        return None
    from dess.analysis.execution.runner import check_shardable
    from dess.analysis.results.shards import Shard

    shard = Shard.parse(text)
    for study in studies:
        check_shardable(study)
    for option in (option for option, value in refused.items() if value):
        raise InputError(f"--{option}", "needs all missions", "without --shard")
    return shard


def given(context: typer.Context, name: str) -> Any:
    """The value of an option that somebody has typed; None if it is the default."""
    source = context.get_parameter_source(name)
    if source is None or source.name == "DEFAULT":
        return None
    return context.params[name]


def add_command(app: typer.Typer, name: str | None = None) -> Callable[[Callable], Callable]:
    """Make a command of a function; the part ``Args`` of its docstring describes the options."""

    def register(function: Callable) -> Callable:
        summary, _, described = read_docstring(function).partition("\n\nArgs:\n")
        hints = get_type_hints(function, include_extras=True)
        for parameter, text in re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", described, re.M):
            if not hasattr(hints[parameter], "__metadata__"):
                hints[parameter] = Annotated[hints[parameter], typer.Option()]
            hints[parameter].__metadata__[0].help = re.sub(r"\n {8}", " ", text)
        function.__annotations__ = hints
        return app.command(name, help=summary)(function)

    return register


def read_docstring(function: Callable) -> str:
    """The docstring of a function, also under ``python -OO``, which leaves it out."""
    if sys.flags.optimize < 2:
        return getdoc(function) or ""
    (definition,) = ast.parse(getsource(function)).body
    assert isinstance(definition, ast.FunctionDef)
    return ast.get_docstring(definition) or ""


def typed_processes(names: list[str] | None) -> "list[TypedProcess]":
    """The names of ``--process``, whose files may be run."""
    from dess.model.processes import TypedProcess

    return [TypedProcess(name) for name in names or []]


def note_departures(policies: Iterable[str], spaces: "Iterable[ScenarioSpace]") -> None:
    """Say on stderr which trained policies act outside of what they were trained on."""
    from dess.policies.registry import list_departures

    for line in list_departures(policies, spaces):
        print_text(f"note: {line}", sys.stderr)


def print_notes(notes: Iterable[str]) -> None:
    """Print notes on stderr, such as which nodes no UAV can serve."""
    for line in notes:
        print_text(f"note: {line}", sys.stderr)


def load_space(name: str, settings: list[str] | None) -> "ScenarioSpace":
    """A scenario by name or file, with the fields that ``--set`` sets.

    Raises:
        InputError: If there is no such scenario, or a setting is not valid.
    """
    from dess import load_scenario

    return load_scenario(name, **parse_settings(settings))


def parse_settings(settings: list[str] | None) -> dict[str, Any]:
    """The fields that ``--set`` sets; the last one counts where a field is set twice.

    Raises:
        InputError: If a setting is not valid.
    """
    return dict(parse_setting(text) for text in settings or [])


def parse_setting(text: str, option: str = SET, allowed: str = FIELD) -> tuple[str, Any]:
    """Parse ``KEY=VALUE``.

    Args:
        text: The argument.
        option: The option it was given to, for the message.
        allowed: What the option accepts, for the message.

    Raises:
        InputError: If the text has another form.
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    if allowed == FIELD and takes_quantities(key) and value:
        value = _quote_quantities(value)
    elif equals:
        _refuse_number(value, f"{option}: {key}", allowed != FIELD)
    with suppress(InputError):
        parsed = parse_toml(f"value = {value}", option)
        if equals and parsed.keys() == {"value"} and _is_plain(parsed["value"]):
            return key, parsed["value"]
    if allowed == FIELD and (_RANGE.fullmatch(value) or "," in value.partition("[")[0]):
        many = command_line("sweep", set=[text])
        raise InputError(option, f"{shown(text)} has several values", f"one, or {many}")
    if allowed == FIELD and value:
        _check_word(key, value, option)
        return key, value
    if key and value and equals:
        raise InputError(f"{option}: {key}", f"{shown(value)} is no number", allowed)
    raise InputError(option, f"{shown(text)} is not KEY=VALUE", allowed)


def _refuse_number(value: str, where: str, is_amount: bool = True) -> None:
    """Refuse a number as people write it and TOML does not, or reads as another one.

    Args:
        value: The value.
        where: Where it stands, for the message.
        is_amount: Whether it is a price or a share, and not a field of a scenario, of which a comma
            parts several values.

    Raises:
        InputError: If it is one: the message says what may be meant.
    """
    from dess.scenario.quantities import may_part_thousands

    joined = value.replace(",", "").replace(".", "")
    problem = "is no number"
    if may_part_thousands(value) or (is_amount and may_part_thousands(value.replace(".", ","))):
        problem = "may be a thousand or a fraction"
        meant = f"{joined} or {float(value.replace(',', '.'))}"
        if not is_amount:
            problem = "has a comma that may part thousands or values"
            meant = f"{joined}, or dess sweep for several values"
    elif re.fullmatch(r"[-+]?(\.[0-9]+|[0-9]+\.)", value):
        meant = str(float(value))
    elif re.fullmatch(r"[-+]?0[0-9]+", value):
        meant = str(int(value))
    elif is_amount and re.fullmatch(r"[-+]?[0-9]+,[0-9]+", value):
        meant = value.replace(",", ".")
    elif is_amount and re.fullmatch(r"[-+]?[0-9]+(\.[0-9]+)? ?%", value):
        meant = f"{float(value.rstrip(' %')) / 100:g}"
    else:
        return
    raise InputError(where, f"{shown(value)} {problem}", meant)


def takes_quantities(field: str) -> bool:
    """Whether a field has quantities, such as ``35 min``, or other text of the weather."""
    from dess.scenario.data_sheet import DataSheet
    from dess.scenario.weather import Weather

    section, _, name = field.partition(".")
    if section == "weather" and name in Weather.model_fields:
        return Weather.model_fields[name].annotation is str
    return section == "data_sheet" and name in DataSheet.model_fields


# A comma that parts values, and no decimals.
_PARTING = re.compile(r",(?![0-9])|(?<![0-9]),")
# A text in quotes, or all up to the next comma or bracket.
_QUANTITY = re.compile(r"""("(?:[^"\\]|\\.)*"|'[^']*')|[^\[\],"']+""")


def _quote_quantities(value: str, is_single: bool = True) -> str:
    """A value of quantities in TOML syntax: ``20 kB/h`` and ``[1 kB, 2 kB]`` get their quotes.

    Args:
        value: The value.
        is_single: Whether it is one value, so that a comma outside of a list is a decimal one.
    """
    if is_single and not _PARTING.search(value) and not set(value) & set("[]\"'"):
        return json.dumps(value)
    return _QUANTITY.sub(lambda item: item[0] if item[1] else _with_quotes(item[0]), value)


def _with_quotes(text: str) -> str:
    if not text.strip():
        return text
    return json.dumps(text.strip())


def _find_field(name: str, option: str = SET) -> "FieldInfo":
    """The field of a scenario; ``InputError`` if there is none."""
    from dess.scenario.fields import fields_of
    from dess.scenario.scenario import ScenarioSpace

    fields = fields_of(ScenarioSpace)
    if name not in fields:
        raise unknown_name(f"{option}: {name}", "unknown key", name, fields)
    return fields[name]


def _check_word(name: str, word: str, option: str = SET) -> None:
    """Refuse a value that is no TOML, such as ``lots``, in the words of the field of a scenario.

    Raises:
        InputError: If the field is none of those that words need no quotes for, or may not be this
            word; or if there is no such field.
    """
    from dess.base.errors import choices_of, form_of, kind_of

    field = _find_field(name, option)
    words = choices_of(field)
    kind = kind_of(field)
    if word in words or kind == "text in quotes":
        return
    if words:
        raise unknown_name(f"{option}: {name}", f"{shown(word)} is unknown", word, words)
    problem = "has the wrong form"
    if kind:
        problem = f"is not {kind}"
    raise InputError(f"{option}: {name}", f"{shown(word)} {problem}", form_of(field))


def _is_plain(value: Any) -> bool:
    """Whether fields and parameters can have a value: dates and nan are not allowed."""
    if isinstance(value, dict):
        return all(map(_is_plain, value.values()))
    if isinstance(value, list):
        return all(map(_is_plain, value))
    return isinstance(value, str | int) or (isinstance(value, float) and math.isfinite(value))


RANGE_FORM = (
    "a field of the scenario and its values: 2..5, 0.01..0.05:5 (five values), or 1,2,4 in TOML "
    "syntax"
)
_RANGE = re.compile(r"(?P<low>[^\[\]'\",]*?)\.\.(?P<high>[^\[\]'\",:]*)(:(?P<count>.*))?")


def parse_all_values(texts: Iterable[str]) -> dict[str, tuple[Any, ...]]:
    """The values of all fields.

    Raises:
        InputError: If a text has another form, or a field is set twice.
    """
    return _refuse_repetition("--set", map(parse_values, texts))


def parse_all_settings(
    texts: Iterable[str], option: str = SET, allowed: str = FIELD
) -> dict[str, Any]:
    """The keys and values of an option such as ``--price uav=20000``.

    Raises:
        InputError: If a text has another form, or a key is set twice.
    """
    return _refuse_repetition(option, (parse_setting(text, option, allowed) for text in texts))


def parse_values(text: str) -> tuple[str, tuple[Any, ...]]:
    """A field and its values: one is fixed, several are swept.

    Raises:
        InputError: If the text has another form, or a range is none.
    """
    from dess.analysis.ask.question import list_values

    field, equals, values = (part.strip() for part in text.partition("="))
    if equals:
        _find_field(field)
    if takes_quantities(field):
        values = _quote_quantities(values, is_single=False)
    elif match := _RANGE.fullmatch(values):
        return field, list_values(field, _parse_range(field, text, **match.groupdict()))
    try:
        listed = parse_setting(f"{field}=[{values}]" if equals else text, allowed="")[1]
    except InputError:
        listed = [word.strip() for word in values.split(",")]
        named = [word for word in listed if word.replace("-", "_").isidentifier()]
        for word in listed if equals else ():
            _refuse_number(word, f"{SET}: {field}", is_amount=False)
        for word in named:
            _check_word(field, word)
        if not equals or len(named) < len(listed):
            raise _range_error(text, "is not KEY=VALUES", RANGE_FORM) from None
    return field, list_values(field, listed)


def _parse_range(field: str, text: str, low: str, high: str, count: str | None) -> Any:
    """The values of ``low..high`` or ``low..high:count``."""
    from dess.analysis.study.design import INTEGERS

    first = _parse_number(text, low)
    last = _parse_number(text, high)
    if first > last:
        turned = f"{field}={high.strip()}..{low.strip()}"
        if count is not None:
            turned += f":{count}"
        raise _range_error(text, "begins with the larger number", turned)
    if count is not None:
        return _space_evenly(text, first, last, count, field in INTEGERS)
    if field not in INTEGERS:
        raise _range_error(text, "has no number of values", f"{text}:5, for five of them")
    if not _is_whole(first) or not _is_whole(last):
        raise _range_error(text, "has an end that is not an integer", f"integers, as {field} has")
    return range(int(first), int(last) + 1)


def _space_evenly(
    text: str, first: Decimal, last: Decimal, count: str, is_integer: bool
) -> list[Any]:
    """Evenly spaced numbers, both ends included."""
    from dess.analysis.study.design import MAX_SIZE

    number = 0
    if count.strip().isdecimal():
        number = int(count)
    if not 2 <= number <= MAX_SIZE:
        raise _range_error(text, "has no number of values", f"2 to {MAX_SIZE:,} after the colon")
    values = [first + (last - first) * place / (number - 1) for place in range(number)]
    if is_integer:
        if not all(map(_is_whole, values)):
            raise _range_error(text, f"has {number} values that are not integers", "another number")
        return [int(value) for value in values]
    return [float(value) for value in values]


def _is_whole(number: Decimal) -> bool:
    return number == number.to_integral_value()  # unlike %, also where it has very many digits


def _parse_number(text: str, end: str) -> Decimal:
    with suppress(InvalidOperation):
        number = Decimal(end.strip())
        if abs(number) <= Decimal("1e300"):
            return number
    raise _range_error(text, f"has an end {end.strip()!r} that is not a number", RANGE_FORM)


def _range_error(text: str, problem: str, allowed: str) -> InputError:
    return InputError("--set", f"{text!r} {problem}", allowed)


def _refuse_repetition(option: str, pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    unique: dict[str, Any] = {}
    for key, value in pairs:
        if key in unique:
            raise InputError(option, f"{key} is given twice", "once")
        unique[key] = value
    return unique
