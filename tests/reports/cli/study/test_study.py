"""``dess study``: runs, resumes and shows studies."""

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from functools import partial

import pytest

from dess.analysis import load_results
from tests.analysis import troublesome
from tests.analysis.small import environment, files_of


def test_a_study_lands_in_the_results_by_default(dess, tmp_path):
    code, out, _ = dess("study", "run", "trial.toml", "--missions", 3)
    assert code == 0
    assert out.startswith("results/trial: 6 missions of study trial")
    assert len(load_results(tmp_path / "results" / "trial").missions) == 6


def test_the_name_of_a_study_leads_to_its_folder(dess, refusal):
    assert dess("study", "run", "trial.toml", "--missions", 2)[0] == 0
    for command in (("show",), ("diff", "results/trial"), ("export", "--crate", "a.zip")):
        line = refusal("study", *command, "trial")
        assert "trial: no such folder; allowed: a results folder: results/trial" in line


def test_a_command_that_is_printed_can_be_pasted(dess):
    code, out, _ = dess("study", "run", "trial.toml", "--missions", 2, "--out", "res ults")
    command = out.splitlines()[-1].removeprefix("more: ")
    assert (code, command) == (0, "dess study show 'res ults'")
    assert dess(*shlex.split(command)[1:])[0] == 0


def test_a_dry_run_tells_the_plan_and_writes_nothing(dess, tmp_path):
    before = files_of(tmp_path)
    code, out, _ = dess("study", "run", "trial.toml", "--missions", 30, "--dry-run")
    assert code == 0
    assert "60 missions of study trial (2 policies x 1 design points x 30 replications)" in out
    assert re.search(r"up to 15 seconds with 1 at work", out)
    assert files_of(tmp_path) == before


def test_a_study_is_shown(dess, dess_json):
    assert dess("study", "run", "trial.toml", "--missions", 30)[0] == 0
    code, out, _ = dess("study", "show", "results/trial", "--worst", 2)
    assert code == 0
    data = dess_json("study", "show", "results/trial", "--worst", 2)
    assert data["study"] == "trial"
    assert {row["policy"] for row in data["means"]} == {"greedy", "random"}
    assert [row["baseline"] for row in data["comparisons"]] == ["greedy"] * 3
    assert len(data["worst"]) == 2
    for row in data["worst"]:
        assert row["policy"] == "greedy"
        assert row["command"] in out
    product = next(r for r in data["means"] if r["metric"] == "collection_ratio")
    assert f"{100 * product['mean']:.1f} %" in out


def test_a_selection_is_shown_with_its_check(dess, tmp_path):
    with open("trial.toml") as file:
        text = file.read().replace("missions = 10\n", "")
    rule = "procedure = 'kn'\nmetric = 'collection_ratio'\n"
    rule += "first = 8\nindifference = 0.05\nbudget = 900\ncheck = 9\n"
    design = "[design]\nkind = 'grid'\nvalues.quota = [20, 60]\n"
    (tmp_path / "best.toml").write_text(f"{text}\n{design}[selection]\n{rule}")
    code, out, _ = dess("study", "run", "best.toml")
    assert code == 0
    assert re.search(r"greedy +communication quota (20|60) +\d+ +1", out)
    assert "9 further missions" in out
    assert "with probability at least 0.95" in out


def test_a_failed_chunk_is_an_exit_code_and_a_command(dess, tmp_path, monkeypatch):
    troublesome.install(tmp_path / "plugin", monkeypatch)
    asked = ["study", "run", "trial.toml", "--policy", "raising", "--policy", "greedy"]
    code, out, err = dess(*asked)
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


def test_results_of_another_version_are_refused(dess, refusal, tmp_path):
    assert dess("study", "run", "trial.toml", "--out", "out")[0] == 0
    path = tmp_path / "out" / "manifest.json"
    path.write_text(path.read_text().replace('"version": "', '"version": "9.', 1))
    line = refusal("study", "run", "trial.toml", "--out", "out")
    assert "out/manifest.json: has version '9." in line
    assert "allowed: another --out" in line


def test_pages_that_cannot_be_written_are_refused_before_the_run(refusal, tmp_path):
    (tmp_path / "build").touch()
    line = refusal("study", "run", "trial.toml", "--report")
    end = "build/reports: cannot be written: Not a directory; allowed: another path"
    assert line == f"dess: error: {end}"


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_ctrl_c_leaves_a_folder_that_a_second_run_completes(dess, tmp_path):
    command = [sys.executable, "-m", "dess", "study", "run", "trial.toml", "--out", "out"]
    with open("trial.toml", "a") as study:  # slow enough to be caught in the middle
        study.write('engine = "events"\n')
    missions = ("--missions", "1000")
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    # A background job of a shell ignores SIGINT, and its children with it: not this one.
    heed = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    start = partial(subprocess.Popen, env=environment(), preexec_fn=heed, **pipes)
    with start([*command, *missions]) as running:
        while len(list(tmp_path.glob("out/missions/*/*.parquet"))) < 2:
            assert running.poll() is None
            time.sleep(0.01)
        running.send_signal(signal.SIGINT)
        out, err = running.communicate()
    assert (running.returncode, out) == (130, "")
    assert err.endswith("interrupted: run the same command again to complete it\n")
    assert "Traceback" not in err
    assert not [name for name in files_of(tmp_path) if name.endswith(".tmp")]
    kept = files_of(tmp_path / "out" / "missions")
    assert dess(*command[3:], *missions)[0] == 0
    assert dess(*command[3:-1], "undisturbed", *missions)[0] == 0
    completed = files_of(tmp_path / "out")
    assert kept.items() <= files_of(tmp_path / "out" / "missions").items()
    assert len(kept) < len(files_of(tmp_path / "out" / "missions"))
    assert completed == files_of(tmp_path / "undisturbed")
