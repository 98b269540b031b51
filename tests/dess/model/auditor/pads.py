"""The charging pads: requests, the queue, grants, and the power that the pads share."""

import math
from collections.abc import Mapping
from fractions import Fraction
from itertools import accumulate, pairwise, starmap
from typing import Any

from tests.dess.model.auditor.log import Log
from tests.dess.model.auditor.uavs import HOVER, Fleet, Uav

EVENTS = ("charge_request", "charge_withdrawal", "charge_start")  # at the start of a slot


class Pads:
    """The charging pads of a mission, numbered zone by zone.

    Attributes:
        zones: The pads of each zone.
        out: Those out of order.
    """

    def __init__(self, log: Log, constants: Mapping[str, Any], fleet: Fleet):
        self.log, self.c, self.fleet = log, constants, fleet
        charging = constants.get("charging", {"order": "first-come", "power": 0})
        self.by_battery, self.power = charging["order"] == "lowest-battery", charging["power"]
        given = [constants["pads"], *(zone["pads"] for zone in constants.get("zones", ()))]
        numbers = [n or len(cells) for n, cells in zip(given, fleet.zones, strict=True)]
        ends = [*accumulate(numbers, initial=0)]
        self.zones, self.number = [*starmap(range, pairwise(ends))], ends[-1]
        self.out: set[int] = set()
        self.requests = 0
        self.complete = self.start = 0  # C_C and C_S of the mission

    def limit_of(self, u: Uav) -> int:
        """The battery at which a charge of a UAV ends."""
        return min(self.complete, u.full or self.complete)

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
        for zone, pads in enumerate(self.zones):
            free = [pad for pad in pads if pad not in self.out | held]
            for i, pad in zip(self._in_order(zone, "waits"), free, strict=False):
                self.fleet.uavs[i].charging, self.fleet.uavs[i].pad = True, pad
                self.fleet.uavs[i].charge_slots = 0
                self.fleet.take("charge_start", self.log.slot, i)

    def ask(self, i: int) -> None:
        """Let a UAV ask for a pad; one whose pad has failed keeps the time of its request."""
        u = self.fleet.uavs[i]
        u.requested = u.requested if u.requested >= 0 else self.log.slot
        self.requests += 1
        self.fleet.take("charge_request", self.log.slot, i)

    def _may_charge(self, u: Uav) -> bool:
        is_ready = not u.end and not u.grounded and u.latch and u.asked == HOVER
        return is_ready and self.fleet.zone_of(u) >= 0

    def _in_order(self, zone: int, state: str) -> list[int]:
        """The UAVs of a zone that wait or are charging, in the order of the queue."""
        rank = {
            i: (*self._battery_of(i, state), u.requested, i)
            for i, u in enumerate(self.fleet.uavs)
            if getattr(u, state) and self.fleet.zone_of(u) == zone
        }
        return sorted(rank, key=rank.__getitem__)

    def _battery_of(self, i: int, state: str) -> tuple[float, ...]:
        """The battery by which a UAV is sorted; of equal percents in gusts, the log decides."""
        u = self.fleet.uavs[i]
        if not self.by_battery:
            return ()
        if not self.fleet.gusts:
            return (1000 * u.battery - u.remainder,)
        if state == "charging":
            return u.battery, u.battery - u.logged_battery
        log = self.fleet.log
        coming = (row for row in log.rows[log.place :] if row.event == "charge_start")
        granted = [row.uav for row in coming if row.time == log.slot]
        return u.battery, [*granted, i].index(i)

    def charge(self) -> None:
        """Charge the UAVs on the pads."""
        for zone in range(len(self.zones)):
            left = self.power or math.inf
            for i in self._in_order(zone, "charging"):
                u = self.fleet.uavs[i]
                rate = Fraction(str(u.charge_rate or self.c["charge_rate"]))
                u.charge_slots += 1
                added = math.floor(u.charge_slots * rate) - math.floor((u.charge_slots - 1) * rate)
                gain = min(added, self.limit_of(u) - u.battery, left)
                u.battery += gain
                u.charged += gain
                left -= gain
                u.slots_charging += 1

    def update_latch(self, u: Uav) -> None:
        """Judge the latch of a UAV at the start of a slot."""
        if self.c.get("landing"):
            u.latch = u.battery < self.limit_of(u) and not u.has_filled
            return
        if u.battery <= self.start:
            u.latch = True
        if u.battery >= self.limit_of(u):
            u.latch = False
