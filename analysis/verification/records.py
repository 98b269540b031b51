"""Checks that records agree with event logs, engines with each other, and policies share draws."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.numbers import words
from analysis.results import event_log
from analysis.results.tables import Results
from analysis.verification.checks import ENGINES, REALISATIONS, RECORDS, Check
from analysis.verification.cross_check import CrossCheck
from analysis.verification.logs import Log, longest
from dess.files.documents import Document
from dess.scenario import SAMPLED


def record_check(logs: Sequence[Log]) -> Check:
    """Check that the event logs add up to the records of their missions."""
    wrong = sum(not (_mission_agrees(log) and _uavs_agree(log)) for log in logs)
    test = "Record of a mission against its log"
    return Check.counted(RECORDS, test, "the same", wrong, len(logs))


def _mission_agrees(log: Log) -> bool:
    """Whether the log of a mission adds up to its record."""
    value = log.events.groupby("event")["value"].sum()
    filled = log.events.loc[log.events["event"] == "quota_filled", "uav"]
    whole = {
        "slots": event_log.duration(log.events),
        "uav_slots": len(log.uav_slots),
        "arrived": value.get("arrival", 0.0),
        "success": {*filled} == {*log.uavs["uav"]},
    }
    sums = {
        "initial": log.initial.sum(),
        "collected": value.get("communication", 0.0),
        "residual": log.left.sum(),
    }
    return all(log.mission[name] == whole[name] for name in whole) and np.allclose(
        [log.mission[name] for name in sums], [*sums.values()], rtol=1e-12
    )


def _uavs_agree(log: Log) -> bool:
    """Whether the log of a mission adds up to the records of its UAVs."""
    events, records = log.events, log.uavs.set_index("uav")
    fleet = records.index
    communication = events[events["event"] == "communication"].groupby("uav")["value"]
    ends = events[(events["event"] == "mission_end") & (events["uav"] >= 0)].set_index("uav")
    filled = set(events.loc[events["event"] == "quota_filled", "uav"])
    charging = log.uav_slots.groupby("uav")["charging"].sum()
    collected = communication.sum().reindex(fleet, fill_value=0.0)
    return (
        (records["quota"] == communication.size().reindex(fleet, fill_value=0)).all()
        and {*fleet[records["end"] == "quota"]} == filled
        and (records["battery"] == ends["value"].reindex(fleet)).all()
        and (records["slots_charging"] == charging.reindex(fleet, fill_value=0)).all()
        and np.allclose(records["collected"], collected, rtol=1e-12)
    )


def realisation_checks(results: Results, logs: Sequence[Log]) -> list[Check]:
    """Check that all policies meet the same random draws in every replication."""
    if len(results.policies) < 2:
        return []
    drawn = results.missions.groupby(["point", "replication"])[[*SAMPLED, "initial"]].nunique()
    reference = {log.replication: log for log in longest(logs)}
    others = sum(not _same_realisation(log, reference[log.replication]) for log in logs)
    known, of_replication = "the same for all policies", "of a replication"
    return [
        Check.counted(REALISATIONS, f"{what} {of_replication}", known, wrong, n)
        for what, wrong, n in (
            ("Parameters and initial data", int((drawn > 1).any(axis=1).sum()), len(drawn)),
            ("Arrivals and start cells", others, len(logs)),
        )
    ]


def _same_realisation(log: Log, other: Log) -> bool:
    """Whether a mission has the arrivals and the start cell of a longer one."""
    arrivals = log.arrivals
    return np.array_equal(arrivals, other.arrivals[: len(arrivals)]) and np.array_equal(
        log.first_cell, other.first_cell
    )


def engine_check(results: Results, again: CrossCheck) -> Check:
    """Compare missions of a study, bit for bit, with the same missions by the SimPy engine.

    Args:
        results: The results of a study that the batch engine simulated.
        again: The same missions, simulated with the SimPy engine.
    """
    differing = {
        *_differing(results.missions, _table(again.missions), []),
        *_differing(results.uavs, _table(again.uavs), ["uav"]),
    }
    n = len(again.missions)
    seen = f"{n - len(differing):,} of {n:,} missions"
    test = f"Record of the {results.manifest['study']['engine']} engine, simulated again with SimPy"
    simulated = {mission.policy for mission in again.missions}
    if left_out := [policy for policy in results.policies if policy not in simulated]:
        test += f"; not simulated again: {words(left_out)}"
    return Check.exact(ENGINES, test, "equal, bit for bit", seen, n, len(differing))


def _table(records: Sequence[Document]) -> pd.DataFrame:
    return pd.DataFrame(record.data for record in records)


def _differing(kept: pd.DataFrame, again: pd.DataFrame, keys: list[str]) -> set[tuple[str, int]]:
    """The missions (policy and replication) whose rows differ in any field."""
    if again.empty:
        return set()
    mission = ["policy", "replication"]
    rows = again[[*mission, *keys]].merge(kept[kept["point"] == 0], "left", [*mission, *keys])
    equal = (rows[[*again]].to_numpy(object) == again.to_numpy(object)).all(axis=1)
    return {*again.loc[~equal, mission].itertuples(index=False, name=None)}
