"""The charging pads: requests, the queue, grants, and the power that the pads share."""

from collections.abc import Mapping
from typing import Any

from tests.dess.auditor.log import Log
from tests.dess.auditor.uavs import HOVER, Fleet, Uav

EVENTS = ("charge_request", "charge_withdrawal", "charge_start")  # at the start of a slot


class Pads:
    """The charging pads of a mission; ``out`` has the indices of those out of order."""

    def __init__(self, log: Log, constants: Mapping[str, Any], fleet: Fleet):
        self.log, self.c, self.fleet = log, constants, fleet
        charging = constants.get("charging", {"order": "first-come", "power": 0})
        self.by_battery, self.power = charging["order"] == "lowest-battery", charging["power"]
        self.number = constants["pads"] or constants["zone"][2] * constants["zone"][3]
        self.out: set[int] = set()
        self.requests = 0
        self.complete = self.start = 0  # C_C and C_S of the mission

    def replay(self) -> None:
        """Ask for pads and give them back, then grant those that are free."""
        for i, u in enumerate(self.fleet.uavs):
            may_charge = self._may_charge(u)
            if may_charge and u.requested < 0:
                self.ask(i)
            elif not may_charge and u.requested >= 0:
                u.requested = -1
                self.fleet.take("charge_withdrawal", self.log.slot, i)
        held = {u.pad for u in self.fleet.uavs if u.charging}
        free = [pad for pad in range(self.number) if pad not in self.out | held]
        queue = self._in_order([i for i, u in enumerate(self.fleet.uavs) if u.waits])
        for i, pad in zip(queue, free, strict=False):
            self.fleet.uavs[i].charging, self.fleet.uavs[i].pad = True, pad
            self.fleet.take("charge_start", self.log.slot, i)

    def ask(self, i: int) -> None:
        """Let a UAV ask for a pad; one whose pad has failed keeps the time of its request."""
        u = self.fleet.uavs[i]
        u.requested = u.requested if u.requested >= 0 else self.log.slot
        self.requests += 1
        self.fleet.take("charge_request", self.log.slot, i)

    def _may_charge(self, u: Uav) -> bool:
        is_ready = not u.end and not u.grounded and u.latch and u.asked == HOVER
        return is_ready and self.fleet.in_zone(*u.cell)

    def _in_order(self, indices: list[int]) -> list[int]:
        """UAVs in the order of the queue."""

        uavs = self.fleet.uavs
        rank = {i: (uavs[i].battery * self.by_battery, uavs[i].requested, i) for i in indices}
        return sorted(indices, key=rank.__getitem__)

    def charge(self) -> None:
        """Charge the UAVs on the pads."""
        charging = [i for i, u in enumerate(self.fleet.uavs) if u.charging]
        left = self.power or self.number * self.c["charge_rate"]
        for i in self._in_order(charging):
            u = self.fleet.uavs[i]
            gain = min(self.c["charge_rate"], self.complete - u.battery, left)
            u.battery += gain
            left -= gain
            u.slots_charging += 1

    def update_latch(self, u: Uav) -> None:
        """Judge the latch of a UAV at the start of a slot."""
        if u.battery <= self.start:
            u.latch = True
        if u.battery >= self.complete:
            u.latch = False
