"""Missions that end on the ground: where a UAV stands, and when it has landed.

A UAV that hovers on a zone cell stands: it spends nothing and serves no node. The rules that take
numbers in place of a UAV are those of the planner as well, whose UAVs are other records.
"""

from dess.base.kernels import inlined
from dess.physics.section import for_sections


@for_sections
def lands(mission):
    """Whether the mission ends on the ground."""
    return mission.landing


@inlined
def flies(u):
    """Whether a UAV is active, and neither charges nor is grounded."""
    return u.active and not u.charging and not u.grounded


@inlined
def stands(mission, u):
    """Whether a UAV stands on the ground in this slot, on no pad."""
    return lands(mission) and flies(u) and u.zone >= 0 and u.x == u.from_x and u.y == u.from_y


@inlined
def has_filled(quota, communications):
    """Whether a UAV has a quota, and has filled it."""
    return quota > 0 and communications >= quota


@inlined
def has_finished(mission, slots, is_on_ground, quota, communications):
    """Whether a UAV has done its work with the present slot.

    In missions that end on the ground it has landed then: with a filled quota where it stands or
    charges; without a quota it works to the last slot of the mission, and must be on the ground.

    Args:
        mission: ``MISSION`` record.
        slots: The slots of the mission so far, the present one included.
        is_on_ground: Whether the UAV stands or charges.
        quota: Its quota [communication slots].
        communications: The communication slots that it has filled.
    """
    if not lands(mission):
        return communications >= quota
    if not is_on_ground:
        return False
    return has_filled(quota, communications) or (quota == 0 and slots >= mission.max_slots)


@inlined
def next_latch(mission, latch, complete, battery, quota, communications):
    """The charging latch iota (eq. 3) by the battery at the start of a slot.

    In missions that end on the ground, every UAV may charge that is not charged and has not filled
    its quota.

    Args:
        mission: ``MISSION`` record.
        latch: The latch in the slot before.
        complete: The battery at which the UAV is charged [%].
        battery: The battery [%].
        quota: The quota of the UAV [communication slots].
        communications: The communication slots that it has filled.
    """
    if lands(mission):
        return battery < complete and not has_filled(quota, communications)
    if battery >= complete:
        return False
    return battery <= mission.charge_start or latch != 0


@for_sections
def waits_for_horizon(mission):
    """Whether a mission without a quota goes on, since its last slot has not been reached."""
    return mission.quota == 0 and mission.slot < mission.max_slots


@inlined
def is_over(mission):
    """Whether a mission is over: no UAV is active, and without a quota the horizon is reached."""
    return mission.active == 0 and not waits_for_horizon(mission)
