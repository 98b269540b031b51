"""Fixtures that run the command in a folder with a small scenario and study."""

import json
from pathlib import Path

import pytest

from dess.reports import cli
from dess.reports.pages import notebook, render
from tests.analysis.small import files_of, small_study

# What a command may tell before it refuses: steps on a busy machine, what a training will take,
# and that numba compiles in a new clone.
PROGRESS = ("step", "compiling the simulator", "replay memory: ", "curves: tensorboard")
PROGRESS += ("acts outside of its training",)


@pytest.fixture
def dess(tmp_path, monkeypatch, capsys):
    """Runs the command in a folder with a small scenario and study: exit code, stdout, stderr."""
    small_study(tmp_path)
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        code = cli.main([str(argument) for argument in arguments])
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def dess_json(dess):
    """Runs the command and parses the one JSON document that it prints."""

    def run(*arguments):
        code, out, _ = dess(*arguments, "--json")
        assert code == 0
        return json.loads(out)

    return run


@pytest.fixture
def refusal(dess, tmp_path):
    """Runs a command that is refused and leaves all files as they are; the line on stderr."""

    def run(*arguments):
        before = files_of(tmp_path)
        code, out, err = dess(*arguments)
        assert (code, out) == (2, "")
        *progress, line = err.splitlines()
        assert line.startswith("dess: error: ")
        assert all(any(part in told for part in PROGRESS) for told in filter(None, progress))
        assert files_of(tmp_path) == before
        return line

    return run


@pytest.fixture
def unrendered(monkeypatch):
    """No page is made, which takes seconds; the parameters of the page of a what-if question."""
    given = []

    def page_of(folder, out, *_):
        return Path(out, f"study-{Path(folder).name}.html")

    def note(names, results, out, progress, parameters):
        notebook.check_parameters([notebook.read(*names)], parameters)
        given.append(parameters)
        return Path(out, f"{names[0]}.html")

    monkeypatch.setattr(render, "render_study", page_of)
    monkeypatch.setattr(render, "render", note)
    return given
