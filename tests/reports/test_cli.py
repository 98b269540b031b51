import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from functools import partial

import pyarrow.parquet as pq
import pytest
from numba import njit

from analysis import load_results
from policies.registry import trained_names
from reports import cli
from reports.cli import console
from tests.analysis import troublesome
from tests.analysis.small import environment, files_of, small_study

SIMULATE_KEYS = [
    "policy",
    "scenario",
    "seed",
    "replication",
    "slots",
    "success",
    "collection_ratio",
    "collection_ratio_and_communication",
    "initial",
    "arrived",
    "collected",
    "residual",
    "uavs",
]
EVALUATE_KEYS = [
    "policy",
    "missions",
    "seed",
    "engine",
    "uav_slots",
    "seconds",
    "success",
    "collection_ratio",
    "collection_ratio_and_communication",
    "reward",
]


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


def test_simulate_prints_the_contract(dess_json):
    mission = dess_json("simulate", "--scenario", "small.toml", "--seed", 7, "--replication", 3)
    assert list(mission) == SIMULATE_KEYS
    assert (mission["policy"], mission["scenario"]) == ("greedy", "small.toml")
    assert (mission["seed"], mission["replication"]) == (7, 3)
    assert mission["success"] in (0, 1)
    assert not isinstance(mission["success"], bool)
    for uav in mission["uavs"]:
        assert list(uav) == ["quota", "battery", "slots_charging", "end"]
        assert uav["end"] in ("quota", "battery", "truncated")
    total = mission["initial"] + mission["arrived"]
    assert total == pytest.approx(mission["collected"] + mission["residual"], abs=1e-9)


def test_a_mission_of_a_study_can_be_simulated_alone(dess, dess_json, tmp_path):
    assert dess("study", "run", "trial.toml", "--out", "out", "--policy", "greedy,random")[0] == 0
    row = load_results(tmp_path / "out").missions.iloc[6]
    team = ("--policy", "greedy,random", "--seed", row["seed"], "--replication", 6)
    alone = dess_json("simulate", "--scenario", "small.toml", *team)
    shared = SIMULATE_KEYS[2:-1]
    assert {key: alone[key] for key in shared} == {key: row[key] for key in shared}


def test_set_takes_toml_values(dess_json):
    settings = ("--set", "uavs=1", "--set", "initial_data = 5", "--set", "nodes=[[0, 0], [7, 7]]")
    mission = dess_json("simulate", "--scenario", "small.toml", *settings)
    assert len(mission["uavs"]) == 1
    assert mission["initial"] == 10.0


def test_evaluate_prints_the_contract(dess_json):
    arguments = ("--scenario", "small.toml", "--missions", 40, "--seed", 7)
    policies = ("--policy", "greedy", "--policy", "greedy,random")
    rows = dess_json("evaluate", *arguments, *policies)
    assert [row["policy"] for row in rows] == ["greedy", "greedy,random"]
    for row in rows:
        assert list(row) == EVALUATE_KEYS
        assert (row["missions"], row["seed"], row["engine"]) == (40, 7, "batch")
        assert row["uav_slots"] > 0
        assert row["seconds"] > 0
        for metric in EVALUATE_KEYS[6:]:
            assert list(row[metric]) == ["mean", "low", "high"]
            assert row[metric]["low"] <= row[metric]["mean"] <= row[metric]["high"]
    (events,) = dess_json("evaluate", *arguments, "--policy", "greedy", "--engine", "events")
    assert events["engine"] == "events"
    for metric in ["uav_slots", *EVALUATE_KEYS[6:]]:
        assert events[metric] == rows[0][metric]


def test_evaluate_is_the_mean_of_its_missions(dess_json):
    scenario = ("--scenario", "small.toml", "--seed", 7)
    (row,) = dess_json("evaluate", *scenario, "--policy", "random", "--missions", 3)
    missions = [
        dess_json("simulate", *scenario, "--policy", "random", "--replication", r) for r in range(3)
    ]
    for metric in ("success", "collection_ratio", "collection_ratio_and_communication"):
        mean = sum(mission[metric] for mission in missions) / 3
        assert row[metric]["mean"] == pytest.approx(mean)


def test_a_reader_gets_tables(dess):
    code, out, _ = dess("simulate", "--scenario", "small.toml")
    assert code == 0
    assert "collection_ratio_and_communication" in out
    code, out, _ = dess("evaluate", "--scenario", "small.toml", "--policy", "greedy")
    assert code == 0
    assert "collection_ratio_and_communication" in out
    assert "UAV-slots/s" in out


def test_the_event_log_and_the_figure(dess, tmp_path):
    files = ("--events", "log.parquet", "--figure", "mission.png")
    code, *_ = dess("simulate", "--scenario", "small.toml", *files)
    assert code == 0
    log = pq.read_table(tmp_path / "log.parquet")
    assert log.column_names == ["time", "event", "uav", "node", "value", "x", "y"]
    assert {"mission_start", "move", "communication", "mission_end"} <= set(
        log["event"].to_pylist()
    )
    assert (tmp_path / "mission.png").read_bytes().startswith(b"\x89PNG")
    assert len(files_of(tmp_path)) == 4  # with the scenario and the study


def test_what_there_is(dess):
    for command, names in {
        "policies": ["random", "nearest", "greedy", "tour", *trained_names()],
        "scenarios": ["fig1", "fig4", "paper"],
        "studies": [
            *("comparison", "fig1", "fig4", "fig5", "sensitivity", "sweet-spot", "table4"),
            "verification",
        ],
    }.items():
        code, out, err = dess(command)
        assert (code, err) == (0, "")
        assert [line.split()[0] for line in out.splitlines()] == names


def test_a_study_lands_in_the_results_by_default(dess, tmp_path):
    code, out, _ = dess("study", "run", "trial.toml", "--missions", 3)
    assert code == 0
    assert out.startswith("results/trial: 6 missions of study trial")
    assert len(load_results(tmp_path / "results" / "trial").missions) == 6


def test_a_dry_run_tells_the_plan_and_writes_nothing(dess, tmp_path):
    before = files_of(tmp_path)
    code, out, _ = dess("study", "run", "trial.toml", "--missions", 30, "--dry-run")
    assert code == 0
    assert "60 missions of study trial (2 policies x 1 design points x 30 replications)" in out
    assert re.search(r"about \d+ s with 1 at work", out)
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
    rule = "procedure = 'kn'\nfirst = 8\nindifference = 0.05\nbudget = 900\ncheck = 9\n"
    design = "[design]\nkind = 'grid'\nvalues.quota = [20, 60]\n"
    (tmp_path / "best.toml").write_text(f"{text}\n{design}[selection]\n{rule}")
    code, out, _ = dess("study", "run", "best.toml")
    assert code == 0
    assert re.search(r"greedy +quota (20|60) +\d+ +1", out)
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
    assert last == "dess: error: 1 of the chunks of study trial failed, the rest is done"
    command = shlex.split(first.partition("command: ")[2])
    assert command[:2] == ["dess", "simulate"]
    with pytest.raises(ZeroDivisionError):
        dess(*command[1:])


# Arguments, and what the line on stderr must name.
BAD = {
    "simulate --scenario nope": ["nope: no such scenario", "fig4, paper"],
    "simulate --scenario .": ["cannot be read"],
    "simulate --policy gredy": ["'gredy' is unknown", "random, nearest, greedy, tour"],
    "simulate --policy greedy,": ["'' is unknown"],
    "simulate --seed -1": ["seed: -1", "0..2**64-1"],
    "simulate --replication 4294967296": ["replication: 4294967296", "0..2**32-1"],
    "simulate --set uavs": ["'uavs' is not KEY=VALUE"],
    "simulate --set uavs=": ["'uavs=' is not KEY=VALUE"],
    "simulate --set uavs=two": ["'uavs=two' is not KEY=VALUE"],
    "simulate --set uavs=1\nquota=2": ["is not KEY=VALUE"],
    "simulate --set uavz=1": ["uavz: unknown key", "flying_time"],
    "simulate --set uavs='2'": ["uavs", "'2'"],
    "simulate --set uavs=17": ["uavs: 17", "1..16"],
    "simulate --set charge_start=60": ["charge_start: 60 is not below charge_complete 60"],
    "simulate --set zone=[30,2,4,4]": ["zone: [30, 2, 4, 4]", "32 x 32"],
    "simulate --set nodes=[[3,32]]": ["nodes: [3, 32] is off the grid", "0 <= x, y < 32"],
    "simulate --set nodes=[[3,3],[4,4],[3,3]]": ["nodes: [3, 3] is listed twice"],
    "simulate --events none/log.parquet": ["none/log.parquet: cannot be written"],
    "simulate --events .": ["is a folder"],
    "simulate --figure mission.txt": ["mission.txt", ".png, .pdf, .svg"],
    "simulate --replication one": ["--replication", "integer"],
    "evaluate": ["--policy"],
    "evaluate --policy greedy --missions 0": ["--missions", "1"],
    "evaluate --policy greedy --engine fast": ["--engine", "'batch', 'events'"],
    "evaluate --policy greedy --policy gredy": ["'gredy' is unknown"],
    "study run nope": ["nope: no such study", "fig4, fig5", "table4"],
    "study run trial.toml --policy gredy": ["trial.toml: policies", "'gredy' is unknown"],
    "study run trial.toml --missions 0": ["--missions", "1"],
    "study run trial.toml --out small.toml": ["small.toml: cannot be written"],
    "study run trial.toml --out small.toml/out": ["small.toml/out: cannot be written"],
    "study run trial.toml --out .": ["no manifest.json", "another --out"],
    "study run trial.toml --dry-run --out .": ["no manifest.json", "another --out"],
    "study show trial --policy tour": ["trial/manifest.json: no such file"],
    "study show nope": ["nope/manifest.json: no such file", "made by dess study run"],
    "study": ["Missing command", "dess study --help"],
    "fly": ["No such command 'fly'", "dess --help"],
    "simulate --fly": ["--fly"],
    "report nope": ["'nope' is unknown"],
    "report mission --set uavs=5": ["--set: mission has nothing to set", "what-if"],
    "report what-if --set uavs": ["--set: 'uavs' is not KEY=VALUE"],
    "report what-if --set uavz=5": ["uavz: unknown key", "flying_time"],
    "report what-if --set uavs=17": ["uavs: 17", "1..16"],
    "report what-if --parameter speed=2": ["'speed' is unknown to what-if", "baseline, missions"],
    "report what-if --parameter speed": ["--parameter: 'speed' is not KEY=VALUE"],
    "report what-if --parameter results='x'": ["parameter: 'results' is unknown"],
    "verify nope": ["nope: cannot be read"],
    "verify small.toml": ["small.toml: is no page of dess"],
    "verify .": [".: holds no results and is no page"],
}


@pytest.mark.parametrize("arguments", BAD)
def test_bad_input_gets_one_line_and_leaves_nothing(arguments, dess, tmp_path):
    before = files_of(tmp_path)
    code, out, err = dess(*arguments.split(" "))
    assert code == 2
    assert out == ""
    assert err.startswith("dess: error: ")
    assert err.count("\n") == 1
    for part in BAD[arguments]:
        assert part in err
    assert files_of(tmp_path) == before


FILES = {
    "speed = 1": "speed: unknown key",
    "uavs = 'two'": "uavs",
    "uavs = 2.0": "uavs",
    "uavs = 17": "uavs: 17",
    "charge_start = 60": "charge_start: 60",
    "zone = [30, 2, 4, 4]": "zone",
    "nodes = [[32, 3]]": "nodes",
    "nodes = [[3, 3], [3, 3]]": "nodes",
    "uavs = [1": "not valid TOML",
}


@pytest.mark.parametrize("text", FILES)
def test_a_bad_scenario_file_is_named_with_its_key(text, dess, tmp_path):
    (tmp_path / "bad.toml").write_text(text)
    code, out, err = dess("simulate", "--scenario", "bad.toml")
    assert (code, out) == (2, "")
    assert err.startswith("dess: error: bad.toml: ")
    assert err.count("\n") == 1
    assert FILES[text] in err


def test_results_of_another_version_are_refused(dess, tmp_path):
    assert dess("study", "run", "trial.toml", "--out", "out")[0] == 0
    path = tmp_path / "out" / "manifest.json"
    path.write_text(path.read_text().replace('"version": "', '"version": "9.', 1))
    before = files_of(tmp_path)
    code, out, err = dess("study", "run", "trial.toml", "--out", "out")
    assert (code, out) == (2, "")
    assert "out/manifest.json: made by dess 9." in err
    assert "allowed: another --out" in err
    assert err.count("\n") == 1
    assert files_of(tmp_path) == before


def test_a_failed_simulation_keeps_the_old_log(dess, tmp_path, monkeypatch):
    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("dess.mission.simulate", fail)
    (tmp_path / "log.parquet").write_text("old")
    before = files_of(tmp_path)
    assert dess("simulate", "--events", "log.parquet") == (1, "", "interrupted\n")
    assert files_of(tmp_path) == before


def test_compilation_is_announced_once(capsys):
    double = njit(lambda x: 2 * x)
    with console.compile_notice():
        assert (double(1), double(1.5)) == (2, 3.0)  # compiled twice
    assert capsys.readouterr().err == "compiling the simulator (first run only) ...\n"
    with console.compile_notice():
        assert double(2) == 4
    assert capsys.readouterr().err == ""


def test_the_help_imports_nothing_heavy():
    script = (
        "import sys; from reports.cli import main; code = main(['--help']); "
        "heavy = {'numpy', 'numba', 'pandas', 'pyarrow', 'scipy', 'pydantic', 'matplotlib', "
        "'torch'}; print(*heavy & set(sys.modules), end='', file=sys.stderr); sys.exit(code)"
    )
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert (done.returncode, done.stderr) == (0, "")
    for command in ("simulate", "evaluate", "study", "report", "policies", "scenarios", "studies"):
        assert f"  {command}" in done.stdout


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_ctrl_c_leaves_a_folder_that_a_second_run_completes(dess, tmp_path):
    command = [sys.executable, "-m", "reports.cli", "study", "run", "trial.toml", "--out", "out"]
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
    assert (running.returncode, out) == (1, "")
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
