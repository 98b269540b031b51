"""The missions that the benchmarks run, and the table that they end with."""

from typing import NamedTuple

import numpy as np
import pytest

import policies
from benchmarks.recorded import Recorder
from dess import load_scenario, simulate_batch
from dess.scenario import ScenarioSpace

SEED, MISSIONS = 5, 2000


class RecordedMissions(NamedTuple):
    """Missions of greedy on the paper's scenario: the actions and the number of UAV-slots."""

    scenario: ScenarioSpace
    actions: np.ndarray
    uav_slots: int


@pytest.fixture(scope="session")
def recorded() -> RecordedMissions:
    scenario = load_scenario("paper")
    recorder = Recorder(policies.load("greedy"), MISSIONS, scenario.max_slots, scenario.uavs[1])
    records = simulate_batch(scenario, recorder, SEED, MISSIONS)
    return RecordedMissions(scenario, recorder.actions, int(records.missions["uav_slots"].sum()))


def pytest_terminal_summary(terminalreporter) -> None:
    """UAV-slots per second of each benchmark (best round), and against the floor."""
    session = getattr(terminalreporter.config, "_benchmarksession", None)
    rows = [b for b in session.benchmarks if "uav_slots" in b.extra_info] if session else []
    speeds = {row.name: row.extra_info["uav_slots"] / row.stats.min for row in rows}
    if not speeds:
        return
    engines = {row.name: row.extra_info.get("engine") for row in rows}
    terminalreporter.section("UAV-slots per second, best round")
    floor = speeds.get("test_floor")
    for name, speed in speeds.items():
        share = f"{floor / speed:6.2f} x the floor's time" if floor else ""
        if engine := engines.get(name):
            share = f"{100 * engine:4.0f} % of the time in the engine"
        terminalreporter.write_line(f"{name[5:]:34}{speed:14,.0f}{1e9 / speed:9.0f} ns  {share}")
