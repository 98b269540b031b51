"""The words of the command line, the keys of its JSON, and the columns of files."""

import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
import typer
from click.testing import CliRunner

from dess.analysis.results import parquet
from dess.model.events import EVENT_COLUMNS
from dess.reports.cli.commands import app
from tests.pins.pinned import pinned
from tests.reports.cli.conftest import dess, dess_json, unrendered

__all__ = ["dess", "dess_json", "unrendered"]  # fixtures

SWEEP = ["sweep", "--scenario", "small.toml", "--set", "uavs=1,2", "--policy", "greedy,random"]
WHAT_IF = ["what-if", "--scenario", "small.toml", "--policy", "greedy"]
COMMANDS = {
    "simulate": ["simulate", "--scenario", "small.toml", "--policy", "greedy"],
    "evaluate": ["evaluate", "--scenario", "small.toml", "--policy", "greedy", "--missions", "5"],
    "sweep": [*SWEEP, "--price", "uav=2", "--require", "success=0.5", "--name", "asked"],
    "what-if": [*WHAT_IF, "--set", "uavs=1", "--baseline", "uavs=2", "--missions", "3"],
    "study show": ["study", "show", "trial"],
    "study diff": ["study", "diff", "trial", "again"],
    "verify": ["verify", "trial", "--missions", "2", "--seed", "1"],
    "policies show": ["policies", "show", "generalist"],
    "scenarios show": ["scenarios", "show", "paper"],
    "studies show": ["studies", "show", "pads"],
}


def _commands(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    yield path
    for name, further in sorted(getattr(command, "commands", {}).items()):
        yield from _commands(further, (*path, name))


def _shape(value: Any) -> Any:
    """A JSON value without its content: the keys of objects, and what kind the rest is."""
    if isinstance(value, dict):
        return {key: _shape(entry) for key, entry in value.items()}
    if isinstance(value, list):
        shapes = [_shape(entry) for entry in value]
        return [shape for n, shape in enumerate(shapes) if shape not in shapes[:n]]
    return "number" if type(value) in (int, float) else type(value).__name__


def helps(option: str = "--help") -> str:
    """The help of every command."""
    command, run = typer.main.get_command(app), CliRunner(env={"COLUMNS": "80"}).invoke
    return "\n".join(run(command, [*path, option]).output for path in _commands(command))


def test_every_help_is_the_kept_one():
    pinned("help.txt", helps())


@pytest.mark.slow
@pytest.mark.brief
def test_python_without_docstrings_has_the_same_help_and_so_has_h():
    code = "from tests.pins import test_contracts; print(test_contracts.helps('-h'), end='')"
    command = [sys.executable, "-OO", "-c", code]
    assert subprocess.run(command, capture_output=True, text=True).stdout == helps()


@pytest.mark.usefixtures("unrendered")
def test_the_keys_of_every_json_document_are_the_kept_ones(dess, dess_json):
    for folder in ("trial", "again"):
        assert dess("study", "run", "trial.toml", "--out", folder)[0] == 0
    shapes = {name: _shape(dess_json(*command)) for name, command in COMMANDS.items()}
    pinned("json.txt", json.dumps(shapes, indent=1) + "\n")


def test_the_columns_of_every_file_are_the_kept_ones():
    lines = [f"log: {name} {kind}" for name, kind in EVENT_COLUMNS.items()]
    for kind, schemas in parquet.SCHEMAS.items():
        lines += [f"{kind}: {field}" for schema in schemas for field in schema]
    pinned("columns.txt", "\n".join(lines) + "\n")
