"""Missions whose event logs a study has stored, as arrays per mission slot and node."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from analysis.results import event_log
from analysis.results.tables import Results
from dess.scenario import SAMPLED, Scenario, ScenarioSpace


@dataclass(frozen=True, eq=False)
class Log:
    """A mission whose event log is stored.

    Attributes:
        policy: The team.
        scenario: The scenario with the parameters that the mission drew.
        mission: The record of the mission.
        uavs: The records of its UAVs.
        events: The event log.
    """

    policy: str
    scenario: Scenario
    mission: pd.Series
    uavs: pd.DataFrame
    events: pd.DataFrame

    @property
    def replication(self) -> int:
        """The replication of the mission."""
        return int(self.mission["replication"])

    @cached_property
    def uav_slots(self) -> pd.DataFrame:
        """The action of every UAV in every slot, as ``analysis.results.event_log.uav_slots``."""
        return event_log.uav_slots(self.events)

    @cached_property
    def initial(self) -> np.ndarray:
        """(K,) data of every node at the start [data units]."""
        return self._of_nodes("mission_start")

    @cached_property
    def left(self) -> np.ndarray:
        """(K,) data of every node at the end [data units]."""
        return self._of_nodes("mission_end")

    @cached_property
    def first_cell(self) -> np.ndarray:
        """(2,) the cell in which the first UAV starts."""
        rows = self.events[(self.events["event"] == "mission_start") & (self.events["uav"] == 0)]
        return rows[["x", "y"]].to_numpy(int)[0]

    @cached_property
    def arrivals(self) -> np.ndarray:
        """(T, K) data units that arrived, by mission slot and node."""
        rows = self.events[self.events["event"] == "arrival"]
        counts = np.zeros((event_log.duration(self.events), len(self.scenario.nodes)), int)
        slot = rows["time"].astype(int) - 1
        np.add.at(counts, (slot, rows["node"]), rows["value"].astype(int))
        return counts

    @cached_property
    def residuals(self) -> np.ndarray:
        """(E, K) residual data before every event, summed in the order of the log."""
        flows = np.zeros((len(self.events) + 1, len(self.scenario.nodes)))
        flows[0] = self.initial
        sign = self.events["event"].map({"arrival": 1.0, "communication": -1.0}).fillna(0.0)
        flowing = np.flatnonzero(sign)
        nodes = self.events["node"].to_numpy()[flowing]
        flows[flowing + 1, nodes] = (sign * self.events["value"]).to_numpy()[flowing]
        return flows.cumsum(0)[:-1]

    def _of_nodes(self, event: str) -> np.ndarray:
        rows = self.events[(self.events["event"] == event) & (self.events["node"] >= 0)]
        return rows.sort_values("node")["value"].to_numpy()


def logs_of(results: Results) -> list[Log]:
    """The missions of the first design point whose logs a study has stored."""
    logs = []
    space, replications = results.scenario(), range(results.manifest["study"]["logged"])
    missions, uavs = (
        table[(table["point"] == 0) & table["replication"].isin(replications)]
        for table in (results.missions, results.uavs)
    )
    for policy in results.policies:
        records = missions[missions["policy"] == policy].set_index("replication", drop=False)
        fleets = uavs[uavs["policy"] == policy]
        for replication in replications:
            record = records.loc[replication]
            scenario = space.scenario_at(**{name: int(record[name]) for name in SAMPLED})
            fleet = fleets[fleets["replication"] == replication]
            events = results.events(policy, 0, replication)
            logs.append(Log(policy, scenario, record, fleet, events))
    return logs


def longest(logs: Sequence[Log]) -> list[Log]:
    """The longest log of every replication; all policies meet the same arrivals in it."""
    by_replication: dict[int, Log] = {}
    for log in logs:
        other = by_replication.setdefault(log.replication, log)
        if log.mission["slots"] > other.mission["slots"]:
            by_replication[log.replication] = log
    return [by_replication[replication] for replication in sorted(by_replication)]


def arrivals(logs: Sequence[Log], space: ScenarioSpace) -> np.ndarray:
    """(T, K) data units that arrived, by slot and node; missions follow one after another."""
    none = np.zeros((0, len(space.nodes)), int)
    return np.concatenate([none, *(log.arrivals for log in logs)])
