"""Missions that are flown by a script on both engines, and what their logs say."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest

from dess.envs.stepper import MissionStepper
from dess.model.batch import simulate_batch
from dess.model.mission import simulate
from dess.model.record import MissionRecord, Records
from dess.model.view import View, acting_rows
from dess.scenario.scenario import Scenario, ScenarioSpace
from tests.drawn import Script

Log = dict[str, np.ndarray]

# The channel of the missions that are worked by hand: see test_missions.py.
CHANNEL: dict[str, Any] = {
    **{"grid": 4, "cell_size": 40.0, "altitude": 10.0, "path_loss_exponent": 2.0},
    **{"edge_snr": 10 * math.log10(1.9921875), "shadowing_variance": 0.0},
    **{"arrival_rate": 0.0, "communication_slots": 1},
}


def flown(
    scenario: Scenario | ScenarioSpace, *routes: str, starts: Any = None
) -> tuple[MissionRecord, Log]:
    """The mission and its log; of the first replication in which UAV i starts at ``starts[i]``.

    Both engines must agree on it.
    """
    for replication in range(1000):
        record = simulate(scenario, Script(*routes), 0, replication, events=True)
        assert record.events is not None
        log = record.events.columns()
        begins = (log["event"] == "mission_start") & (log["uav"] >= 0)
        if starts in (None, list(zip(log["x"][begins], log["y"][begins], strict=True))):
            batch = simulate_batch(scenario, Script(*routes), 0, [replication])
            assert is_same(batch, 0, record)
            return record, log
    raise AssertionError(f"no replication starts at {starts}")


def is_same(records: Records, job: int, single: MissionRecord) -> bool:
    """Whether a row of a batch is a single mission, to the last bit."""
    uavs = np.zeros_like(records.uavs[job])
    uavs[: len(single.uavs)] = single.uavs
    pairs = [(records.missions[job], single.metrics), (records.uavs[job], uavs)]
    if single.operations is not None:
        pairs.append((records.operations[job], single.operations))
    if single.nodes is not None:
        pairs.append((records.nodes[job, : len(single.nodes)], single.nodes))
    return all(one.tobytes() == other.tobytes() for one, other in pairs)


def assert_same_alone(
    space: ScenarioSpace, team: Any, seed: int, numbers: Sequence[int], **options: Any
) -> None:
    """Assert that missions in batches are those that are simulated alone, bit for bit."""
    records = simulate_batch(space, team, seed, numbers, **options)
    for job, number in enumerate(numbers):
        assert is_same(records, job, simulate(space, team, seed, number))


def rows_of(log: Log, event: str, *names: str) -> list:
    """The columns of the rows of an event; plain values where there is one column."""
    chosen = log["event"] == event
    columns = [log[name][chosen].tolist() for name in names]
    return columns[0] if len(names) == 1 else list(zip(*columns, strict=True))


def cells_of(record: MissionRecord) -> list[tuple[float, float]]:
    """The cells of a lone UAV after each slot, of a mission with events."""
    assert record.events is not None
    return rows_of(record.events.columns(), "move", "x", "y")


def first_view(scenario: Scenario | ScenarioSpace, seed: int = 1, replication: int = 0) -> View:
    """The first slot of a mission."""
    stepper = MissionStepper(scenario, 1, seed)
    stepper.start_at(seed, replication)
    stepper.launch(stepper.indices)
    state = stepper.state
    return View(state, stepper.world, *acting_rows(state.missions, state.uavs, 1, 0))


def batteries(log: Log, uav: int = 0) -> list[float]:
    """The battery of a UAV at the end of every slot in which it was active."""
    return [battery for i, battery in rows_of(log, "move", "uav", "value") if i == uav]


class Case(NamedTuple):
    """A mission.

    Attributes:
        fields: Fields of its scenario.
        routes: What each UAV does; then it hovers.
        expected: Numbers by what they are: the columns of an event, ``record`` or ``uavs``.
        starts: The cells in which the UAVs start, where there are several.
    """

    fields: dict[str, Any]
    routes: tuple[str, ...]
    expected: dict[str, Any]
    starts: Any = None


def check(case: Case) -> None:
    """Check a mission that was worked by hand."""
    record, log = flown(Scenario.of(**case.fields), *case.routes, starts=case.starts)
    for what, numbers in case.expected.items():
        kind, *names = what.split()
        if kind == "record":
            found: Any = [getattr(record, name) for name in names]
        else:
            found = record.uavs[names].tolist() if kind == "uavs" else rows_of(log, kind, *names)
        flat = np.array(found, float).ravel().tolist()
        assert flat == pytest.approx(np.array(numbers, float).ravel().tolist(), abs=1e-9), what
