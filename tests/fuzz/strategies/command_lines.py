"""Command lines: every command and option that there is, with plain and with odd values."""

from collections.abc import Iterator
from functools import cache
from typing import Any

import typer
from hypothesis import strategies as st

from reports.cli.commands import app
from tests.fuzz import ready
from tests.fuzz.case import Case
from tests.fuzz.steps import Copy
from tests.fuzz.strategies.sections import FIELDS, PLAIN, odd_settings
from tests.fuzz.strategies.values import long_texts, numbers, texts, toml_values

OUTPUTS = {"--out", "--events", "--figure", "--animation", "--crate"}
_UNUSED = {"--install-completion", "--show-completion"}  # about the shell of a user
# Plain values, by the name of the option or argument.
_PLAIN: dict[str, tuple[str, ...]] = {
    "--scenario": ("paper", "bay", f"../in/{ready.SCENARIO}", f"../in/{ready.SECTIONS}"),
    "--set": ("uavs=2", "initial_data=[5, 20]", "pads=1", "max_slots=20", *PLAIN),
    "--policy": ("greedy", "random,nearest", f"../in/{ready.POLICY}"),
    "--missions": ("1", "2", "3"),
    "--workers": ("1",),
    "--seed": ("0", "7"),
    "--replication": ("0", "3"),
    "--of": (f"../in/{ready.RESULTS}",),
    "--point": ("0", "1"),
    "--engine": ("batch", "events"),
    "--device": ("cpu",),
    "--worst": ("0", "3"),
    "--most": ("0", "3"),
    "--target": ("success=0.9", "ratio=0.5"),
    "--require": ("success=0.9",),
    "--price": ("uav=1000", "hour=5", "currency=EUR"),
    "--parameter": ("missions=3",),
    "--results": ("../in",),
    "--license": ("MIT",),
    "--page": (f"../in/{ready.PAGE}",),
    "--name": ("a",),
    "dir": (f"../in/{ready.RESULTS}", f"../in/{ready.SELECTED}", f"../in/{ready.EXTENDED}"),
    "page|dir": (f"../in/{ready.RESULTS}", f"../in/{ready.PAGE}"),
    "name": ("greedy", "paper", "fig4", f"../in/{ready.STUDY}"),
}
_ENDINGS = {"--events": ".parquet", "--figure": ".png", "--animation": ".gif", "--crate": ".zip"}


def _commands(command: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The words of every command, with its parameters."""
    inner = getattr(command, "commands", {})
    for name, one in inner.items():
        yield from _commands(one, (*words, name))
    if not inner or command.invoke_without_command:
        unused = {*_UNUSED, "--results"} if words == ("sweep",) else _UNUSED  # there an output
        yield words, [p for p in command.params if not {*p.opts} & unused]


COMMANDS = [*_commands(typer.main.get_command(app))]


@st.composite
def command_lines(draw: st.DrawFn) -> Case:
    """A command with some of its options, at most two of them odd."""
    words, parameters = draw(st.sampled_from(COMMANDS))
    odd = draw(st.integers(0, 2))
    chosen = draw(st.lists(st.sampled_from(parameters), max_size=5)) if parameters else []
    named = [p for p in parameters if p.required or p.name in ("missions", "out")]
    arguments = [*words]
    if words == ("sweep",):
        arguments += ["--results", "../out"]
    for number, parameter in enumerate([*named, *chosen]):
        arguments += _words(draw, parameter, is_odd=number >= len(named) + len(chosen) - odd)
    if draw(st.integers(0, 9)) == 0:
        arguments.insert(draw(st.integers(0, len(arguments))), draw(texts | long_texts))
    if words == ("report",):  # it would render all reports
        arguments.append(draw(texts))
    inputs = (ready.SCENARIO, ready.STUDY, ready.RESULTS, ready.SELECTED, ready.POLICY, ready.PAGE)
    inputs += (ready.SECTIONS, ready.STORM, ready.EXTENDED)
    steps = tuple(Copy(name, f"in/{name}") for name in inputs)
    return Case("command line", tuple(arguments), steps, lasting=2)


def _words(draw: st.DrawFn, parameter: Any, is_odd: bool) -> list[str]:
    """An option with a value, or the value of an argument."""
    is_option = parameter.param_type_name == "option"
    name = parameter.opts[0] if is_option else str(parameter.metavar or parameter.name).lower()
    if is_option and parameter.is_flag:
        return [name]
    value = draw(_odd(name) if is_odd else st.sampled_from(_plain(name)))
    if name in OUTPUTS:  # nothing is written elsewhere
        value = f"../out/{value.replace('/', '').replace('..', '')}{_ENDINGS.get(name, '')}"
    return [f"{name}={value}"] if is_option else [value]


def _plain(name: str) -> tuple[str, ...]:
    return next((_PLAIN[key] for key in (name, name.split("|")[0]) if key in _PLAIN), ("a",))


@cache
def _odd(name: str) -> st.SearchStrategy[str]:
    odd = st.one_of(texts, numbers, long_texts)
    if name in ("--set", "--parameter", "--price", "--target", "--require"):
        odd |= st.tuples(st.sampled_from(FIELDS) | texts, toml_values).map("=".join)
        odd |= odd_settings
    return st.sampled_from(_plain(name)) if name == "--results" else odd
