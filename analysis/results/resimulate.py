"""Simulate missions of a study again, to look at them and to check their records.

>>> mission = resimulate(results, "greedy", point=0, replication=17)
>>> mission.record.metrics["slots"], mission.events
"""

from collections.abc import Mapping, Sequence
from math import isnan
from typing import Any, NamedTuple

import pandas as pd

from analysis.names import measured_in
from analysis.results.tables import Results
from dess import InputError, simulate
from dess.record import MISSION_RECORD, UAV_RECORD, MissionRecord
from dess.scenario import Scenario, ScenarioSpace
from dess.state import END_NAMES, sample_scenario
from policies.base import Policy
from policies.registry import load_team


class Resimulated(NamedTuple):
    """A mission that was simulated again.

    Attributes:
        scenario: The scenario of the mission, with its drawn parameters.
        record: The record of the mission.
        events: The event log, with the columns of ``dess.record.EventLog``.
    """

    scenario: Scenario
    record: MissionRecord
    events: pd.DataFrame


def mission_of(
    space: ScenarioSpace, team: Sequence[Policy], seed: int = 0, replication: int = 0
) -> Resimulated:
    """Simulate a mission of any scenario, with its event log.

    Raises:
        InputError: If a policy cannot act in the scenario.
    """
    record = simulate(space, team, seed, replication, events=True)
    assert record.events is not None
    events = pd.DataFrame(record.events.columns())
    return Resimulated(sample_scenario(space, seed, replication), record, events)


def resimulate(results: Results, policy: str, point: int, replication: int) -> Resimulated:
    """Simulate a mission of a study again, with the SimPy engine.

    Raises:
        InputError: If the study has no such mission, or if the new record differs from the stored
            one.
    """
    space, seed = results.scenario(point), results.store.manifest.seed
    mission = mission_of(space, load_team(policy, space.uavs[1]), seed, replication)
    if changed := difference(mission.record, recorded(results, policy, point, replication)):
        raise InputError(
            f"{results.store.folder}: {policy}, point {point}, replication {replication}: "
            f"{changed}; allowed: results that were made by this code"
        )
    return mission


def recorded(results: Results, policy: str, point: int, replication: int) -> dict[str, Any]:
    """The stored record of a mission, by field; fields of its UAVs are named like ``uav 1 quota``.

    For missions that check a selection, no records of UAVs are stored.

    Raises:
        InputError: If the study has no such mission.
    """
    mission = {"policy": policy, "point": point, "replication": replication}
    tables = (results.missions, results.checks, results.uavs)
    missions, checks, uavs = (_rows(table, mission) for table in tables)
    if missions or checks:
        row = (missions or checks)[0]
        return _by_field(row, uavs) | {m: row[m] for m in measured_in(row) if not isnan(row[m])}
    raise InputError(
        f"{results.store.folder}: no mission of {policy}, point {point}, replication "
        f"{replication}; allowed: a mission of the study"
    )


def difference(record: MissionRecord, fields: Mapping[str, Any]) -> str:
    """The stored fields that differ, in any bit, from a record, in words; empty if none does."""
    uavs = pd.DataFrame(record.uavs).assign(end=[END_NAMES[end] for end in record.uavs["end"]])
    simulated = _by_field(record.metrics, uavs.to_dict("records")) | record.measured
    names = [*fields, *(name for name in record.measured if name not in fields)]
    changed = [name for name in names if simulated.get(name) != fields.get(name)]
    if not changed:
        return ""
    first, more = changed[0], f", and {len(changed) - 1} more" if changed[1:] else ""
    return f"{first} is {fields.get(first)} and {simulated.get(first)} when simulated again{more}"


def _by_field(mission: Any, uavs: Sequence[Mapping[Any, Any]]) -> dict[str, Any]:
    """A record by field, from the row of the mission and the rows of its UAVs."""
    fields = {name: mission[name] for name in MISSION_RECORD.names or ()}
    for number, uav in enumerate(uavs, 1):
        fields |= {f"uav {number} {name}": uav[name] for name in UAV_RECORD.names or ()}
    return fields


def _rows(table: pd.DataFrame, mission: Mapping[str, Any]) -> list[dict[Any, Any]]:
    """The rows of a table that belong to a mission."""
    for name in ("replication", "point", "policy"):  # texts last: they are slow to compare
        table = table[table[name].to_numpy() == mission[name]]
    return table.to_dict("records")
