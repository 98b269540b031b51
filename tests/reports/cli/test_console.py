"""Output of the command line: what reaches the terminal, and streams that take nothing."""

import logging
import re
import subprocess
import sys

import pytest
from numba import njit
from numba.core.caching import NullCache
from numba.core.event import trigger_event

from dess.base.errors import InputError
from dess.reports import cli
from dess.reports.cli import console
from tests.analysis.small import environment

# Colours, a new title of the window, and a name that is written from right to left.
RAW = "\x1b[31mred\x1b]0;title\x07\x9b2J \u202egpj.exe\r\x00"


def test_compilation_is_announced_once(capsys):
    console.announce_compiling.cache_clear()
    double = njit(lambda x: 2 * x)
    # As of a command that checks, simulates and writes a page.
    for _ in range(2):
        with console.compile_notice():
            assert (double(1), double(1.5)) == (2, 3.0)  # compiled twice
        double = njit(lambda x: 2 * x)
    assert capsys.readouterr().err == "compiling the simulator (first run only) ...\n"


def test_code_that_cannot_be_kept_says_how(capsys, monkeypatch):
    monkeypatch.setattr("dess.model.rules.launch._cache", NullCache())
    console.announce_compiling.cache_clear()
    console.announce_compiling()
    assert "(in every run; NUMBA_CACHE_DIR=DIR keeps it)" in capsys.readouterr().err


def test_a_bar_says_that_something_is_compiled():
    with console.progress_bar("mission", 10) as progress:
        progress.set_description("round 2", refresh=False)
        # What it calls.
        with trigger_event("numba:compile"), trigger_event("numba:compile"):
            assert progress.desc == "compiling: "
        assert progress.desc == "round 2: "


@pytest.mark.parametrize(
    ("policies", "keys"), [(["a", "b"], ["fleet", "policy"]), (["a", "a"], ["fleet"])]
)
def test_a_wide_table_goes_on_with_what_tells_its_rows_apart(capsys, policies, keys):
    fleets = ["1 UAV", "1 UAV"]
    if keys == ["fleet"]:
        fleets = ["1 UAV", "2 UAVs"]
    rows = [[*row, "x" * 60, "y" * 60] for row in zip(fleets, policies, strict=True)]
    console.print_table(["fleet", "policy", "wide", "wider"], rows)
    heads = [line.split() for line in capsys.readouterr().out.splitlines() if "fleet" in line]
    assert heads == [["fleet", "policy", "wide"], [*keys, "wider"]]


def is_printable(text: str) -> bool:
    return all(line.isprintable() for line in text.split("\n"))


@pytest.mark.parametrize(
    "tell",
    [
        lambda: console.print_failure(RAW, 2),
        lambda: console.print_text(f"{RAW}\n{RAW}"),
        lambda: console.print_list([(RAW, RAW)]),
        lambda: console.print_table([RAW, "head"], [[RAW, RAW]]),
    ],
    ids=["fail", "say", "list", "table"],
)
def test_no_control_character_reaches_the_terminal(tell, capsys):
    tell()
    told = "".join(capsys.readouterr())
    assert is_printable(told)
    assert r"\u001b[31mred" in told
    assert r"\u202egpj.exe" in told


def test_a_warning_is_a_line_of_printable_characters(monkeypatch, capsys):
    monkeypatch.setattr(logging.root, "handlers", [])  # those of pytest
    assert cli.main(["scenarios"]) == 0
    logging.getLogger("dess.policies.learner").warning("%s\nuses other settings", RAW)
    err = capsys.readouterr().err
    assert is_printable(err)
    assert err.count("\n") == 1
    assert "uses other settings" in err


@pytest.mark.parametrize("values", ["a list of " + "names, " * 30, "a, b"])
def test_a_long_error_says_what_is_allowed(values, capsys):
    console.print_refusal(InputError("config.json: phases", f"{'x' * 290} is wrong", values))
    line = capsys.readouterr().err
    assert len(line) <= console.MESSAGE + 1
    assert line.startswith("dess: error: config.json: phases: x") and "; allowed: a" in line


ENDS = {
    "scenarios >/dev/full": (1, "dess: error: standard output: No space left on device\n"),
    "scenarios >&-": (0, ""),
    "scenarios show nope 2>&-": (2, ""),
    "scenarios | true": (1, ""),
}


@pytest.mark.parametrize("line", ENDS)
def test_output_that_nobody_takes_ends_the_command_without_a_traceback(line):
    arguments, redirection = line.rsplit(" ", 1) if "|" not in line else line.split(" | ")
    command = f"{sys.executable} -m dess {arguments}"
    pipe = "| (exec <&-; sleep 3)" if "|" in line else redirection
    script = f"{command} {pipe}; exit ${{PIPESTATUS[0]}}"
    variables = {k: v for k, v in environment().items() if k != "PYTHONUNBUFFERED"}
    done = subprocess.run(
        ["bash", "-c", script], env=variables, capture_output=True, text=True, timeout=100
    )
    assert (done.returncode, done.stderr) == ENDS[line]


@pytest.mark.parametrize(("error", "line"), [(MemoryError(), "memory"), (RecursionError(), "deep")])
def test_what_no_command_expects_of_its_input_is_a_line(monkeypatch, capsys, error, line):
    def fail(*_):
        raise error

    monkeypatch.setattr("dess.scenario.scenario.scenario_names", fail)
    assert cli.main(["scenarios"]) == 1
    assert line in capsys.readouterr().err


def test_a_notice_has_a_line_of_its_own_beside_a_progress_bar(capfd):
    console.announce_compiling.cache_clear()
    with console.progress_bar("mission", 10) as progress:
        progress.delay = progress.mininterval = 0
        progress.start_t -= 60
        progress.update(3)
        progress.refresh()
        console.announce_compiling()
    lines = re.split(r"[\n\r]+", capfd.readouterr().err)
    assert any("3/10" in line for line in lines)
    assert any(re.fullmatch(r"compiling the simulator \(.*\) \.\.\.", line) for line in lines)
