"""Fixtures that run the command in a folder with a small scenario and study."""

import json

import pytest

from reports import cli
from tests.analysis.small import small_study


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
