"""Missions that end on the ground: where a UAV stands, and when it has landed.

A UAV that hovers on a zone cell stands: it spends nothing and serves no node.
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
def has_filled(u):
    """Whether a UAV has a quota, and has filled it."""
    return u.quota > 0 and u.communications >= u.quota


@inlined
def has_landed(mission, u):
    """Whether a UAV has landed with the present slot, which ``mission.slot`` counts already.

    A UAV that has filled its quota lands where it stands. One without a quota works to the last
    slot of the mission, and must be on the ground then.
    """
    if not (u.charging or stands(mission, u)):
        return False
    return has_filled(u) or (u.quota == 0 and mission.slot >= mission.max_slots)


@for_sections
def waits_for_horizon(mission):
    """Whether a mission without a quota goes on, since its last slot has not been reached."""
    return mission.quota == 0 and mission.slot < mission.max_slots


@inlined
def is_over(mission):
    """Whether a mission is over: no UAV is active, and without a quota the horizon is reached."""
    return mission.active == 0 and not waits_for_horizon(mission)
