"""The buffer of a node as a queue: with a server of given service times, or with a UAV above it.

A UAV collects data at fixed times, so in missions service times are not exponential. Therefore a
SimPy process takes the place of the UAV where theory asks for exponential service; the buffer is
that of the model (``dess.sections.buffers``), and so are the arrivals. With a UAV above the node,
a whole mission of the model is the queue.
"""

from collections.abc import Generator
from typing import Any

import numpy as np
import simpy

from analysis.verification import closed_forms
from analysis.verification.lone_uav import Hovering
from dess import simulate
from dess.record import OPERATIONS, MissionRecord
from dess.scenario import ScenarioSpace
from dess.sections.buffers import Buffers

Process = Generator[simpy.Event, Any, None]


class Server:
    """A server that takes one packet after the other from the buffer of a node.

    A packet stays in the buffer, and takes one of its places, until its service is done.

    Attributes:
        buffers: The buffer.
        numbers: (N,) for each packet, the integral of the number in the buffer over the time from
            the arrival before to its own.
    """

    def __init__(self, times: np.ndarray, work: np.ndarray, limit: int = 0):
        """Let all packets arrive, and serve them.

        Args:
            times: (N,) times of the arrivals.
            work: (N,) service times, in the order of service.
            limit: Packets that the buffer can hold; 0 for no limit.
        """
        self.buffers, self.numbers = Buffers(1, limit), np.zeros(len(times))
        self._env = simpy.Environment()
        self._work, self._number, self._changed = iter(work.tolist()), 0, 0.0
        self._env.process(self._arrivals(times.tolist()))
        self._env.run()

    def _arrivals(self, times: list[float]) -> Process:
        for self._number, time in enumerate(times):
            yield self._env.timeout(time - self._env.now)
            self._count()
            was_empty = self._held == 0
            self.buffers.store(0, self._env.now, 1.0)
            if was_empty:
                self._env.process(self._service())

    def _service(self) -> Process:
        """Serve packets until the buffer is empty."""
        while self._held > 0:
            yield self._env.timeout(next(self._work))
            self._count()
            self.buffers.serve(0, self._env.now, 1.0)

    @property
    def _held(self) -> int:
        return len(self.buffers.queues[0])

    def _count(self) -> None:
        """Add the number in the buffer over the time since it has changed."""
        self.numbers[self._number] += self._held * (self._env.now - self._changed)
        self._changed = self._env.now


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
