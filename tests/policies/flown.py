"""Missions that policies have flown, in one engine and in both."""

from collections.abc import Sequence
from typing import Any

from dess.batch import simulate_batch
from dess.env.stepper import MissionStepper
from dess.mission import simulate
from dess.record import MissionRecord
from dess.scenario import Scenario, ScenarioSpace
from dess.view import View, acting_rows


def assert_same_alone(
    space: ScenarioSpace, team: Any, seed: int, numbers: Sequence[int], **options: Any
) -> None:
    """Assert that missions in batches are those that are simulated alone, bit for bit."""
    records = simulate_batch(space, team, seed, numbers, **options)
    for job, number in enumerate(numbers):
        single = simulate(space, team, seed, number)
        assert single.metrics.tobytes() == records.missions[job].tobytes()
        assert single.uavs.tobytes() == records.uavs[job, : len(single.uavs)].tobytes()


def cells_of(record: MissionRecord) -> list[tuple[float, float]]:
    """The cells of a lone UAV after each slot, of a mission with events."""
    assert record.events is not None
    log = record.events.columns()
    moves = log["event"] == "move"
    return list(zip(log["x"][moves].tolist(), log["y"][moves].tolist(), strict=True))


def first_view(scenario: Scenario | ScenarioSpace, seed: int = 1, replication: int = 0) -> View:
    """The first slot of a mission."""
    stepper = MissionStepper(scenario, 1, seed)
    stepper.start_at(seed, replication)
    stepper.launch(stepper.indices)
    state = stepper.state
    return View(state, stepper.world, *acting_rows(state.missions, state.uavs, 1, 0))
