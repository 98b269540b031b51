"""The lower end of the range decides; what may be long is run."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from dess import InputError, load_scenario
from dess.analysis import run_study
from dess.analysis.execution import effort
from dess.analysis.execution.effort import (
    BASELINE,
    BOUND,
    MAX_WORKERS,
    OF_LARGE_FLEETS,
    OF_SMALL_FLEETS,
    SECONDS,
    SPREAD,
    START,
    Range,
    check_run,
    check_workers,
    check_workers_memory,
    plan_study,
    policies_for,
    total_time,
)
from dess.base.files import memory
from dess.policies.registry import names
from tests.analysis.execution.test_runner import precise, selecting
from tests.analysis.small import environment, files_of, small_study

FASTER = [*SECONDS]


def test_the_policies_exist_and_each_is_faster_than_the_one_before():
    assert set(FASTER) <= {*names()}
    assert [*SECONDS.values()] == sorted(SECONDS.values(), reverse=True)
    assert {*OF_SMALL_FLEETS} == {*OF_LARGE_FLEETS} == {*SECONDS}


@pytest.mark.parametrize("uavs", [1, 5])
def test_a_larger_question_never_has_a_slower_policy(uavs):
    space = load_scenario("bay", uavs=uavs)
    sizes = np.geomspace(1, 1e8, 60).astype(int)
    chosen = [policies_for([space], int(missions))[0] for missions in sizes]
    assert chosen[0] == FASTER[0]
    assert chosen[-1] == BASELINE
    places = [FASTER.index(name) for name in chosen]
    assert places == sorted(places)
    # Any is better for large fleets.
    assert ("planner-short" in chosen) == (uavs == 1)
    assert "generalist" in chosen
    assert policies_for([space], 1) == (FASTER[0], BASELINE)
    assert policies_for([space], 10**8) == (BASELINE,)
    twice = policies_for([space, space], 150)
    # Settings count as missions do.
    assert twice == policies_for([space], 300)


PAPER = load_scenario("paper")


@pytest.mark.parametrize("workers", [0, -1, MAX_WORKERS + 1, 10**9])
def test_numbers_of_workers_have_limits(workers):
    with pytest.raises(InputError, match=rf"workers: {workers} is out of range"):
        check_workers(workers)
    check_workers(MAX_WORKERS)


def test_workers_need_the_memory_that_is_available(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 2**31)
    check_workers_memory("a study", 6, [PAPER], 0.0)
    check_workers_memory("an evaluation", 200, [PAPER], 0.0, are_processes=False)
    for workers, more in ((20, 0.0), (1, 2.0**32)):
        with pytest.raises(InputError, match=r"a study: about .* GiB of memory.*: --yes, or less"):
            check_workers_memory("a study", workers, [PAPER], more)
    wide = load_scenario("paper", grid=200, nodes=[[x, 0] for x in range(100)])
    with pytest.raises(InputError, match="GiB of memory"):
        check_workers_memory("an evaluation", 4, [wide], 0.0, are_processes=False)


@pytest.mark.slow
@pytest.mark.brief
def test_a_worker_ends_with_a_killed_parent_before_it_has_loaded_anything():
    """The parent starts a process as joblib does, which is busy, and is killed."""
    busy = "import os, time; from dess.analysis.execution import live_and_die_with as live; "
    busy += "live(int(os.sys.argv[1])); print(os.getpid(), flush=True); time.sleep(60)"
    script = "import os, subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1], "
    script += "str(os.getpid())])"
    parent = subprocess.Popen(
        [sys.executable, "-c", script, busy], stdout=subprocess.PIPE, text=True, env=environment()
    )
    assert parent.stdout
    worker = int(parent.stdout.readline())
    parent.send_signal(signal.SIGKILL)
    assert parent.stdout.read() == ""  # ends when the worker has ended, too
    with pytest.raises(ProcessLookupError):
        while True:
            os.kill(worker, 0)
            time.sleep(0.01)
    loaded = subprocess.run(
        [sys.executable, "-c", "import dess.analysis.execution, sys; print(*sys.modules)"],
        capture_output=True, text=True, check=True, env=environment(),
    )  # fmt: skip
    assert not {"numpy", "numba", "pandas", "joblib"} & {*loaded.stdout.split()}


def test_a_plan_knows_what_is_there(tmp_path):
    run_study(small_study(tmp_path, policies=["greedy"]), tmp_path / "out")
    before = files_of(tmp_path / "out")
    plan = plan_study(small_study(tmp_path, missions=25), tmp_path / "out")
    assert [(p.missions, p.present) for p in plan] == [(25, 10), (25, 0)]
    assert files_of(tmp_path / "out") == before
    done = plan_study(small_study(tmp_path, policies=["greedy"]), tmp_path / "out")
    assert [p.seconds for p in done] == [(0.0, 0.0)]
    assert total_time(done, 1) == (0.0, 0.0)


DECISIONS = 2 * 60 / 4  # of a mission of the small scenario


def test_the_time_is_a_range_and_nothing_is_simulated(tmp_path, monkeypatch):
    monkeypatch.setattr("dess.analysis.execution.jobs.simulate", None)
    monkeypatch.setattr("dess.analysis.execution.jobs.simulate_batch", None)
    study = small_study(tmp_path, policies=["greedy", "planner"])
    plan = plan_study(study, tmp_path / "out")
    expected = [10 * DECISIONS * each for each in (2e-6, 4e-4)]
    for planned, seconds in zip(plan, expected, strict=True):
        assert planned.seconds == pytest.approx((seconds / SPREAD, seconds * SPREAD))
    ends = sum(expected) / 2 / SPREAD, sum(expected) / 2 * SPREAD + START
    assert total_time(plan, 2) == pytest.approx(ends)
    assert str(Range(1.0, 90.0)) == "up to 90 seconds"
    assert str(Range(5.0, 90.0)) == "5 to 90 seconds"
    assert str(Range(5.0, 240.0)) == "5 seconds to 4 minutes"


def test_a_rule_has_a_least_and_a_most(tmp_path):
    study = precise(tmp_path)
    assert [p.missions for p in plan_study(study, tmp_path / "out")] == [2 * 5] * 2
    assert study.most_missions == 2 * 60
    study = selecting(tmp_path, budget=100)
    assert [p.missions for p in plan_study(study, tmp_path / "out")] == [4 * 8] * 2
    assert study.most_missions == 100 + 5
    run_study(study, tmp_path / "out")
    done = plan_study(study, tmp_path / "out")
    assert all(p.missions == p.present > 4 * 8 for p in done)


def test_a_run_that_is_surely_long_has_to_be_confirmed(tmp_path, monkeypatch):
    """The lower end of the range decides; what may be long is run."""
    study, out = small_study(tmp_path), tmp_path / "out"
    ends = total_time(plan_study(study, out, workers=2), 2)
    monkeypatch.setattr(effort, "LONG_RUN", ends.low * 1.01)
    check_run(study, out, workers=2)
    monkeypatch.setattr(effort, "LONG_RUN", ends.low * 0.99)
    before = files_of(tmp_path)
    line = (
        r"study trial: 20 missions to simulate \(policies: 2, design points: 1, workers: 2\), "
        r"about up to 15 seconds; allowed: --yes, or less"
    )
    with pytest.raises(InputError, match=line):
        check_run(study, out, workers=2)
    check_run(study, out, yes=True)
    assert files_of(tmp_path) == before
    run_study(study, out)
    check_run(study, out)  # all of it is there


def test_missions_are_counted_and_not_listed(tmp_path, monkeypatch):
    study = small_study(tmp_path, missions=10**9)
    monkeypatch.setattr(memory, "available_memory", lambda: 2**40)
    monkeypatch.setattr(effort, "LONG_RUN", 1e9)
    line = r"2,000,000,000 missions .*: about 2,23\d\.\d GiB of memory, of which 1,024.0 are avail"
    with pytest.raises(InputError, match=line):
        check_run(study, tmp_path / "out")
    assert [p.missions for p in plan_study(study, tmp_path / "out")] == [10**9] * 2


def test_bounds_are_part_of_the_plan_and_of_the_time(tmp_path):
    study = small_study(tmp_path, bounds=True)
    plan = plan_study(study, tmp_path / "out")
    assert (plan[2].missions, plan[2].present) == (10, 0)
    assert plan[2].seconds == pytest.approx([10 * DECISIONS * each for each in BOUND])
    assert len(plan_study(small_study(tmp_path), tmp_path / "out")) == 2
