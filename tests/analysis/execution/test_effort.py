import faulthandler
import os
import signal
import subprocess
import sys
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.execution import effort
from analysis.execution.effort import (
    EVENT,
    MAX_WORKERS,
    check_missions,
    check_workers,
    check_workers_memory,
    mission_memory,
)
from dess import InputError, load_scenario, simulate
from dess.channel import world_of
from dess.code import memory
from policies import load_team
from tests.analysis.small import environment

PAPER = load_scenario("paper")
CONTINUOUS = {"arrivals.process": "continuous"}
# The ends of the ranges of what decides how long a mission takes.
EXTREME = {
    "uavs": [1, 16],
    "nodes": [[[0, 0]], [[x, y] for x in range(26) for y in range(32)]],
    "communication_slots": [1, 64],
    "max_slots": [1, 40, 100_000],
    "quota": [1, 1_000_000],
    "flight_cost": [0, 1],
    "arrival_rate": [-0.0, 5e-324, 1e-310, 0.02, 100.0],
    "initial_data": [0.0, [0, 1e9]],
    "arrivals.process": ["slotted", "continuous"],
    "arrivals.schedule": [[], [[0, -0.0]], [[0, 100], [3, 5e-324]], [[30, 100.0]]],
    "arrivals.buffer": [0, 1],
    "age.measured": [False, True],
    "failures.uav_rate": [-0.0, 5e-324, 1.0],
    "failures.uav_repair": [1.0, 1_000_000.0],
}


@pytest.mark.parametrize("workers", [0, -1, MAX_WORKERS + 1, 10**9])
def test_numbers_of_workers_have_limits(workers):
    with pytest.raises(InputError, match=rf"workers: {workers} is out of range; allowed: 1..1,024"):
        check_workers(workers)
    check_workers(MAX_WORKERS)


def test_the_memory_of_the_channel_is_that_of_its_tables():
    world = world_of(PAPER)
    assert mission_memory(PAPER) == world.order.nbytes + world.means.nbytes


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


@settings(max_examples=20, deadline=None)
@given(st.fixed_dictionaries({}, optional={n: st.sampled_from(v) for n, v in EXTREME.items()}))
def test_every_mission_ends_or_is_refused(fields):
    """A mission that takes too much is refused by the scenario or by the estimate."""
    # Nothing else stops compiled code. The first example may compile for a minute.
    faulthandler.dump_traceback_later(300, exit=True)
    try:
        space = load_scenario("paper", **fields)
        check_missions("a mission", [space], effort.LONG_RUN - 20_000 * EVENT)
    except InputError as error:
        assert "allowed" in str(error)
    else:
        record = simulate(space, load_team("random"), seed=1)
        assert 0 < record.slots <= space.max_slots
    finally:
        faulthandler.cancel_dump_traceback_later()


def test_a_worker_ends_with_a_killed_parent_before_it_has_loaded_anything():
    """The parent starts a process as joblib does, which is busy, and is killed."""
    busy = "import os, time; from analysis.execution.orphans import live_and_die_with as live; "
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
        [sys.executable, "-c", "import analysis.execution.orphans, sys; print(*sys.modules)"],
        capture_output=True, text=True, check=True, env=environment(),
    )  # fmt: skip
    assert not {"numpy", "numba", "pandas", "joblib"} & {*loaded.stdout.split()}
