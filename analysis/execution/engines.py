"""Missions by either engine, from the same arguments and with the same records."""

from collections.abc import Callable, Sequence
from typing import Any

from dess import simulate, simulate_batch
from dess.record import Records, empty_records
from dess.scenario import ScenarioSpace

# Missions of a chunk, by engine: enough to fill a batch, few enough to lose little when
# interrupted.
CHUNK = {"batch": 500, "events": 50}


def simulate_missions(
    engine: str,
    spaces: Sequence[ScenarioSpace],
    team: Sequence[Any],
    seed: int,
    replications: Sequence[int],
    progress: Callable[[int], object] | None = None,
) -> Records:
    """Simulate missions one after the other, or together with the batch engine.

    Args:
        engine: ``batch`` or ``events``.
        spaces: The scenario of each mission.
        team: The policies; those without a UAV in a mission are left out.
        seed: Seed of the missions.
        replications: The replication of each mission.
        progress: Called with the number of missions finished since its last call.

    Raises:
        InputError: If the batch engine cannot simulate one of the scenarios.
    """
    if engine == "batch":
        fleet = max(space.uavs[1] for space in spaces)
        return simulate_batch(spaces, team[:fleet], seed, replications, progress=progress)
    is_extended = any(space.is_extended for space in spaces)
    records = empty_records(len(spaces), max(space.uavs[1] for space in spaces), is_extended)
    for row, (space, replication) in enumerate(zip(spaces, replications, strict=True)):
        record = simulate(space, team[: space.uavs[1]], seed, replication)
        records.missions[row] = record.metrics
        records.uavs[row, : len(record.uavs)] = record.uavs
        if record.operations is not None:
            records.operations[row] = record.operations
        if progress:
            progress(1)
    return records
