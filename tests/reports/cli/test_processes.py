"""Processes of a user on the command line: results that have them are other results."""

import json
import shutil
from pathlib import Path

import pytest

from dess.analysis.results.tables import load_results

# Boats that keep all pads from the start on, each with a row in the event log.
BOATS = """
from dess.model.mission import BEFORE_ALL_UAVS


def moor(mission):
    zone = mission.zones[0]
    for _ in range(zone.capacity):
        yield zone.request(priority=BEFORE_ALL_UAVS)
        mission.log("moored")
"""


@pytest.fixture
def boat(dess, request):
    """A process in a file of its own, since a process of Python keeps what it has imported."""
    module = f"boat_{abs(hash(request.node.name))}"
    Path(f"{module}.py").write_text(BOATS)
    return f"{module}.py:moor"


def run(dess, *arguments):
    code, out, err = dess(*arguments)
    assert code == 0, err
    return out


def test_a_study_with_a_process_is_another_one(dess, boat, refusal):
    study = ("study", "run", "trial.toml", "--policy", "greedy")
    run(dess, *study, "--out", "alone")
    told = run(dess, *study, "--out", "out", "--process", boat)
    assert "with process moor, in the SimPy engine" in told
    alone, beside = load_results("alone"), load_results("out")
    manifests = [results.store.manifest for results in (alone, beside)]
    assert [manifest.study.engine for manifest in manifests] == ["batch", "events"]
    assert manifests[0].cells[0][0].key != manifests[1].cells[0][0].key
    assert [identity.process for identity in manifests[1].processes] == [boat]
    charged = [results.uavs["slots_charging"].sum() for results in (alone, beside)]
    assert charged[0] > charged[1] == 0
    assert "holds missions with process moor, not with no process" in refusal(*study, "--out=out")
    line = refusal(*study, "--out=alone", "--process", boat)
    assert "holds missions with no process, not with process moor" in line


def test_only_whoever_names_the_file_simulates_its_missions_again(dess, boat, capsys):
    run(dess, "study", "run", "trial.toml", "--policy=greedy", "--process", boat, "--out=out")
    for command in (["verify", "out"], ["simulate", "--of", "out"]):
        code, _, err = dess(*command)
        assert code == 2
        assert "allowed: --process FILE.py:FUNCTION, if you trust the file" in err
        code, _, err = dess(*command, "--process", boat)
        assert code == 0
        assert "note" not in err
    shown = json.loads(run(dess, "simulate", "--of=out", "--process", boat, "--json"))
    assert shown["processes"] == [boat]
    code, _, err = dess("simulate", "--of=out", "--process", boat, "--process", f"{boat}2")
    assert code == 2
    assert "is not in the study" in err


def test_results_do_not_mix_two_versions_of_a_process(dess, boat, refusal):
    study = ("study", "run", "trial.toml", "--policy=greedy", "--out=out", "--process", boat)
    run(dess, *study)
    manifest = json.loads(Path("out/manifest.json").read_text())
    # What an edit of the file changes; this process of Python has imported it already.
    module = boat.partition(".py")[0]
    manifest["code"][module] = manifest["processes"][0]["code"] = "0" * 64
    Path("out/manifest.json").write_text(json.dumps(manifest))
    assert f"made by other code of {module}" in refusal(*study)
    shutil.rmtree("out")


def test_an_evaluation_says_what_takes_part(dess, dess_json, boat):
    command = ("evaluate", "--scenario=small.toml", "--policy=greedy", "--missions=5")
    (row,) = dess_json(*command, "--process", boat)
    assert (row["engine"], row["processes"]) == ("events", [boat])
    (alone,) = dess_json(*command)
    assert "processes" not in alone
    assert row["success"]["mean"] < alone["success"]["mean"]
    assert f"SimPy engine with {boat}" in run(dess, *command, "--process", boat)


def test_the_event_log_has_rows_of_a_process(dess, boat):
    run(dess, "simulate", "--scenario=small.toml", "--process", boat, "--events=log.csv")
    assert [line for line in Path("log.csv").read_text().splitlines() if ",moored," in line]


@pytest.mark.parametrize(
    ("process", "more", "words"),
    [
        ("absent.py:moor", (), "process: absent.py: no such file; allowed: FILE.py:FUNCTION"),
        ("moor", (), "process: 'moor' has another form; allowed: FILE.py:FUNCTION"),
        (None, ("--engine=batch",), "engine: batch runs no processes; allowed: events"),
    ],
)
def test_what_cannot_take_part_is_refused(boat, refusal, process, more, words):
    command = ("evaluate", "--scenario=small.toml", "--policy=greedy", "--missions=5")
    assert words in refusal(*command, "--process", process or boat, *more)


def test_a_function_that_is_not_there_is_refused_with_those_that_are(dess, boat):
    code, _, err = dess(
        "simulate", "--scenario=small.toml", "--process", boat.replace("moor", "mo")
    )
    assert code == 2
    assert "'mo' is no function of it that yields events; allowed: moor" in err
