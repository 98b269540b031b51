"""The charging zone and the buffers of nodes as queues: arrivals, customers and a server.

Zone (``dess.mission``), buffers (``dess.sections.packets``) and arrivals are those of the
SimPy model. Only the UAVs are other ones: they come to the zone, charge for a given time and leave.
With a UAV above a node, a whole mission of the model is the queue.
"""

from collections.abc import Callable, Generator, Sequence
from typing import Any

import numpy as np
import simpy

from dess import simulate
from dess.analysis.verification import closed_forms
from dess.analysis.verification.measurements import Hovering
from dess.mission import ChargingZone
from dess.record import OPERATIONS, MissionRecord
from dess.scenario import ScenarioSpace
from dess.sections.arrivals import draw_arrival, factors_of, sources_of
from dess.sections.packets import Buffers
from dess.state import MISSION, UAV, constants_of

Process = Generator[simpy.Event, Any, None]

_UAVS = 100  # more than are ever in the zone at the same time


class Station:
    """UAVs that come to a charging zone, one after the other.

    Attributes:
        waits: (N,) the time that each of them has waited for a pad.
        queues: (N,) for each of them, the integral of the number of waiting UAVs over the time
            from the arrival before to its own.
    """

    def __init__(self, pads: int, gaps: np.ndarray, times: np.ndarray):
        """Let all UAVs come, charge and leave.

        Args:
            pads: Number of charging pads.
            gaps: (N,) times between arrivals.
            times: (N,) for how long each UAV charges.
        """
        mission, self._uavs = np.zeros(1, MISSION), np.zeros(_UAVS, UAV)
        mission["zones"], mission["uavs"] = 1, _UAVS
        mission["zone_pads"][0, 0] = pads
        self._env = simpy.Environment()
        self._zone = ChargingZone(self._env, mission[0], self._uavs)
        self.waits, self.queues = np.full(len(gaps), np.nan), np.zeros(len(gaps))
        self._times, self._came = times, np.zeros(_UAVS)
        self._number, self._changed = 0, 0.0
        self._env.process(self._arrivals(gaps))
        self._env.run()

    def _arrivals(self, gaps: np.ndarray) -> Process:
        for self._number, gap in enumerate(gaps):
            yield self._env.timeout(gap)
            uav = self._zone.requests.index(None)
            self._uavs[uav]["pad_request"], self._came[uav] = self._number, self._env.now
            self._serve(self._zone.ask, uav)

    def _serve(self, change: Callable[[int], None], uav: int) -> None:
        """Let a UAV ask for a pad or leave, and grant the pads that are free after it."""
        env = self._env
        self.queues[self._number] += len(self._zone.queue) * (env.now - self._changed)
        self._changed = env.now
        change(uav)
        for granted in self._zone.grant():
            number = self._uavs[granted]["pad_request"]
            self.waits[number] = env.now - self._came[granted]
            done = env.timeout(self._times[number])
            assert done.callbacks is not None
            done.callbacks.append(self._leaver(granted))

    def _leaver(self, uav: int) -> Callable[[simpy.Event], None]:
        """What happens when a UAV is charged."""
        return lambda _: self._serve(self._zone.leave, uav)


def ages_of(buffers: Buffers, end: float) -> tuple[float, float, float]:
    """The mean age, the mean peak and the 99th percentile, as a record of a mission has them."""
    out = np.zeros(1, OPERATIONS)[0]
    buffers.write(out, end, with_age=True)
    return float(out["age"]), float(out["peak_age"]), float(out["age_p99"])


def visited(times: np.ndarray) -> Buffers:
    """A node whose data are collected at these times, each time as they are generated."""
    buffers = Buffers(1)
    for time in times.tolist():
        buffers.store(0, time, 1.0)
        buffers.serve(0, time, 1.0)
    return buffers


def mission_above(
    space: ScenarioSpace, load: float, seed: int, replication: int, **changes: Any
) -> MissionRecord:
    """A mission of a UAV that hovers above a node and collects a packet per communication slot.

    Without shadowing the rate is the same in all communication slots.

    Args:
        space: The scenario whose channel the mission has.
        load: Packets that arrive per communication slot, on average.
        seed, replication: Those of the mission.
        **changes: Other fields of the scenario.
    """
    values: dict[str, Any] = {
        **{"uavs": 1, "flying_time": 100, "flight_cost": 0, "pads": None, "quota": 1_000_000},
        **{"zone": (0, 0, 1, 1), "nodes": ((0, 0),), "initial_data": 0.0},
        **{"shadowing_variance": 0.0, "arrivals": {"process": "continuous"}},
    }
    above = ScenarioSpace.of(space, **values, arrival_rate=load * space.communication_slots)
    snr = closed_forms.mean_snr(above, closed_forms.distance(above, 0, 0))
    packets = float(closed_forms.rate(above, snr))  # per communication slot
    fleet = [{"rate": 1 / packets}]
    return simulate(ScenarioSpace.of(above, fleet=fleet, **changes), Hovering(), seed, replication)


def arrivals_of(space: ScenarioSpace, k: int, seed: int = 1, replication: int = 0) -> np.ndarray:
    """The times [slots] of all arrivals at node ``k`` until the last slot of a mission."""
    missions = constants_of(space)
    missions["seed"], missions["replication"] = seed, replication
    sources = sources_of(space.node_rates)
    factors = factors_of(space.arrivals)
    found = []
    while sources["time"][k] < np.inf:
        draw_arrival(missions, sources, *factors, k)
        found.append(sources["time"][k])
    return np.array(found[:-1])


def integrated(
    times: np.ndarray, schedule: Sequence[tuple[float, float]], end: float
) -> np.ndarray:
    """The integral of the factor of a schedule from 0 to each time, for times up to ``end``.

    In this time, the arrivals of a process with the rate 1 are a Poisson process of rate 1.
    """
    edges = np.array([0.0, *(slot for slot, _ in schedule), end])
    factors = np.array([1.0, *(factor for _, factor in schedule)])
    areas = np.concatenate([[0.0], (factors * np.diff(edges)).cumsum()])
    return np.interp(times, edges, areas)
