"""What is compared with theory: event logs, and missions simulated for it.

In a mission, UAVs serve the node with the highest SNR, so the data that they collect are not a
random sample of the channel. With one node there is no choice, and the data of every communication
slot are one random draw of the rate.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from dess import simulate, simulate_batch
from dess.analysis.answers.missions import of_nodes
from dess.analysis.results import event_log
from dess.analysis.results.resimulate import LoggedMission, difference_in_words, stored_record
from dess.analysis.results.tables import Results
from dess.model.state import HOVER
from dess.model.view import View
from dess.policies.registry import load_team
from dess.scenario.scenario import ScenarioSpace
from tests.verification import closed_forms


class Log(LoggedMission):
    """A mission whose event log is stored, with what the log says of UAVs and nodes."""

    @cached_property
    def uav_slots(self) -> pd.DataFrame:
        """The action of every UAV in every slot, as ``event_log.uav_slots`` has it."""
        return event_log.uav_slots(self.events)

    @cached_property
    def initial(self) -> np.ndarray:
        """(K,) data of every node at the start [data units]."""
        return of_nodes(self.events, ["mission_start"], len(self.scenario.nodes))

    @cached_property
    def left(self) -> np.ndarray:
        """(K,) data of every node at the end [data units]."""
        return of_nodes(self.events, ["mission_end"], len(self.scenario.nodes))

    @cached_property
    def first_cell(self) -> np.ndarray:
        """(2,) the cell in which the first UAV starts."""
        rows = self.events[(self.events["event"] == "mission_start") & (self.events["uav"] == 0)]
        return rows[["x", "y"]].to_numpy(int)[0]

    @cached_property
    def arrivals(self) -> np.ndarray:
        """(T, K) data units that arrived, by mission slot and node."""
        rows = self.events[self.events["event"] == "arrival"]
        counts = np.zeros((event_log.mission_length(self.events), len(self.scenario.nodes)), int)
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


def logs_of(results: Results) -> list[Log]:
    """The missions of the first design point whose logs a study has stored."""
    logged = range(results.study.logged)
    return [Log.of(results, policy, 0, n) for policy in results.policies for n in logged]


def longest_logs(logs: Sequence[Log]) -> list[Log]:
    """The longest log of every replication; all policies meet the same arrivals in it."""
    by_replication: dict[int, Log] = {}
    for log in logs:
        other = by_replication.setdefault(log.replication, log)
        if log.record.slots > other.record.slots:
            by_replication[log.replication] = log
    return [by_replication[replication] for replication in sorted(by_replication)]


def arrivals_by_slot(logs: Sequence[Log], space: ScenarioSpace) -> np.ndarray:
    """(T, K) data units that arrived, by slot and node; missions follow one after another."""
    none = np.zeros((0, len(space.nodes)), int)
    return np.concatenate([none, *(log.arrivals for log in logs)])


PER_DISTANCE, SLOTS = 200, 100  # missions per distance, and their slots, with the batch engine
LONG = 5000  # mission slots of the mission with the SimPy engine

_PLENTY = 1e9  # data units at the node, more than the UAV can collect


class Hovering:
    """A policy that hovers in every slot."""

    name = "hovering"

    def act(self, view: View) -> np.ndarray:
        """Choose Hover for all R rows."""
        return np.full(len(view.uav), HOVER)


def scenario_of_one_uav(space: ScenarioSpace, dx: int, dy: int, slots: int) -> ScenarioSpace:
    """A scenario with the same channel, one UAV and one node ``dx, dy`` cells away.

    The mission lasts ``slots`` slots. The battery does not decrease, and the node is never empty.
    """
    still: dict[str, Any] = {"uavs": 1, "flying_time": 100, "flight_cost": 0, "pads": None}
    place: dict[str, Any] = {"zone": (0, 0, 1, 1), "nodes": ((dx, dy),)}
    data: dict[str, Any] = {"initial_data": _PLENTY, "arrival_rate": 0.0}
    quota = slots * space.communication_slots
    return ScenarioSpace.of(space, **still, **place, **data, quota=quota, max_slots=slots)


def offsets_of_node(space: ScenarioSpace) -> list[tuple[int, int]]:
    """Offsets of the node from the UAV [cells], from none up to the whole grid."""
    along = [0, *(2**k for k in range(8) if 2**k < space.grid)]
    return [*((d, 0) for d in along), (space.grid - 1, space.grid - 1)]


def simulate_rates(space: ScenarioSpace, seed: int) -> list[float]:
    """Mean rates at all offsets with the batch engine [data units per communication slot].

    Every offset has its own replications, because the same replications have the same shadowing.
    """
    means = []
    for number, (dx, dy) in enumerate(offsets_of_node(space)):
        replications = range(number * PER_DISTANCE, (number + 1) * PER_DISTANCE)
        scenario = scenario_of_one_uav(space, dx, dy, SLOTS)
        missions = simulate_batch(scenario, Hovering(), seed, replications).missions
        means.append(float(missions["collected"].sum() / _draws_per_distance(space)))
    return means


def simulate_slots(space: ScenarioSpace, seed: int, slots: int = LONG) -> list[float]:
    """Data of every communication slot of a mission with the SimPy engine [data units]."""
    scenario = scenario_of_one_uav(space, space.grid // 2, 0, slots)
    log = simulate(
        scenario, Hovering(), seed, len(offsets_of_node(space)) * PER_DISTANCE, events=True
    ).events
    assert log is not None
    columns = log.columns()
    return columns["value"][columns["event"] == "communication"].tolist()


def compare_rates(space: ScenarioSpace, means: Sequence[float]) -> pd.DataFrame:
    """The rates of ``simulate_rates`` together with those of the closed form.

    Returns:
        A row per distance: ``distance`` [m], ``n`` communication slots, ``mean`` [data units per
        communication slot], ``known`` and ``error``, the closed form's mean and the standard error
        of a mean of n draws.
    """
    rows = []
    n = _draws_per_distance(space)
    for (dx, dy), mean in zip(offsets_of_node(space), means, strict=True):
        distance = float(closed_forms.distance_to_node(space, dx, dy))
        expected, deviation = closed_forms.rate_moments(space, distance)
        rows.append((distance, n, mean, expected, deviation / np.sqrt(n)))
    return pd.DataFrame(rows, columns=["distance", "n", "mean", "known", "error"])


def shadowing_deviates(space: ScenarioSpace, collected: Sequence[float]) -> np.ndarray:
    """The shadowing in the data of ``simulate_slots``, in standard deviations.

    The SNR follows from the data of a communication slot (eq. 9), the shadowing from the SNR
    (eq. 10).
    """
    distance = closed_forms.distance_to_node(space, space.grid // 2, 0)
    snr = closed_forms.snr_of(space, np.array(collected))
    return (snr - closed_forms.mean_snr(space, distance)) / np.sqrt(space.shadowing_variance)


def _draws_per_distance(space: ScenarioSpace) -> int:
    """The number of communication slots per distance."""
    return PER_DISTANCE * SLOTS * space.communication_slots


MISSIONS = 50  # missions of every policy to simulate again, spread over its replications


class SimulatedAgain(NamedTuple):
    """A mission of a study, simulated again with the SimPy engine.

    Attributes:
        policy: The team.
        replication: The replication; the design point is the first one.
        differs: In which fields the record differs from the stored one, in words; empty if in none.
    """

    policy: str
    replication: int
    differs: str


def simulate_again(results: Results, count: int = MISSIONS) -> list[SimulatedAgain]:
    """Simulate missions of a study with the SimPy engine, and compare their records.

    Args:
        results: The results of the study.
        count: Missions of every policy to simulate again, all of them if there are fewer.
    """
    space = results.scenario()
    seed = results.store.manifest.seed
    missions = []
    for policy in results.policies:
        team = load_team(policy)
        for replication in _replications_to_repeat(results, policy, count):
            record = simulate(space, team, seed, replication)
            differs = difference_in_words(record, stored_record(results, policy, 0, replication))
            missions.append(SimulatedAgain(policy, replication, differs))
    return missions


def _replications_to_repeat(results: Results, policy: str, count: int) -> list[int]:
    """The replications of the missions to simulate again, at the first point."""
    missions = results.missions
    chosen = missions[(missions["point"] == 0) & (missions["policy"] == policy)]
    replications = chosen["replication"].to_numpy()
    rows = np.unique(np.linspace(0, len(replications) - 1, count).astype(int))
    return [int(replication) for replication in replications[rows]]
