"""Missions of a study simulated again, to look at them and to check their records.

>>> mission = resimulate(results, "greedy", point=0, replication=17)
>>> mission.record.metrics["slots"], mission.events
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from analysis.results.tables import Results
from dess import InputError, simulate
from dess.record import MISSION_RECORD, UAV_RECORD, MissionRecord
from dess.scenario import Scenario, ScenarioSpace
from dess.state import END_NAMES, sample_scenario
from policies import load_team


class Resimulated(NamedTuple):
    """A mission that was simulated again.

    Attributes:
        scenario: The scenario that its replication draws.
        record: Its record.
        events: Its event log, with the columns of ``dess.record.EventLog``.
    """

    scenario: Scenario
    record: MissionRecord
    events: pd.DataFrame


def mission_of(
    space: ScenarioSpace, policy: str, seed: int = 0, replication: int = 0
) -> Resimulated:
    """A mission of any scenario, to look at.

    Raises:
        InputError: If there is no such policy, or it cannot act in the scenario.
    """
    record = simulate(space, load_team(policy), seed, replication, events=True)
    assert record.events is not None
    events = pd.DataFrame(record.events.columns())
    return Resimulated(sample_scenario(space, seed, replication), record, events)


def resimulate(results: Results, policy: str, point: int, replication: int) -> Resimulated:
    """Simulate a mission of a study again, with the SimPy engine.

    Raises:
        InputError: If the study has no such mission, or its record is another one.
    """
    space, seed = results.scenario(point), results.store.manifest.seed
    mission = mission_of(space, policy, seed, replication)
    if changed := difference(mission.record, recorded(results, policy, point, replication)):
        raise InputError(
            f"{results.store.folder}: {policy}, point {point}, replication {replication}: "
            f"{changed}; allowed: results of this very code"
        )
    return mission


def recorded(results: Results, policy: str, point: int, replication: int) -> dict[str, Any]:
    """The record of a mission of a study, by field; those of its UAVs as ``uav 1 quota``.

    The records of missions that check a selection are without their UAVs.

    Raises:
        InputError: If the study has no such mission.
    """
    mission = {"policy": policy, "point": point, "replication": replication}
    tables = (results.missions, results.checks, results.uavs)
    missions, checks, uavs = (_rows(table, mission) for table in tables)
    if missions or checks:
        return _by_field((missions or checks)[0], uavs)
    raise InputError(
        f"{results.store.folder}: no mission of {policy}, point {point}, replication "
        f"{replication}; allowed: a mission of the study"
    )


def difference(record: MissionRecord, fields: Mapping[str, Any]) -> str:
    """The recorded fields that are not, bit for bit, those of the record; empty if all are."""
    uavs = pd.DataFrame(record.uavs).assign(end=[END_NAMES[end] for end in record.uavs["end"]])
    simulated = _by_field(record.metrics, uavs.to_dict("records"))
    changed = [name for name in fields if simulated.get(name) != fields[name]]
    if not changed:
        return ""
    first, more = changed[0], f", and {len(changed) - 1} more" if changed[1:] else ""
    return f"{first} is {fields[first]} and {simulated.get(first)} when simulated again{more}"


def _by_field(mission: Any, uavs: Sequence[Mapping[Any, Any]]) -> dict[str, Any]:
    """A record by field, from the row of the mission and those of its UAVs."""
    fields = {name: mission[name] for name in MISSION_RECORD.names or ()}
    for number, uav in enumerate(uavs, 1):
        fields |= {f"uav {number} {name}": uav[name] for name in UAV_RECORD.names or ()}
    return fields


def _rows(table: pd.DataFrame, mission: Mapping[str, Any]) -> list[dict[Any, Any]]:
    """The rows of a mission."""
    equal = [table[name].to_numpy() == value for name, value in mission.items()]
    return table[np.logical_and.reduce(equal)].to_dict("records")
