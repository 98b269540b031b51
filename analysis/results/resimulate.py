"""Missions of a study simulated again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from math import isnan
from typing import Any, Self

import numpy as np
import pandas as pd

from dess import InputError, simulate, simulate_batch
from dess.analysis import numbers
from dess.analysis.metrics import NODE_AGES, NODE_RATIOS, format_length
from dess.analysis.results.event_log import causes_of_failure
from dess.analysis.results.tables import Results
from dess.model.mission import Process
from dess.model.record import (
    MISSION_RECORD,
    UAV_RECORD,
    YEAR_OPERATIONS,
    MissionRecord,
    node_ratios,
)
from dess.model.state import END_NAMES, sample_scenario
from dess.policies.registry import Policy, load_team
from dess.scenario.fields import SAMPLED
from dess.scenario.scenario import Scenario, ScenarioSpace

NODES = "nodes"  # the field of a record with the hash of the values of its nodes


@dataclass(frozen=True, eq=False)
class LoggedMission:
    """A mission with its event log, of a study or of any scenario.

    Attributes:
        policy: The team.
        scenario: The scenario of the mission, with its drawn parameters.
        record: The metrics of the mission as attributes: a row of ``Results.missions`` or, if it
            was simulated again, a ``MissionRecord``.
        uavs: The records of its UAVs, a row each.
        events: The event log, with the columns of ``dess.model.events.EventLog``.
    """

    policy: str
    scenario: Scenario
    record: Any
    uavs: pd.DataFrame
    events: pd.DataFrame

    @classmethod
    def of(
        cls,
        results: Results,
        policy: str,
        point: int = 0,
        replication: int = 0,
        events: pd.DataFrame | None = None,
    ) -> Self:
        """A mission of a study, with the event log that is given or else the one that is stored.

        Raises:
            InputError: If no log is given, and none is stored.
        """
        if events is None:
            events = results.events(policy, point, replication)
        mission = {"policy": policy, "point": point, "replication": replication}
        record = _rows_of_mission(results.missions, mission).iloc[0]
        sampled = {name: int(record[name]) for name in SAMPLED}
        scenario = results.scenario(point).scenario_at(**sampled)
        return cls(policy, scenario, record, _rows_of_mission(results.uavs, mission), events)

    @property
    def replication(self) -> int:
        """The replication of the mission."""
        return int(self.record.replication)

    @property
    def collected(self) -> str:
        """How much data the mission collected, as a part of a sentence."""
        total = self.record.initial + self.record.arrived
        return f"{self.record.collected:.1f} of {total:.1f} data units collected"

    @property
    def fleet(self) -> str:
        """The fleet of the mission, as ``3 UAVs``."""
        return numbers.format_count(self.scenario.uavs, "UAV")

    @property
    def causes(self) -> str:
        """What ended the mission of each UAV that did not fill its quota, as sentences."""
        return " ".join(f"{cause}." for cause in causes_of_failure(self.events, self.scenario))

    @property
    def caption(self) -> str:
        """What happened in the mission, as the caption of a figure."""
        return (
            f"{self.policy} in mission {self.replication}, a single one (n = 1): "
            f"{self.causes or f'All UAVs {self.scenario.aim}.'} "
            f"{self.collected} in {format_length(self.record.slots, self.scenario.units)}."
        )


def mission_of(
    space: ScenarioSpace,
    team: Sequence[Policy],
    seed: int = 0,
    replication: int = 0,
    processes: Sequence[Process] = (),
) -> LoggedMission:
    """Simulate a mission of any scenario, with its event log.

    Raises:
        InputError: If a policy cannot act in the scenario.
    """
    record = simulate(space, team, seed, replication, events=True, processes=processes)
    assert record.events is not None
    scenario = sample_scenario(space, seed, replication)
    names = (policy.name for policy in team)
    events = pd.DataFrame(record.events.columns())
    return LoggedMission(",".join(names), scenario, record, _uavs_of(record), events)


def record_of(
    space: ScenarioSpace,
    team: Sequence[Policy],
    seed: int,
    replication: int,
    processes: Sequence[Process] = (),
) -> MissionRecord:
    """Simulate a replication again: a mission with the SimPy engine, a year with the other one."""
    if space.weather.is_on:
        return simulate_batch(space, [*team], seed, [replication]).mission(0)
    return simulate(space, team, seed, replication, processes=processes)


def resimulate(results: Results, policy: str, point: int, replication: int) -> LoggedMission:
    """Simulate a mission of a study again, with the SimPy engine.

    Raises:
        InputError: If the study has no such mission, or has processes of Python files, which only
            a user may name; or if the new record differs from the stored one.
    """
    space = results.scenario(point)
    manifest = results.store.manifest
    team = load_team(policy, space.uavs[1])
    processes = manifest.load_processes(())
    mission = mission_of(space, team, manifest.seed, replication, processes)
    if changed := difference_in_words(
        mission.record, stored_record(results, policy, point, replication)
    ):
        raise InputError(
            f"{results.store.folder}: {policy}, point {point}, replication {replication}",
            changed,
            "results that were made by this code",
        )
    return mission


def stored_record(results: Results, policy: str, point: int, replication: int) -> dict[str, Any]:
    """The stored record of a mission, by field; fields of its UAVs are named like ``uav 1 quota``.

    For missions that check a selection, no records of UAVs are stored.

    Raises:
        InputError: If the study has no such mission.
    """
    mission = {"policy": policy, "point": point, "replication": replication}
    tables = (results.missions, results.checks, results.uavs)
    missions, checks, uavs = (
        _rows_of_mission(table, mission).to_dict("records") for table in tables
    )
    if missions or checks:
        row = (missions or checks)[0]
        measured = (n for n in YEAR_OPERATIONS.names or () if n in row and not isnan(row[n]))
        return _by_field(row, uavs) | {name: row[name] for name in measured} | _hash_of_nodes(row)
    raise InputError(
        results.store.folder,
        f"no mission of {policy}, point {point}, replication {replication}",
        "a mission of the study",
    )


def difference_in_words(record: MissionRecord, fields: Mapping[str, Any]) -> str:
    """The stored fields that differ, in any bit, from a record, in words; empty if none does."""
    uavs = _uavs_of(record).to_dict("records")
    metrics = {name: record.metrics[name] for name in MISSION_RECORD.names or ()}
    simulated = _by_field(metrics, uavs) | record.measured
    if record.nodes is not None and NODES in fields:
        kept = {NODE_RATIOS: node_ratios(record.nodes), NODE_AGES: record.nodes["age"]}
        simulated |= _hash_of_nodes(kept)
    names = [*fields, *(name for name in record.measured if name not in fields)]
    changed = [name for name in names if simulated.get(name) != fields.get(name)]
    if not changed:
        return ""
    first = changed[0]
    more = ""
    if changed[1:]:
        more = f", and {len(changed) - 1} more"
    return f"{first} is {fields.get(first)} and {simulated.get(first)} when simulated again{more}"


def _by_field(mission: Mapping[Any, Any], uavs: Sequence[Mapping[Any, Any]]) -> dict[str, Any]:
    """A record by field, from the row of the mission and the rows of its UAVs."""
    fields = {name: mission[name] for name in MISSION_RECORD.names or () if name in mission}
    for number, uav in enumerate(uavs, 1):
        fields |= {f"uav {number} {n}": uav[n] for n in UAV_RECORD.names or () if n in uav}
    return fields


def _hash_of_nodes(mission: Mapping[Any, Any]) -> dict[str, str]:
    """A hash of what is kept of the nodes of a mission, if something is."""
    if NODE_RATIOS not in mission:
        return {}
    values = np.concatenate([mission[NODE_RATIOS], mission[NODE_AGES]])
    return {NODES: sha256(values.astype("<f8").tobytes()).hexdigest()[:16]}


def _uavs_of(record: MissionRecord) -> pd.DataFrame:
    """The records of the UAVs, as results have them."""
    return pd.DataFrame(record.uavs).assign(end=[END_NAMES[end] for end in record.uavs["end"]])


def _rows_of_mission(table: pd.DataFrame, mission: Mapping[str, Any]) -> pd.DataFrame:
    """The rows of a table that belong to a mission."""
    for name in ("replication", "point", "policy"):  # texts last: they are slow to compare
        table = table[table[name].to_numpy() == mission[name]]
    return table
