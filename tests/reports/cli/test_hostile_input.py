"""Inputs made to attack: one line of printable characters, exit code 2, nothing hangs."""

import os

import pytest

from tests.analysis.small import files_of

RAW = "\\u001b[31m\\u202e"  # as TOML has it
SCENARIOS = {
    "deep": "nodes = " + "[" * 300 + "]" * 300,
    "a long key of control characters": f'"{RAW}{"x" * 10**5}" = 1',
    "nodes in a pipe": 'nodes = "pipe.csv"',
    "too large": "#" * (4 * 2**20 + 1),
}
NAMES = ["pipe.toml", "zero.toml", "loop.toml", "x" * 256, "x/" * 3000, "\udcff", "\x1b[31m"]
VALUES = ["9" * 5000, "[" * 5000, "'\udcff'", "x" * 10**6]


@pytest.fixture
def refused(dess, tmp_path):
    """Runs a command that must be refused, in a folder with pipes and files without end."""
    for kind in ("toml", "csv"):
        os.mkfifo(tmp_path / f"pipe.{kind}")
        (tmp_path / f"zero.{kind}").symlink_to("/dev/zero")
    (tmp_path / "loop.toml").symlink_to("loop.toml")

    def run(*arguments: object) -> str:
        before = files_of(tmp_path)
        code, out, err = dess(*arguments)
        assert (code, out, err.count("\n")) == (2, "", 1)
        line = err.removesuffix("\n")
        assert line.startswith("dess: error: ")
        assert line.isprintable()
        assert len(line) <= 300
        assert files_of(tmp_path) == before
        return line

    return run


@pytest.mark.parametrize("case", SCENARIOS)
def test_a_hostile_scenario_is_a_line(refused, tmp_path, case):
    (tmp_path / "bad.toml").write_text(SCENARIOS[case])
    line = refused("scenarios", "show", "bad.toml")
    assert "bad.toml: " in line or ".csv: " in line


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("command", [("scenarios", "show"), ("studies", "show")])
def test_a_hostile_name_is_a_line(refused, command, name):
    refused(*command, name)


@pytest.mark.parametrize("value", VALUES, ids=range(len(VALUES)))
@pytest.mark.parametrize("field", ["quota", "\x1b[31m", "x" * 5000])
def test_a_hostile_setting_is_a_line(refused, field, value):
    refused("scenarios", "show", "paper", "--set", f"{field}={value}")


def test_words_of_the_library_are_cut_too(refused):
    assert "valid integer" in refused("simulate", "--seed", "\x1b[31m" + "x" * 10**5)
    refused("x" * 10**5)


@pytest.mark.parametrize("command", [("train", "quick"), ("study", "run", "trial.toml")])
def test_an_output_that_is_no_text_is_a_line(refused, command):
    assert "is not text in UTF-8" in refused(*command, "--out", "out\udc80")


def test_what_the_terminal_gets_of_a_name_is_printable(dess, tmp_path):
    (tmp_path / "bad.toml").write_text(f'description = "{RAW}"')
    code, out, _ = dess("scenarios", "show", "bad.toml")
    assert code == 0
    assert all(line.isprintable() for line in out.splitlines())
