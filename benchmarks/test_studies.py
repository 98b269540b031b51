"""What a study costs beside its engine: fig5 with a heuristic, in one process, two, and on dask.

Every round starts from an empty folder; compilation and the start of workers are apart.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from analysis import load_study, run_study
from analysis.results import Results, parts_of
from analysis.runner import CHUNK
from analysis.store import Store, split
from analysis.study import Study
from dess import simulate_batch
from policies import load

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


def test_fig5_engine_alone(benchmark, fig5, uav_slots) -> None:
    """The chunks of the study, simulated and thrown away."""
    with TemporaryDirectory() as folder:
        (cells,) = Store.peek(fig5, Path(folder) / "out").manifest.cells
    parts = parts_of(cells, [fig5.missions] * len(cells))
    greedy = load("greedy")
    jobs = [
        [
            (fig5.points[part.cell.point].scenario, r)
            for part in chunk.parts
            for r in part.replications
        ]
        for chunk in split(parts, CHUNK["batch"])
    ]

    def engine() -> None:
        for rows in jobs:
            spaces, replications = [list(column) for column in zip(*rows, strict=True)]
            simulate_batch(spaces, greedy, fig5.seed, replications)

    benchmark.pedantic(engine, rounds=ROUNDS, warmup_rounds=1)
    benchmark.extra_info["uav_slots"] = uav_slots


@pytest.mark.parametrize("workers", [1, 2])
def test_fig5_workers(benchmark, fig5, uav_slots, workers: int) -> None:
    benchmark.pedantic(run, (fig5,), {"workers": workers}, rounds=ROUNDS, warmup_rounds=2)
    benchmark.extra_info["uav_slots"] = uav_slots


def test_fig5_dask_of_two(benchmark, fig5, uav_slots, cluster) -> None:
    benchmark.pedantic(run, (fig5,), {"scheduler": cluster}, rounds=ROUNDS, warmup_rounds=2)
    benchmark.extra_info["uav_slots"] = uav_slots
