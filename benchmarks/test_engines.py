"""Speed of the engines on the paper's scenario, in UAV-slots per second of CPU time."""

import time

import numpy as np
import pytest

from benchmarks.conftest import MISSIONS, SEED, RecordedMissions
from benchmarks.floor import draw, needed_draws
from benchmarks.recorded import Recorded
from dess import policies, simulate, simulate_batch

FLOOR_MISSIONS = 300
# What other processes do matters less for CPU time than for the clock.
pytestmark = pytest.mark.benchmark(timer=time.process_time)


def test_floor(benchmark, recorded: RecordedMissions) -> None:
    """The Philox blocks and normal deviates that the missions need, and nothing else."""
    blocks, deviates = needed_draws(recorded.scenario, recorded.actions, SEED, FLOOR_MISSIONS)
    records = simulate_batch(recorded.scenario, Recorded(recorded.actions), SEED, FLOOR_MISSIONS)
    uav_slots = int(records.missions["uav_slots"].sum())
    print(f"{blocks / uav_slots:.2f} blocks, {deviates / uav_slots:.2f} deviates per UAV-slot")
    draw(1, 1)
    benchmark.extra_info["uav_slots"] = uav_slots
    benchmark(draw, blocks, deviates)


def _batch(benchmark, recorded: RecordedMissions, policy, workers: int = 1) -> None:
    simulate_batch(recorded.scenario, policy, SEED, 10)
    benchmark.extra_info["uav_slots"] = recorded.uav_slots
    replications = np.arange(MISSIONS)
    records = benchmark(
        simulate_batch, recorded.scenario, policy, SEED, replications, workers=workers
    )
    if not isinstance(policy, Recorded):
        benchmark.extra_info["uav_slots"] = int(records.missions["uav_slots"].sum())


def test_batch_engine_free_policy(benchmark, recorded: RecordedMissions) -> None:
    """Recorded actions of greedy: the engine alone."""
    _batch(benchmark, recorded, Recorded(recorded.actions))


@pytest.mark.benchmark(timer=time.perf_counter)
def test_batch_engine_free_policy_two_threads(benchmark, recorded: RecordedMissions) -> None:
    """The same on two cores."""
    _batch(benchmark, recorded, Recorded(recorded.actions), workers=2)


@pytest.mark.parametrize("name", ["random", "nearest", "greedy", "tour"])
def test_batch_engine(benchmark, recorded: RecordedMissions, name: str) -> None:
    """The heuristics."""
    _batch(benchmark, recorded, policies.load(name))


@pytest.mark.parametrize("events", [False, True], ids=["without_log", "with_log"])
def test_simpy_engine(benchmark, recorded: RecordedMissions, events: bool) -> None:
    """The SimPy model with greedy."""
    policy, missions = policies.load("greedy"), 40
    simulate(recorded.scenario, policy, SEED)

    def run() -> int:
        return sum(
            simulate(recorded.scenario, policy, SEED, replication, events=events).uav_slots
            for replication in range(missions)
        )

    benchmark.extra_info["uav_slots"] = run()
    benchmark(run)
