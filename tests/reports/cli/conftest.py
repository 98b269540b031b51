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
    """No page is made, which takes seconds; of what pages would be made, where, and with what."""
    pages = []

    def note_study(results, out, progress=None, parameters=None, formats=()):
        pages.append((str(results.store.folder), str(out), parameters))
        return Path(out, f"study-{results.study.name}.html")

    def note(names, results, out, progress=None, parameters=None, formats=()):
        notebook.check_parameters([notebook.read_report(name) for name in names], parameters)
        pages.append((*names, str(results), str(out), parameters))
        return Path(out, f"{names[0]}.html" if len(names) == 1 else "index.html")

    monkeypatch.setattr(render, "render_study", note_study)
    monkeypatch.setattr(render, "render", note)
    return pages
