"""The missions that the benchmarks run, and the table that they end with.

The engines are compared with the floor measured in the same run: ``ratios.json`` has their recorded
times in units of the floor's. A benchmark that takes ``TOLERANCE`` times as long as recorded fails
the run.
"""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from benchmarks.recorded import Recorder
from dess import load_scenario, policies, simulate_batch
from dess.scenario.scenario import ScenarioSpace

SEED, MISSIONS = 5, 2000
RATIOS = json.loads(Path(__file__).with_name("ratios.json").read_text("utf-8"))
TOLERANCE = 1.15  # the best rounds of two runs differ by less in CPU time


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


def _speeds(config: pytest.Config) -> dict[str, float]:
    """UAV-slots per second of each benchmark, best round; none where nothing was timed."""
    session = getattr(config, "_benchmarksession", None)
    rows = [b for b in session.benchmarks if "uav_slots" in b.extra_info] if session else []
    return {row.name: row.extra_info["uav_slots"] / row.stats.min for row in rows}


def losses(speeds: dict[str, float]) -> list[str]:
    """A line for each benchmark that is slower, against the floor, than recorded."""
    floor, lines = speeds.get("test_floor"), []
    for name, recorded in RATIOS.items() if floor else ():
        if name in speeds and floor / speeds[name] > TOLERANCE * recorded:
            lines.append(
                f"{name}: {floor / speeds[name]:.2f} x the floor's time, recorded are "
                f"{recorded:.2f} x; allowed: {TOLERANCE * recorded:.2f} x at most"
            )
    return lines


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail a run in which speed was lost."""
    if losses(_speeds(session.config)):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter) -> None:
    """UAV-slots per second of each benchmark (best round), and against the floor."""
    session = getattr(terminalreporter.config, "_benchmarksession", None)
    speeds = _speeds(terminalreporter.config)
    if not speeds:
        return
    engines = {row.name: row.extra_info.get("engine") for row in session.benchmarks}
    terminalreporter.section("UAV-slots per second, best round")
    floor = speeds.get("test_floor")
    for name, speed in speeds.items():
        share = f"{floor / speed:6.2f} x the floor's time" if floor else ""
        if engine := engines.get(name):
            share = f"{100 * engine:4.0f} % of the time in the engine"
        terminalreporter.write_line(f"{name[5:]:34}{speed:14,.0f}{1e9 / speed:9.0f} ns  {share}")
    if slower := losses(speeds):
        terminalreporter.section("Speed was lost", red=True)
        terminalreporter.write_line("\n".join(slower))
