"""Missions of a study flown again, to look at them and to check what is kept of them."""

from collections.abc import Mapping
from typing import NamedTuple

import pandas as pd

from analysis.results import Results
from dess import simulate
from dess.errors import InputError
from dess.record import MISSION_RECORD, MissionRecord
from dess.scenario import Scenario
from dess.state import sample_scenario
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
    kept = _kept(results, policy, point, replication)
    space = results.scenario(point)
    record = simulate(space, load_team(policy), manifest.seed, replication, events=True)
    if changed := difference(record, kept):
        raise InputError(
            f"{results.store.folder}: {policy}, point {point}, replication {replication}: "
            f"{changed}; allowed: results of this very code"
        )
    assert record.events is not None
    scenario = sample_scenario(space, manifest.seed, replication)
    return Flight(scenario, record, pd.DataFrame(record.events.columns()))


def difference(record: MissionRecord, kept: Mapping[str, float]) -> str:
    """What is not, bit for bit, as it is kept; nothing if all is."""
    changed = [name for name in MISSION_RECORD.names or () if record.metrics[name] != kept[name]]
    if not changed:
        return ""
    first = changed[0]
    more = f", and {len(changed) - 1} more" if changed[1:] else ""
    return f"{first} is {kept[first]} and {record.metrics[first]} when flown again{more}"


def _kept(results: Results, policy: str, point: int, replication: int) -> Mapping[str, float]:
    """The record of a mission, or of one that checks a selection."""
    for missions in (results.missions, results.checks):
        of_mission = missions["replication"] == replication
        of_cell = (missions["policy"] == policy) & (missions["point"] == point)
        if (found := missions[of_cell & of_mission]).size:
            return found.iloc[0].to_dict()
    raise InputError(
        f"{results.store.folder}: no mission of {policy}, point {point}, replication "
        f"{replication}; allowed: a mission of the study"
    )
