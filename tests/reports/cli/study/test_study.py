"""``dess study``: runs, resumes and shows studies."""

import re
import shlex

import pytest

from tests.analysis import troublesome
from tests.analysis.small import files_of


def test_the_name_of_a_study_leads_to_its_folder(dess, refusal):
    assert dess("study", "run", "trial.toml", "--missions", 2)[0] == 0
    for command in (("show",), ("diff", "results/trial"), ("export", "--crate", "a.zip")):
        line = refusal("study", *command, "trial")
        assert "trial: no such folder; allowed: a results folder: results/trial" in line


def test_a_dry_run_tells_the_plan_and_writes_nothing(dess, tmp_path):
    before = files_of(tmp_path)
    code, out, _ = dess("study", "run", "trial.toml", "--missions", 30, "--dry-run")
    assert code == 0
    assert "60 missions of study trial (2 policies x 1 design point x 30 replications)" in out
    assert re.search(r"up to 15 seconds with 1 at work", out)
    assert files_of(tmp_path) == before


def test_a_failed_chunk_is_an_exit_code_and_a_command(dess, tmp_path):
    raising = f"{troublesome.copied(tmp_path)}:Raising"
    code, out, err = dess("study", "run", "trial.toml", "--policy", raising, "--policy", "greedy")
    assert (code, out) == (1, "")
    _, first, last = err.splitlines()
    assert first.startswith(
        "failed: ZeroDivisionError: nothing to divide by (results/trial/failures/"
    )
    assert last == "dess: error: 1 of the chunks of study trial failed, all others are complete"
    command = shlex.split(first.partition("command: ")[2])
    assert command[:2] == ["dess", "simulate"]
    with pytest.raises(ZeroDivisionError):
        dess(*command[1:])


def test_pages_that_cannot_be_written_are_refused_before_the_run(refusal, tmp_path):
    (tmp_path / "build").touch()
    line = refusal("study", "run", "trial.toml", "--report")
    end = "build/reports: cannot be written: Not a directory; allowed: another path"
    assert line == f"dess: error: {end}"
