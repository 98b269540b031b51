"""A cluster of dask: what is wrong with it is one line, and no mission is lost."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack

import pytest

from dess import InputError, load_scenario
from dess.analysis import run_study
from dess.analysis.execution import workers
from dess.analysis.execution.evaluation import Asked, estimate_means
from dess.analysis.execution.jobs import MissionsJob
from dess.analysis.execution.runner import CHUNK
from dess.analysis.execution.workers import Cluster, _check_and_run
from dess.analysis.results.chunks import Chunk
from dess.analysis.results.manifest import CellPart, Manifest
from dess.analysis.results.provenance import engine_code, members_of
from dess.reports import cli
from tests.analysis.small import environment, files_of, small_study

distributed = pytest.importorskip("distributed")

OPTIONS = {"threads_per_worker": 1, "dashboard_address": None}
SERVE = f"""
import sys, time
from distributed import LocalCluster
if __name__ == "__main__":
    cluster = LocalCluster(n_workers=1, **{OPTIONS})
    print(cluster.scheduler_address, flush=True)
    time.sleep(600)
"""


def test_a_worker_with_other_code_or_weights_does_nothing(tmp_path):
    study = small_study(tmp_path)
    cell = Manifest.of(study).cells[0][0]
    chunk = Chunk(0, (CellPart(cell, range(1)),))
    job = MissionsJob(chunk, (study.scenarios[0],), "greedy", 7, "batch")
    code, members = engine_code(), members_of("greedy")
    assert len(_check_and_run(job, code, members).missions) == 1
    for others in (("0" * 64, members), (code, members_of("random"))):
        with pytest.raises(InputError, match="a worker has other code"):
            _check_and_run(job, *others)


@pytest.mark.slow
def test_a_study_goes_on_after_its_scheduler_was_killed(tmp_path, monkeypatch, capfd):
    small_study(tmp_path)
    monkeypatch.chdir(tmp_path)
    with open("trial.toml", "a") as study:
        study.write('engine = "events"\n')
    monkeypatch.setitem(CHUNK, "events", 5)
    words = ["study", "run", "trial.toml", "--missions", "400", "--out"]
    with subprocess.Popen(
        [sys.executable, "-c", SERVE],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=environment(),
        start_new_session=True,
    ) as serving:
        address = serving.stdout.readline().strip()

        def kill():
            while len([*tmp_path.glob("out/missions/*/*.parquet")]) < 3:
                time.sleep(0.01)
            os.killpg(serving.pid, signal.SIGKILL)

        threading.Thread(target=kill, daemon=True).start()
        code = cli.main([*words, "out", "--scheduler", address])
    line = f"dess: error: scheduler: the connection to {address} is lost; "
    line += "run the same command again to complete it"
    out, err = capfd.readouterr()
    assert (code, out, err.splitlines()[-1]) == (1, "", line)
    assert "Traceback" not in err and "distributed" not in err
    assert cli.main([*words, "out"]) == 0
    assert ", 0 of them present" not in capfd.readouterr().err
    assert cli.main([*words, "undisturbed"]) == 0
    assert files_of(tmp_path / "out") == files_of(tmp_path / "undisturbed")


@pytest.mark.slow
def test_dask_waits_for_workers_and_leaves_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "LOOK", 0.1)
    study = small_study(tmp_path, logged=1)
    with distributed.LocalCluster(n_workers=0, **OPTIONS) as cluster:
        notes = []

        def note(*words):
            notes.append(words)
            cluster.scale(2)

        monkeypatch.setattr(workers.log, "warning", note)
        run_study(study, tmp_path / "out", scheduler=cluster.scheduler_address)
    assert notes == [("note: %s has no workers; waiting for them", cluster.scheduler_address)]
    run_study(study, tmp_path / "undisturbed")
    assert files_of(tmp_path / "out") == files_of(tmp_path / "undisturbed")


def test_a_worker_that_cannot_run_a_job_is_one_line(tmp_path, monkeypatch):
    def unprepared(*_):
        raise ModuleNotFoundError("No module named 'analysis'")

    monkeypatch.setattr(workers, "_check_and_run", unprepared)
    with distributed.LocalCluster(n_workers=1, processes=False, **OPTIONS) as cluster:
        line = "a worker cannot run jobs: ModuleNotFoundError: No module named 'analysis'"
        with pytest.raises(InputError, match=line):
            run_study(small_study(tmp_path), tmp_path / "out", scheduler=cluster.scheduler_address)


@pytest.mark.parametrize("engine", ["batch", "events"])
def test_a_cluster_evaluates_as_this_machine_does(engine, monkeypatch):
    monkeypatch.setitem(CHUNK, engine, 7)
    asked = Asked(load_scenario("paper", max_slots=60), "greedy", missions=20, engine=engine)
    with distributed.LocalCluster(n_workers=1, processes=False, **OPTIONS) as cluster:
        there = estimate_means(asked._replace(scheduler=cluster.scheduler_address))
    here = estimate_means(asked)
    assert there.moments == here.moments
    assert there.compared.equals(here.compared)


RUN = ["study", "run", "trial.toml", "--out", "out"]
ASK = ["--scenario", "small.toml", "--policy", "greedy"]
COMMANDS = [
    RUN,
    [*RUN, "--shard", "1/2"],
    ["evaluate", *ASK],
    ["evaluate", *ASK, "--out", "out"],
    ["sweep", *ASK, "--set", "uavs=1,2"],
    ["sweep", *ASK, "--set", "uavs=1,2", "--shard", "1/2"],
    ["what-if", *ASK, "--set", "uavs=1"],
]


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_every_long_command_may_run_on_a_cluster(words, tmp_path, monkeypatch, capfd):
    small_study(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert cli.main([*words, "--scheduler", "nonsense"]) == 2
    assert "dess: error: scheduler: nonsense: " in capfd.readouterr().err
    assert not [*tmp_path.rglob("*.parquet")]


ADDRESSES = {
    "nonsense": "missing port number",
    "silent": "no scheduler answers within",
    "worker": "is a Worker; allowed: tls://HOST:PORT or tcp://HOST:PORT of a scheduler",
}


@pytest.mark.parametrize("address", ADDRESSES)
def test_what_is_no_scheduler_is_refused_at_once(address, monkeypatch, capfd):
    monkeypatch.setattr(workers, "ANSWER", 0.5)
    named = address
    with ExitStack() as stack:
        if address == "silent":  # a server that accepts, and says nothing
            server = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
            named = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        if address == "worker":
            monkeypatch.setattr(workers, "ANSWER", 10)
            options = {"n_workers": 1, "processes": False, **OPTIONS}
            cluster = stack.enter_context(distributed.LocalCluster(**options))
            named = cluster.workers[0].worker_address
        begin = time.monotonic()
        with pytest.raises(InputError) as error, Cluster(named):
            pass
        assert time.monotonic() - begin < 30
    assert str(error.value).startswith(f"scheduler: {named}: ")
    assert ADDRESSES[address] in str(error.value)
    assert capfd.readouterr().err == ""
