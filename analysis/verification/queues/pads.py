"""The charging zone as a queue: UAVs come at the times of a Poisson process.

The zone is that of the SimPy model (``dess.sections.zone``). Only the UAVs are other ones: they
come, wait for a pad, charge for a given time and leave.
"""

from collections.abc import Callable, Generator
from typing import Any

import numpy as np
import simpy

from dess.sections.zone import ChargingZone
from dess.state import MISSION, UAV

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
