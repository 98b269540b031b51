"""A run that is killed at any moment is completed by the same command, to the same bytes."""

import random
import signal
import subprocess
import sys
import time

import psutil
import pytest

from dess.analysis import load_study, run_study
from dess.analysis.execution.runner import CHUNK
from tests.analysis.small import environment, files_of, small_study

RUN = """
import sys
from dess.analysis import load_study, run_study
from dess.analysis.execution import runner
runner.CHUNK["batch"] = int(sys.argv[4])
run_study(load_study(sys.argv[1], missions=int(sys.argv[5])), sys.argv[2], int(sys.argv[3]))
"""


def start(study, out, workers, missions):
    words = [study, out, workers, CHUNK["batch"], missions]
    return subprocess.Popen([sys.executable, "-c", RUN, *map(str, words)], env=environment())


def files_in(out):
    return len([*out.glob("*/*/*.parquet")])


def run_with_kills(study, out, workers, missions, kills, generator):
    """Kill the run as often, each time after some more files, and complete it."""
    files = 2 * -(-missions // CHUNK["batch"])
    moments = sorted(generator.randrange(files) for _ in range(kills))
    for moment in moments:
        with start(study, out, workers, missions) as running:
            while files_in(out) <= moment and running.poll() is None:
                time.sleep(0.002)
            time.sleep(generator.uniform(0, 0.1))
            running.send_signal(signal.SIGKILL)
            assert running.wait() in (-signal.SIGKILL, 0)
    with start(study, out, workers, missions) as running:
        assert running.wait() == 0
    return moments


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_killed_study_equals_an_undisturbed_one(workers, tmp_path):
    small_study(tmp_path)
    file, generator = tmp_path / "trial.toml", random.Random(workers)
    run_with_kills(file, tmp_path / "out", workers, 60, 2, generator)
    run_study(load_study(file, missions=60), tmp_path / "undisturbed")
    assert files_of(tmp_path / "out") == files_of(tmp_path / "undisturbed")


@pytest.mark.slow
def test_workers_go_with_a_killed_run(tmp_path):
    small_study(tmp_path)
    with start(tmp_path / "trial.toml", tmp_path / "out", 2, 4000) as running:
        while files_in(tmp_path / "out") < 2 and running.poll() is None:
            time.sleep(0.002)
        workers = psutil.Process(running.pid).children(recursive=True)
        running.send_signal(signal.SIGKILL)
        assert running.wait() == -signal.SIGKILL
    assert len(workers) >= 2
    assert psutil.wait_procs(workers, timeout=60)[1] == []
