"""The commands as the program has them: their parameters, what these read, and plain values.

A new command or option is found by itself. A test fails until it has a plain value here.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import typer

from dess.reports.cli.commands import app
from dess.reports.pages.notebook import NAMES
from tests.fuzz import ready
from tests.fuzz.strategies.sections import PLAIN as SETTINGS

Words = tuple[str, ...]
Values = Mapping[str, str | None]  # by the names of parameters; None for a flag

_UNUSED = {"--install-completion", "--show-completion"}  # about the shell of a user
SEA, RESULTS, POLICY, PAGE = (
    f"../in/{name}" for name in (ready.SCENARIO, ready.RESULTS, ready.POLICY, ready.PAGE)
)
ENDINGS = {  # of files, or of a folder, that an option writes
    "--events": (".parquet",),
    "--figure": (".png",),
    "--animation": (".gif", ".html"),
    "--crate": (".zip",),
    "--path": (".geojson", ".csv"),
    "--plan": ("",),
    "scenarios new path": (".toml",),
}
OUTPUTS = {"--out", *ENDINGS}
# The kinds of inputs that a parameter reads: that of a command, or of all that have it. Those of
# commands that also write there are beside the other outputs.
READS = {
    "--scenario": ("scenario",),
    "--policy": ("policy",),
    "--of": ("results",),
    "--page": ("page",),
    "train name": ("config",),
    "train --out": ("policy",),
    "train --from": ("policy",),
    "policies show name": ("policy",),
    "scenarios show name": ("scenario",),
    "studies show name": ("study",),
    "study run names": ("study",),
    "study run --out": ("results",),
    "study show folder": ("results",),
    "study diff a": ("results",),
    "study diff b": ("results",),
    "study export folder": ("results",),
    "study merge folders": ("results",),
    "study merge --out": ("results",),
    "report names": ("results",),
    "verify path": ("results", "page"),
    "sweep --results": ("swept",),
    "what-if --results": ("asked",),
}
# What a command always has, unless another value is drawn.
BASE: dict[str, dict[str, str | None]] = {
    "evaluate": {"--policy": "greedy", "--missions": "2"},
    "train": {"train name": f"../in/{ready.TRAINING}", "--out": "../out/a", "--device": "cpu"},
    "sweep": {
        **{"--results": "../out/results", "--out": "../out/pages", "--name": "kept"},
        **{"--scenario": SEA, "--set": "uavs=1..2", "--missions": "2"},
    },
    "what-if": {
        **{"--results": "../out/results", "--out": "../out/pages", "--scenario": SEA},
        **{"--set": "uavs=2", "--baseline": "uavs=1", "--policy": "greedy", "--missions": "2"},
    },
    "report": {"report names": RESULTS, "--out": "../out/pages"},
    "verify": {"verify path": RESULTS, "--missions": "2"},
    "policies show": {"policies show name": POLICY},
    "scenarios show": {"scenarios show name": SEA},
    "scenarios new": {"scenarios new path": "../in/new.toml", "--nodes": "../in/bay.csv"},
    "studies show": {"studies show name": f"../in/{ready.STUDY}"},
    "study run": {"study run names": f"../in/{ready.STUDY}", "--out": "../out/a"},
    "study merge": {"study merge folders": RESULTS, "--out": "../out/a"},
    "study show": {"study show folder": RESULTS},
    "study diff": {"study diff a": RESULTS, "study diff b": RESULTS},
    "study export": {"study export folder": RESULTS, "--crate": "../out/a.zip", "--page": PAGE},
}
# Plain values, by the name of the parameter.
PLAIN: dict[str, tuple[str, ...]] = {
    "--scenario": ("paper", "bay", SEA, f"../in/{ready.SECTIONS}"),
    "--set": ("uavs=2", "initial_data=[5, 20]", "pads=1", "max_slots=20", *SETTINGS),
    "--baseline": ("uavs=1", "pads=2"),
    "--policy": ("greedy", "random,nearest", POLICY),
    "--process": (f"../in/{ready.PROCESS}:log_slots",),
    "--shown": ("greedy",),
    "--missions": ("1", "2", "3"),
    "--workers": ("1",),
    "--shard": ("1/2", "2/2"),
    "--seed": ("0", "7"),
    "--replication": ("0", "3"),
    "--of": (RESULTS,),
    "--point": ("0", "1"),
    "--start": ("2026-06-01T08:00Z",),
    "--window": ("2013-02-11T18",),
    "--years": ("2",),
    "--air-distance": ("10 m", "30 ft"),
    "--ground-distance": ("3 m",),
    "--compare": ("0", "1"),
    "--engine": ("batch", "events"),
    "--device": ("cpu",),
    "--from": (POLICY,),
    "--metric": ("product", "reward", "cost", "age"),
    "--worst": ("0", "3"),
    "--most": ("0", "3"),
    "--target": ("success=0.9", "ratio=0.5"),
    "--require": ("success=0.9",),
    "--price": ("uav=1000", "hour=5", "currency=EUR"),
    "--parameter": ("missions=3", 'policies=["greedy"]', "seed=1"),
    "--results": ("../out/results",),
    "--license": ("MIT",),
    "--name": ("a",),
    "--page": (PAGE,),
    "--figures": ("svg", "png,pdf"),
    "--scheduler": ("there",),  # an address without an answer takes long: see dear.py
    "report names": (*NAMES, RESULTS),
    "policies show name": ("greedy", POLICY),
    "scenarios show name": ("paper", SEA),
    "studies show name": ("fig4", f"../in/{ready.STUDY}"),
    "verify path": (RESULTS, PAGE),
    "study show folder": (RESULTS, f"../in/{ready.SELECTED}", f"../in/{ready.EXTENDED}"),
}


def _commands(command: Any, words: Words = ()) -> Iterator[tuple[Words, list[Any]]]:
    """The words of every command, with its parameters."""
    inner = getattr(command, "commands", {})
    for name, one in inner.items():
        yield from _commands(one, (*words, name))
    if not inner or command.invoke_without_command:
        yield words, [p for p in command.params if not {*p.opts} & _UNUSED]


COMMANDS = [*_commands(typer.main.get_command(app))]


def name_of(words: Words, parameter: Any) -> str:
    """The name of an option, or that of an argument behind the words of its command."""
    is_option = parameter.param_type_name == "option"
    return parameter.opts[0] if is_option else " ".join((*words, parameter.name))


def is_flag(parameter: Any) -> bool:
    """Whether a parameter is an option without a value."""
    return parameter.param_type_name == "option" and parameter.is_flag


def kinds_of(words: Words, parameter: Any) -> tuple[str, ...]:
    """The kinds of inputs that a parameter reads."""
    name = name_of(words, parameter)
    return READS.get(" ".join((*words, name)), READS.get(name, ()))


# Every parameter that reads inputs, with the words of its command.
READING = [(words, p) for words, parameters in COMMANDS for p in parameters if kinds_of(words, p)]


def plain(words: Words, parameter: Any) -> tuple[str, ...]:
    """The plain values of a parameter; an output is one."""
    name = name_of(words, parameter)
    base = BASE.get(" ".join(words), {}).get(name)
    known = PLAIN.get(name, (base,) if base else ())
    return known or (
        tuple(f"../out/a{end}" for end in ENDINGS.get(name, ("",))) if name in OUTPUTS else ()
    )


def line(words: Words, *values: Values) -> Words:
    """The words of a command line: values of later arguments replace those of the base."""
    merged = {**BASE.get(" ".join(words), {})}
    for more in values:
        merged |= more
    options = [n if v is None else f"{n}={v}" for n, v in merged.items() if n.startswith("--")]
    texts = [v for n, v in merged.items() if not n.startswith("--") and v is not None]
    return (*words, *options, *texts)
