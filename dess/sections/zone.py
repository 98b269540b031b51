"""A charging zone of the SimPy model: its pads as a resource."""

import numpy as np
import simpy
from simpy.resources.resource import Request


class ChargingZone(simpy.Resource):
    """The pads of a charging zone, granted in the order of the scenario (``rules.grant_pads``).

    The UAVs of a slot ask one after the other at the same time. Pads are granted when all have
    asked, so that the order of asking does not matter. A pad out of order is not granted.

    Attributes:
        requests: For each UAV its request, waiting or granted, or None.
    """

    def __init__(self, env: simpy.Environment, mission: np.void, uavs: np.ndarray, zone: int = 0):
        pads = mission["zone_pads"]
        super().__init__(env, int(pads[zone]))
        self._mission, self._uavs = mission, uavs
        self._pads = slice(int(pads[:zone].sum()), int(pads[: zone + 1].sum()))
        self.requests: list[Request | None] = [None] * int(mission["uavs"])

    @property
    def capacity(self) -> int:
        """The number of pads that work."""
        pads = self._pads
        return pads.stop - pads.start - int(self._mission["pads_out"][pads].sum())

    def _do_put(self, event: Request) -> None:
        """Let a request wait until ``grant``."""

    def ask(self, uav: int) -> None:
        """Put a UAV into the queue."""
        self.leave(uav)
        self.requests[uav] = self.request()

    def leave(self, uav: int) -> None:
        """Take a UAV out of the queue, or take back its pad."""
        request, self.requests[uav] = self.requests[uav], None
        if request is not None:
            request.cancel()  # of no effect if the pad has been granted
            self.release(request)

    def holds_pad(self, uav: int) -> bool:
        """Whether a UAV has been granted a pad and has not left it."""
        request = self.requests[uav]
        return request is not None and request.triggered

    def grant(self) -> list[int]:
        """Grant the free pads to the first UAVs in the queue; return these UAVs."""
        waiting = [i for i, r in enumerate(self.requests) if r is not None and not r.triggered]
        waiting.sort(key=self._order)
        granted = waiting[: max(self.capacity - self.count, 0)]
        for uav in granted:
            request = self.requests[uav]
            assert request is not None
            self.put_queue.remove(request)
            super()._do_put(request)
        return granted

    def _order(self, uav: int) -> tuple[int, int, int]:
        """The place of a UAV in the queue (``charging.is_before``)."""
        u = self._uavs[uav]
        battery = int(u["battery"]) if self._mission["lowest_battery_first"] else 0
        return battery, int(u["pad_request"]), uav
