"""Missions of a study flown again, to look at them and to check what is kept of them."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from analysis.results.tables import Results
from dess import simulate
from dess.errors import InputError
from dess.record import MISSION_RECORD, UAV_RECORD, MissionRecord
from dess.scenario import Scenario
from dess.state import END_NAMES, sample_scenario
from policies import load_team


class Flight(NamedTuple):
    """A mission flown again.

    Attributes:
        scenario: The scenario that its replication draws.
        record: What it left.
        events: Its event log, with the columns of ``dess.record.EventLog``.
    """

    scenario: Scenario
    record: MissionRecord
    events: pd.DataFrame


def fly(results: Results, policy: str, point: int, replication: int) -> Flight:
    """Fly a mission of a study again, with the SimPy engine.

    Raises:
        InputError: If the study has no such mission, or it leaves another record than it did.
    """
    manifest = results.store.manifest
    space = results.scenario(point)
    record = simulate(space, load_team(policy), manifest.seed, replication, events=True)
    if changed := difference(record, kept(results, policy, point, replication)):
        raise InputError(
            f"{results.store.folder}: {policy}, point {point}, replication {replication}: "
            f"{changed}; allowed: results of this very code"
        )
    assert record.events is not None
    scenario = sample_scenario(space, manifest.seed, replication)
    return Flight(scenario, record, pd.DataFrame(record.events.columns()))


def told(record: MissionRecord) -> dict[str, Any]:
    """All fields of a record by name, those of its UAVs as ``uav 1 quota``."""
    fields = {name: record.metrics[name].item() for name in MISSION_RECORD.names or ()}
    for number, uav in enumerate(record.uavs, 1):
        fields |= {f"uav {number} {name}": uav[name].item() for name in UAV_RECORD.names or ()}
        fields[f"uav {number} end"] = END_NAMES[uav["end"]]
    return fields


def kept(results: Results, policy: str, point: int, replication: int) -> dict[str, Any]:
    """What is kept of a mission, as ``told`` has it; of one that checks a selection, not its UAVs.

    Raises:
        InputError: If the study has no such mission.
    """
    where = {"policy": policy, "point": point, "replication": replication}
    for missions in (results.missions, results.checks):
        if len(found := _rows(missions, where)):
            fields = {name: found[name].item() for name in MISSION_RECORD.names or ()}
            uavs = _rows(results.uavs, where) if missions is results.missions else found[:0]
            for number, uav in enumerate(uavs.to_dict("records"), 1):
                fields |= {f"uav {number} {name}": uav[name] for name in UAV_RECORD.names or ()}
            return fields
    raise InputError(
        f"{results.store.folder}: no mission of {policy}, point {point}, replication "
        f"{replication}; allowed: a mission of the study"
    )


def difference(record: MissionRecord, kept: Mapping[str, Any]) -> str:
    """What is not, bit for bit, as it is kept; nothing if all is."""
    flown = told(record)
    changed = [name for name in kept if flown.get(name) != kept[name]]
    if not changed:
        return ""
    first = changed[0]
    more = f", and {len(changed) - 1} more" if changed[1:] else ""
    return f"{first} is {kept[first]} and {flown.get(first)} when flown again{more}"


def _rows(table: pd.DataFrame, where: Mapping[str, Any]) -> pd.DataFrame:
    alike = [table[name].to_numpy() == value for name, value in where.items()]
    return table[np.logical_and.reduce(alike)]
