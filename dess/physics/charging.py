"""The order in which UAVs are given charging pads, and the power that the pads share."""

from fractions import Fraction
from typing import Any, Literal

import numpy as np
from pydantic import Field

from dess.base.descriptions import Description
from dess.base.kernels import inlined, kernel, shared_kernel
from dess.physics.energy import ACTIONS, HOVERING, PERCENT
from dess.physics.section import Integer, Section, for_sections


class Charging(Section):
    """The charging pads beyond their number (``pads``) and their rate (``charge_rate``).

    With the section on, the records have the use of the pads.
    """

    order: Literal["first-come", "lowest-battery"] = Field(
        "first-come",
        description="which waiting UAV is given the next free pad, and which charging UAV takes "
        "its share of the power first",
    )
    power: Integer = Field(
        0,
        ge=0,
        le=6400,
        description=Description(
            "battery that all pads of a zone together can add in a slot",
            unit="%",
            note="0 for no limit",
        ),
    )
    measured: bool = Field(
        False, description="whether records have the queue, waiting time and use of the pads"
    )
    plan_waits: bool = Field(
        True,
        description=Description(
            "whether the return guard allows for the wait for a pad",
            note="always with another order, a limit of power or pads that may fail",
        ),
    )

    def constants(self) -> dict[str, Any]:
        """The fields of ``MISSION`` that the section sets."""
        return {
            "has_charging": self.is_on,
            "plans_waits": self.plan_waits or self.order != "first-come" or self.power > 0,
            "lowest_battery_first": self.order == "lowest-battery",
            "power": self.power,
        }


@inlined
def is_before(mission, u, other):
    """Whether ``u`` comes before ``other``, which has the lower index, for pads and power."""
    if mission.lowest_battery_first:
        if u.battery != other.battery:
            return u.battery < other.battery
        if u.remainder != other.remainder:
            return u.remainder > other.remainder
    return u.pad_request < other.pad_request


def may_change_order(mission: np.void) -> bool:
    """Whether UAVs in a queue may change their order while they wait.

    They do if the lowest battery comes first and hovering takes more of it for some types of UAVs.
    """
    if not mission["lowest_battery_first"] or mission["landing"]:
        return False
    of_hovering = mission["slot_costs"][HOVERING::ACTIONS][: mission["slowest"]]
    return bool(of_hovering.min() != of_hovering.max())


def queue_key(mission: np.void, u: np.void, uav: int) -> tuple[int, int, int]:
    """What UAVs are sorted by in the queue for the pads of a zone, in the order of ``is_before``.

    The key of a UAV is the same in every slot of its wait, but where queues may change their order
    (``may_change_order``). The battery is that in slot 0, had the UAV waited since then: waiting
    costs the same in every slot in the air, and nothing on ground.

    Args:
        mission: ``MISSION`` record.
        u: ``UAV`` record.
        uav: Index of the UAV.
    """
    slot = int(mission["slot"])
    request = int(u["pad_request"])
    if request < 0:  # it asks in this slot
        request = slot
    if not mission["lowest_battery_first"]:
        return 0, request, uav
    battery = PERCENT * int(u["battery"]) - int(u["remainder"])
    hovering = mission["slot_costs"][HOVERING::ACTIONS][int(u["slots_per_cell"]) - 1]
    cost = int(mission["flight_cost"]) * int(hovering)
    if mission["landing"] or may_change_order(mission):
        cost = 0
    return battery + cost * slot, request, uav


# The largest denominator of a rate: sums of as many slots as a mission has are 64-bit integers.
_MOST_SLOTS = 10**11


def charge_fraction(rate: Fraction) -> Fraction:
    """The rate of charging [% per slot] as rules and planner compute with it.

    It is exact for numbers of at most eleven decimals.
    """
    return rate.limit_denominator(_MOST_SLOTS)


@for_sections
def _is_fractional(mission):
    """Whether what a charging slot adds is not whole."""
    return mission.charge_slots > 1


@for_sections
def own_limit(mission, u):
    """The battery [%] at which a UAV is charged if its type has one of its own, or 0."""
    return np.int64(u.charge_complete)


@inlined
def charge_limit(mission, u):
    """The battery [%] at which a UAV is charged: that of its type, or C_C of the mission."""
    limit = own_limit(mission, u)
    if limit > 0:
        return limit
    return mission.charge_complete


@for_sections
def limit_battery(mission, u):
    """Let the battery of a UAV be no more than its type holds, and charge to no more than C_C."""
    if u.charge_complete > 0:
        u.battery = min(u.battery, u.charge_complete)
        u.charge_complete = min(u.charge_complete, mission.charge_complete)


@for_sections
def _has_own_rate(mission, u):
    """Whether the type of a UAV has a rate of charging of its own."""
    return u.charge_rate > 0


@inlined
def charged_after(mission, u, k):
    """The battery [%] that the first ``k`` slots of a charge add: ``floor(k g)`` at a rate g.

    The rate, that of the UAV's type or of the mission, is a fraction of integers, so it is exact.
    """
    if _has_own_rate(mission, u):
        return k * u.charge_rate // u.rate_slots
    if _is_fractional(mission):
        return k * mission.charge_rate // mission.charge_slots
    return k * mission.charge_rate


@inlined
def gain(mission, u, k):
    """The battery [%] that slot ``k`` = 1, 2, ... of a charge of a UAV adds."""
    return charged_after(mission, u, k) - charged_after(mission, u, k - 1)


@inlined
def slots_to_charge(mission, u, lacking, begun=0):
    """The least number of further slots in which a charge adds so much battery [%].

    Args:
        mission: ``MISSION`` record.
        u: The UAV that is charged: a record with the rate of its type.
        lacking: What is to be added [%].
        begun: The slots of the charge until now; 0 for one that begins.
    """
    if _has_own_rate(mission, u):
        added = charged_after(mission, u, begun) + lacking
        return -(-added * u.rate_slots // u.charge_rate) - begun
    if _is_fractional(mission):
        added = charged_after(mission, u, begun) + lacking
        return -(-added * mission.charge_slots // mission.charge_rate) - begun
    return (lacking + mission.charge_rate - 1) // mission.charge_rate


@inlined
def longest_charge(mission, uavs):
    """The slots in which any UAV of a mission is charged from C_S on."""
    if not _has_types(mission):
        return slots_to_charge(mission, uavs[0], mission.charge_complete - mission.charge_start)
    return _longest_charge_of_types(mission, uavs)


@for_sections
def _has_types(mission):
    """Whether the types of UAVs may have batteries and rates of their own."""
    return True


@for_sections
def _longest_charge_of_types(mission, uavs):
    longest = np.int64(0)
    for i in range(mission.uavs):
        lacking = charge_limit(mission, uavs[i]) - mission.charge_start
        longest = max(longest, slots_to_charge(mission, uavs[i], lacking))
    return longest


@for_sections
def share_power(mission, uavs):
    """Charge the UAVs on the pads if the power is limited; return whether it is."""
    if mission.power > 0:
        for zone in range(mission.zones):
            _share_power(mission, uavs, zone)
    return mission.power > 0


@shared_kernel
def _share_power(mission, uavs, zone):
    """Charge the UAVs on the pads of a zone with its limited power, one after the other.

    Each takes what it can take (``gain``, up to ``charge_limit``) of what is left.
    """
    left = mission.power
    charged = np.zeros(len(uavs), np.bool_)
    while left > 0:
        first = -1
        for i in range(mission.uavs):
            waits = uavs[i].charging and uavs[i].zone == zone and not charged[i]
            if waits and (first < 0 or is_before(mission, uavs[i], uavs[first])):
                first = i
        if first < 0:
            return
        u = uavs[first]
        lacking = charge_limit(mission, u) - u.battery
        added = min(gain(mission, u, u.charge_slots + 1), lacking, left)
        u.battery += added
        u.charged += added
        left -= added
        charged[first] = True


@kernel
def write_use(mission, uavs, out):
    """Write how the pads were used into an ``OPERATIONS`` record.

    A UAV waits in a slot if it has asked for a pad and has none. The number of waiting UAVs changes
    at the starts of slots only, so that the means over time are exact.
    """
    waited = charged = 0
    for i in range(mission.uavs):
        waited += uavs[i].slots_waiting
        charged += uavs[i].slots_charging
    out.pad_requests = mission.pad_requests
    out.queue = waited / mission.slot
    out.waiting = waited / mission.pad_requests if mission.pad_requests > 0 else np.nan
    out.utilisation = charged / (mission.pads * mission.slot)
