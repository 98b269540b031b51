"""What a study costs beside its engine: fig5 with a heuristic, in one process, two, and on dask.

Every round starts from an empty folder; compilation and the start of workers are apart.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from dess import simulate_batch
from dess.analysis import load_study, run_study
from dess.analysis.execution import jobs
from dess.analysis.results.tables import Results
from dess.analysis.study.study import Study

ROUNDS = 5


@pytest.fixture(scope="module")
def fig5() -> Study:
    return load_study("fig5", policies=["greedy"])


@pytest.fixture(scope="module")
def uav_slots(fig5) -> int:
    with TemporaryDirectory() as folder:
        return int(run_study(fig5, folder).missions["uav_slots"].sum())


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        yield cluster.scheduler_address


def run(study: Study, **where) -> Results:
    with TemporaryDirectory() as folder:
        return run_study(study, Path(folder) / "out", **where)


def test_fig5_here(benchmark, fig5, uav_slots, monkeypatch) -> None:
    """One process, and the share of its time that it spends in the engine."""
    seconds = []

    def timed(*arguments, **options) -> Any:
        begin = time.perf_counter()
        records = simulate_batch(*arguments, **options)
        seconds.append(time.perf_counter() - begin)
        return records

    monkeypatch.setattr(jobs, "simulate_batch", timed)
    benchmark.pedantic(run, (fig5,), rounds=ROUNDS, warmup_rounds=1)
    benchmark.extra_info["uav_slots"] = uav_slots
    studies = ROUNDS + 1
    engine = sum(seconds[len(seconds) // studies :])  # without the warm-up
    if benchmark.enabled:
        benchmark.extra_info["engine"] = engine / benchmark.stats.stats.total


def test_fig5_two_workers(benchmark, fig5, uav_slots) -> None:
    benchmark.pedantic(run, (fig5,), {"workers": 2}, rounds=ROUNDS, warmup_rounds=2)
    benchmark.extra_info["uav_slots"] = uav_slots


def test_fig5_dask_of_two(benchmark, fig5, uav_slots, cluster) -> None:
    benchmark.pedantic(run, (fig5,), {"scheduler": cluster}, rounds=ROUNDS, warmup_rounds=2)
    benchmark.extra_info["uav_slots"] = uav_slots
