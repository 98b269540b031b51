"""Missions of a study simulated again, to look at them and to check their records.

>>> mission = resimulate(results, "greedy", point=0, replication=17)
>>> mission.record.metrics["slots"], mission.events
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from analysis.results.tables import Results
from dess import InputError, simulate
from dess.record import MISSION_RECORD, UAV_RECORD, MissionRecord
from dess.scenario import Scenario
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


def resimulate(results: Results, policy: str, point: int, replication: int) -> Resimulated:
    """Simulate a mission of a study again, with the SimPy engine.

    Raises:
        InputError: If the study has no such mission, or its record is another one.
    """
    manifest = results.store.manifest
    space = results.scenario(point)
    record = simulate(space, load_team(policy), manifest.seed, replication, events=True)
    if changed := difference(record, recorded(results, policy, point, replication)):
        raise InputError(
            f"{results.store.folder}: {policy}, point {point}, replication {replication}: "
            f"{changed}; allowed: results of this very code"
        )
    assert record.events is not None
    scenario = sample_scenario(space, manifest.seed, replication)
    return Resimulated(scenario, record, pd.DataFrame(record.events.columns()))


fly = resimulate  # the former name, for notebooks that still use it


def recorded(results: Results, policy: str, point: int, replication: int) -> dict[str, Any]:
    """The record of a mission of a study, by field; those of its UAVs as ``uav 1 quota``.

    The records of missions that check a selection are without their UAVs.

    Raises:
        InputError: If the study has no such mission.
    """
    where = {"policy": policy, "point": point, "replication": replication}
    for missions in (results.missions, results.checks):
        if len(row := _rows(missions, where)):
            fields = {name: row[name].item() for name in MISSION_RECORD.names or ()}
            uavs = _rows(results.uavs, where) if missions is results.missions else row[:0]
            for number, uav in enumerate(uavs.to_dict("records"), 1):
                fields |= {f"uav {number} {name}": uav[name] for name in UAV_RECORD.names or ()}
            return fields
    raise InputError(
        f"{results.store.folder}: no mission of {policy}, point {point}, replication "
        f"{replication}; allowed: a mission of the study"
    )


def difference(record: MissionRecord, fields: Mapping[str, Any]) -> str:
    """The recorded fields that are not, bit for bit, those of the record; empty if all are."""
    again = _fields(record)
    changed = [name for name in fields if again.get(name) != fields[name]]
    if not changed:
        return ""
    first = changed[0]
    more = f", and {len(changed) - 1} more" if changed[1:] else ""
    return f"{first} is {fields[first]} and {again.get(first)} when simulated again{more}"


def _fields(record: MissionRecord) -> dict[str, Any]:
    fields = {name: record.metrics[name].item() for name in MISSION_RECORD.names or ()}
    for number, uav in enumerate(record.uavs, 1):
        fields |= {f"uav {number} {name}": uav[name].item() for name in UAV_RECORD.names or ()}
        fields[f"uav {number} end"] = END_NAMES[uav["end"]]
    return fields


def _rows(table: pd.DataFrame, where: Mapping[str, Any]) -> pd.DataFrame:
    alike = [table[name].to_numpy() == value for name, value in where.items()]
    return table[np.logical_and.reduce(alike)]
