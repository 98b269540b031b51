"""Inputs made to attack: one line of printable characters, exit code 2, nothing hangs."""

import os

import pytest

from tests.analysis.small import files_of

LONG = "x" * 256
DIGITS = "9" * 5000
RAW = "\\u001b[31m\\u202e"  # as TOML has it
SCENARIOS = {
    "digits": f"quota = {DIGITS}",
    "hex digits": f"quota = 0x{'f' * 5000}",
    "deep": "nodes = " + "[" * 5000,
    "deep and closed": "nodes = " + "[" * 300 + "]" * 300,
    "dots": ".".join(["a"] * 20_000) + " = 1",
    "a long key of control characters": f'"{RAW}{"x" * 10**5}" = 1',
    "a long value of control characters": f'quota = "{RAW}{"x" * 10**5}"',
    "many keys": "\n".join(f"key{number} = 1" for number in range(5000)),
    "nodes in a pipe": 'nodes = "pipe.csv"',
    "nodes without end": 'nodes = "zero.csv"',
    "a null character": 'nodes = "a\\u0000.csv"',
    "a long name": f'nodes = "{LONG}.csv"',
    "too large": "#" * (4 * 2**20 + 1),
    **{
        f"{field} = {value}": f"{field} = {value}"
        for field in ("cell_size", "altitude", "slot_length", "path_loss_exponent")
        for value in ("1e-320", "1e308")
    },
    "initial_data": "initial_data = [0, 1e308]",
    "reward_step": "reward_step = -1e308",
}
STUDIES = {
    "digits": f"seed = {DIGITS}",
    "a scenario in a pipe": 'scenario = "pipe.toml"',
    "a scenario without end": 'scenario = "zero.toml"',
    "a null character": 'scenario = "a\\u0000"',
    "a long name": f'scenario = "{LONG}"',
    "control characters": f'policies = ["{RAW}"]',
    "selection": "selection = {procedure = 'kn-bounded', indifference = 1e-320}",
    "cheapest": "selection = {procedure = 'cheapest', requirements = {success = 0.5}, "
    "indifference = 1e-320}\ncosts.uav = 1",
    "tolerance": "selection = {procedure = 'cheapest', requirements = {success = 0.5}, "
    "indifference = 1, tolerance = 1e-320}\ncosts.uav = 1",
    "precision": "precision.targets.success.absolute = 1e-320",
    "costs": "costs.uav = 1e308",
    "an hour": "costs = {hour = 1, slot_seconds = 1e-320}",
}
NAMES = [
    "pipe.toml",
    "zero.toml",
    "loop.toml",
    LONG,
    "x/" * 3000,
    "\udcff",
    "\x1b[31m",
    "/dev/zero",
]
VALUES = [DIGITS, f"0x{'f' * 5000}", "[" * 5000, "[" * 300 + "]" * 300, "'\udcff'", "x" * 10**6]


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


@pytest.mark.parametrize("case", STUDIES)
def test_a_hostile_study_is_a_line(refused, tmp_path, case):
    policies = "" if "policies" in STUDIES[case] else "policies = ['greedy']\n"
    (tmp_path / "bad.toml").write_text(policies + STUDIES[case])
    assert "bad.toml: " in refused("studies", "show", "bad.toml")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("command", [("scenarios", "show"), ("studies", "show")])
def test_a_hostile_name_is_a_line(refused, command, name):
    refused(*command, name)


@pytest.mark.parametrize("value", VALUES, ids=range(len(VALUES)))
@pytest.mark.parametrize("field", ["quota", "nodes", "initial_data", "\x1b[31m", "x" * 5000])
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
