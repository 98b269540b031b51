"""Whether the battery of a UAV lasts until its quota is filled, and the margins that are kept.

The guard counts batteries in thousandths of a percent (``dess.physics.energy``). Where slots take
anything else than one percent each, the battery is no time any more, so that both must last: the
battery for the cheapest way home, and the slots that are left for the shortest one. A slot of
waiting counts as ``waiting_slot``; a slot of a margin counts half of the most that a way forth and
back takes, since a detour is one.
"""

import math

from dess.base.kernels import inlined
from dess.model.state import EAST, HOVER, NORTH, SOUTH, WEST
from dess.physics.charging import own_limit
from dess.physics.energy import (
    PERCENT,
    has_costs,
    max_slot_cost,
    slot_cost,
    thousandths_left,
    waiting_slot,
)
from dess.physics.failures import working_pads
from dess.physics.landing import flies, lands
from dess.physics.radio import has_limit
from dess.physics.section import for_sections

# Margin [cells] on the way to the zone per active teammate, since each may cause a detour.
MARGIN_PER_TEAMMATE = 2
# Data [data units] that a UAV collects in a slot near an average node, and the communication slots
# that each UAV can fill with a data unit that arrives at an empty sea.
MEAN_RATE, SLOTS_PER_PACKET = 0.3, 1.0
# The same [data units] of UAVs that collect the last data of a sea together.
LARGE_RATE = 0.6
# Margin [slots] for the quota when little data is left, as some slots may find no data to collect.
SCARCE_SLOTS = 6
# In missions that end on the ground, UAVs fly around those that stand, and batteries differ, so
# that few UAVs come home together. There a UAV with teammates keeps the margin of one of them,
# ``MARGIN_LANDING`` [slots] more, and a cell for every second teammate; in a large fleet, where
# more of them come together, for each but ``FEW_TEAMMATES``.
MARGIN_LANDING = 3
FEW_TEAMMATES = 2
# Slots before the end of a mission without a quota in which UAVs do not leave a zone any more.
LAST_SLOTS = 16


@inlined
def slots_needed(mission, u):
    """Flying slots until the quota of UAV ``u`` is filled, if it collects data in all of them."""
    m = mission.communication_slots
    return (u.quota - u.communications + m - 1) // m


@inlined
def slots_expected(mission, u, data):
    """Flying slots until the quota of UAV ``u`` is filled, as far as data are there for it.

    A UAV collects some ``MEAN_RATE`` data units in a slot. Once the residual data are collected,
    it may count on ``SLOTS_PER_PACKET`` communication slots for each data unit that arrives. Where
    slots without service do not count, it cannot tell, and expects to fly to the end.

    Args:
        mission: ``MISSION`` record.
        u: ``UAV`` record.
        data: Residual data of all nodes together [data units].
    """
    needed = slots_needed(mission, u)
    if has_limit(mission):
        return mission.max_slots
    rate = _rate(mission, u)
    if data >= rate * needed:
        return needed
    served = data / rate
    arriving = SLOTS_PER_PACKET * mission.arrival_rate * mission.nodes
    share = min(arriving / mission.communication_slots, 1.0)
    if (needed - served) >= share * mission.max_slots:
        return mission.max_slots
    return int(math.ceil(served + (needed - served) / share)) + SCARCE_SLOTS


@inlined
def _rate(mission, u):
    """The data units that all UAVs together may collect in a slot.

    At or below C_S, a UAV that waits for data in vain may not come home any more. So there it
    expects that the UAVs collect as fast as until now, up to ``LARGE_RATE`` each.
    """
    rate = MEAN_RATE * mission.active
    if not u.latch:
        return rate
    before = mission.collected / max(mission.slot, 1)
    return min(max(rate, before), LARGE_RATE * mission.active)


@inlined
def must_charge(mission, u, data):
    """Whether UAV ``u`` cannot fill its quota with its battery and must charge first.

    Every slot until then may cost the most. If little data is left, a communication slot
    may find no node to serve, so a margin is added. Where flying costs no battery, or no pad will
    ever work again, no UAV must charge. In a mission that ends on the ground, every UAV must keep
    a zone within reach.

    Args:
        mission: ``MISSION`` record.
        u: ``UAV`` record.
        data: Residual data of all nodes together [data units].
    """
    if lands(mission):
        return True
    needed = slots_expected(mission, u, data)
    if mission.pad_rate > 0.0 and mission.pad_repair == 0.0 and _all_pads(mission) == 0:
        return False
    # A UAV that lives until the mission is truncated is not lost.
    needed = min(needed, mission.max_slots - mission.slot + 1)
    return thousandths_left(u) < mission.flight_cost * max_slot_cost(mission) * needed


@inlined
def will_charge(mission, u):
    """Whether a UAV in the air cannot fill its quota with its battery, or has to land."""
    least = waiting_slot(mission) * slots_needed(mission, u)
    needs = thousandths_left(u) < mission.flight_cost * least
    return flies(u) and (needs or lands(mission) or has_limit(mission))


@inlined
def usable_battery(mission, u):
    """The battery that UAV ``u`` may spend in the air at most [% / 1000].

    Where a slot takes one percent, the battery is a time: if missions end on the ground, no more
    than to the end of the mission. Elsewhere see ``late_slots``.
    """
    if not lands(mission):
        return thousandths_left(u)
    most = (mission.max_slots - mission.slot) * waiting_slot(mission)
    if mission.flight_cost == 0:
        return most
    if has_costs(mission):
        return thousandths_left(u)
    return min(thousandths_left(u), most)


@inlined
def late_slots(mission, slots):
    """By how many slots a UAV comes too late that is on the ground in so many slots.

    Only a mission that ends on the ground has such an end; where a slot takes one percent of the
    battery, ``usable_battery`` has it.
    """
    if has_costs(mission) and lands(mission):
        return max(slots - (mission.max_slots - mission.slot), 0)
    return 0


@inlined
def _all_pads(mission):
    """The working pads of all zones together."""
    pads = 0
    for zone in range(mission.zones):
        pads += working_pads(mission, zone)
    return pads


@inlined
def ends_soon(mission, u):
    """Whether UAV ``u`` does not leave a zone any more, as it has to be on the ground soon."""
    return lands(mission) and u.quota == 0 and mission.max_slots - mission.slot <= LAST_SLOTS


@for_sections
def cannot_leave(mission, u):
    """Whether a UAV on the ground could not leave its zone and keep its margins.

    Only types of UAVs that are slow or have small batteries can be in this state when they are
    fully charged: they stay where they stand.
    """
    if not has_costs(mission) or mission.flight_cost == 0:
        return False
    if own_limit(mission, u) == 0 and u.slots_per_cell == 1:
        return False
    slots = margin_slots(mission, u) + 2 * u.slots_per_cell + 1
    return thousandths_left(u) <= waiting_slot(mission) * slots


@inlined
def margin(mission, u):
    """The battery that UAV ``u`` keeps on its way to the zone for detours around teammates."""
    return _slot_of_detour(mission, u) * margin_slots(mission, u)


@inlined
def _slot_of_detour(mission, u):
    """The battery for a slot of a detour, which goes forth and back, or of waiting [% / 1000]."""
    if not has_costs(mission):
        return PERCENT
    if mission.gusts > 0.0:  # the gusts of two cells are hardly ever both the strongest
        return (PERCENT + max_slot_cost(mission) + 1) // 2
    slots = u.slots_per_cell
    across = slot_cost(mission, slots, NORTH) + slot_cost(mission, slots, SOUTH)
    along = slot_cost(mission, slots, EAST) + slot_cost(mission, slots, WEST)
    return max((max(across, along) + 1) // 2, slot_cost(mission, slots, HOVER))


@inlined
def margin_slots(mission, u):
    """The slots that UAV ``u`` keeps for detours around teammates."""
    teammates = mission.active - 1
    for_each = MARGIN_PER_TEAMMATE * u.slots_per_cell
    if not lands(mission):
        return teammates * for_each
    if teammates == 0:
        return 0
    cells = max(teammates // 2, teammates - FEW_TEAMMATES)
    return for_each + MARGIN_LANDING + cells * u.slots_per_cell
