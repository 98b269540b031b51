"""The plan of charging pads: which zone each UAV flies to, and until when it may stay away.

A pad charges one UAV after another, and those who wait for it lose battery. So where a zone has
fewer pads than UAVs, the guard plans who is charged when. The plan depends on the state of the
mission alone, so all teammates have the same one. For every UAV that must charge it is known

- when it can ask for a pad: in the slot in which it can be there, but not before its battery is at
  C_S (``asks``), and
- when it must begin to charge at the latest, or its battery will be empty (``deadline``).

A UAV whose battery does not last to any zone has no turn, so that no teammate makes room for it.

A zone grants its pads in the order in which UAVs ask. Played forward, this tells when each begins
to charge (``_serve``). Each slot that a UAV lacks is a price, and a small one is each slot that it
has not to spare. If the usual order has a price, UAVs may give way: who would be without battery
first is charged before others that are there, or even before others that come earlier.

Every UAV begins with the zone of its cheapest way. While the plan has a price and some UAV would
lower it in another zone, the UAV flies there that lowers it most (``_choose_zones``).

At last the plan is followed backwards (``_latest``): a UAV must begin so early that the next on its
pad is charged in time, too, and so must that one for those after it. The slots between this and the
end of its battery are what the guard keeps.
"""

from typing import NamedTuple

import numpy as np

from dess.base.kernels import inlined, shared_kernel
from dess.model.guard.battery import must_charge
from dess.model.guard.ways import battery_of_way, is_tight
from dess.model.state import HOVER
from dess.physics.charging import charge_limit, is_before, slots_to_charge
from dess.physics.chart import distance
from dess.physics.energy import PERCENT, max_slot_cost, slot_cost, thousandths_left, waiting_slot
from dess.physics.failures import working_pads
from dess.physics.landing import lands
from dess.physics.section import for_sections
from dess.scenario.fields import MOST_ZONES

# The price of a slot that a UAV lacks; one that it has not to spare, of so many, costs 1.
LACKING, SPARE = 64, 4
# The slots that a UAV keeps for delays of those who are charged before it.
KEPT = 2
# The price of a UAV without a cell in a zone, which waits outside for its turn: less than that of a
# UAV that has no slot to spare. And the slots in which a UAV leaves its cell and the next takes it.
OUTSIDE, CHANGE = 3, 2

# The orders in which a zone may charge the UAVs that come to it: as they ask; of those that wait,
# the one with the earliest deadline; by their deadlines, though a pad is idle until one comes.
_AS_ASKED, _URGENT_FIRST, _BY_DEADLINE = range(3)


# The turn of one UAV at a pad. Slots are counted from now.
TURN = np.dtype(
    [
        ("zone", np.int64),  # the zone where it will charge, -1 if it need not
        # The number of its cell in a full zone, else -1 (``dess.model.guard.matching``).
        ("cell", np.int64),
        # Whether it may have to leave the zone cell where it is, in which all UAVs have no room.
        ("leaves", np.int64),
        # The slots to the nearest cell of each zone, and the battery that this takes.
        ("way", np.int64, MOST_ZONES),
        ("spent", np.int64, MOST_ZONES),
        ("asks", np.int64),  # when it can ask for a pad, before now if it has asked
        ("deadline", np.int64),  # when it must begin to charge at the latest
        ("begins", np.int64),  # when it begins, -1 if it is charging or has not been planned yet
        ("pad", np.int64),  # the pad of its zone that it is given, -1 if it has not been planned
        # Not of the UAV, but of the pad with its number: when this is free.
        ("free", np.int64),
    ]
)

# The queue of one zone.
QUEUE = np.dtype(
    [
        ("order", np.int64),  # in which it charges UAVs
        ("price", np.int64),  # what its plan costs
        # The slots between two UAVs on a pad, if not all have a cell and the next waits outside.
        ("change", np.int64),
        ("is_full", np.int64),  # whether each of its cells is taken (``dess.model.guard.matching``)
    ]
)


class Plan(NamedTuple):
    """Working memory of ``plan_pads``, and its plan.

    Attributes:
        turns: (I,) ``TURN`` records.
        queues: (Z,) ``QUEUE`` records.
    """

    turns: np.ndarray
    queues: np.ndarray


@inlined
def forget_plan(mission, plan):
    """Let the plan tell nothing of any UAV."""
    for j in range(mission.uavs):
        plan.turns[j].zone = plan.turns[j].cell = -1
        plan.turns[j].leaves = 0


@inlined
def waits_in_zone(mission, u):
    """Whether a UAV hovers in a zone with few pads, where it waits until it may ask for one.

    It rarely moves on, so only its own cell is closed to teammates, and no cell beside it.
    """
    if not u.active or u.zone < 0 or u.executed != HOVER or u.overruled or lands(mission):
        return False
    return mission.plans_waits and mission.uavs > mission.zone_pads[u.zone]


@inlined
def may_wait(mission, uavs, data):
    """Whether some UAV may have to wait for a pad: fewer work in a zone than UAVs must charge.

    Waits on the ground cost no battery, and need no plan.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        data: Residual data of all nodes together [data units].
    """
    if lands(mission) or mission.flight_cost == 0:
        return False
    if not mission.plans_waits and mission.pad_rate == 0.0:
        return False
    fewest = mission.uavs
    for zone in range(mission.zones):
        fewest = min(fewest, working_pads(mission, zone))
    if fewest == mission.uavs:
        return False
    count = 0
    for j in range(mission.uavs):
        count += needs_pad(mission, uavs[j], data)
    return count > fewest


@inlined
def needs_pad(mission, u, data):
    """Whether a UAV charges, has asked for a pad, or will have to."""
    return u.active and not u.grounded and (u.pad_request >= 0 or must_charge(mission, u, data))


@for_sections
def is_given_up(mission, zone):
    """Whether no pad of one of several zones will ever work again."""
    never = mission.pad_rate > 0.0 and mission.zone_pad_repair[zone] == 0.0
    return mission.zones > 1 and never and working_pads(mission, zone) == 0


@shared_kernel
def plan_pads(mission, uavs, i, data, chart, plan, reach):
    """Plan where and when all UAVs charge that must; see the text of the module.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV that asks.
        data: Residual data of all nodes together [data units].
        chart: ``Chart``.
        plan: ``Plan``; the plan is written into it.
        reach: ``Ways.reach``.

    Returns:
        The slots of its battery that UAV ``i`` must keep for waits; in how many slots it begins to
        charge; and 1 if it must not ask for a pad in this slot, else 0.
    """
    for j in range(mission.uavs):
        u, turn = uavs[j], plan.turns[j]
        turn.zone = -1
        if not needs_pad(mission, u, data):
            continue
        if u.pad_request >= 0:
            turn.zone = u.zone
            turn.way[u.zone] = 0
            turn.spent[u.zone] = 0
        else:
            find_ways(mission, u, turn, chart, reach)
            if thousandths_left(u) - turn.spent[turn.zone] < waiting_slot(mission):
                turn.zone = -1
    _choose_zones(mission, uavs, chart, plan)
    for j in range(mission.uavs):
        plan.turns[j].leaves = is_tight(mission, chart.sizes) and _may_leave(uavs[j], j, plan)
    zone = plan.turns[i].zone
    if zone < 0 or uavs[i].pad_request >= 0:
        return np.int64(0), np.int64(0), np.int64(0)
    _serve(mission, uavs, zone, plan.queues[zone].order, plan)
    kept = plan.turns[i].deadline - _latest(mission, uavs, i, plan)
    # It can ask no earlier than at C_S.
    kept = max(min(kept, _slots_of_percent(mission, mission.charge_start) - 1), 0)
    gives_way = np.int64(_gives_way(mission, uavs, i, plan))
    return np.int64(kept), plan.turns[i].begins, gives_way


@inlined
def _may_leave(u, j, plan):
    """Whether a UAV in a zone charges in another one, or in turn with UAVs that have no cell."""
    if u.zone < 0 or u.charging or u.pad_request >= 0 or u.grounded:
        return False
    return u.zone != plan.turns[j].zone or plan.queues[u.zone].change > 0


@inlined
def _slots_of(mission, battery):
    """The slots that a battery lasts for a UAV that waits in the air."""
    return battery // waiting_slot(mission)


@inlined
def _slots_of_percent(mission, percent):
    """The slots that so many percent of a battery last for a UAV that waits in the air."""
    return PERCENT * percent // waiting_slot(mission)


@inlined
def _slots_to_charge_start(mission, battery):
    """The slots in which a UAV that hovers spends so much battery that it may charge."""
    more = max(battery - PERCENT * mission.charge_start, 0)
    hovering = slot_cost(mission, 1, HOVER)
    return (more + hovering - 1) // hovering


@inlined
def find_ways(mission, u, turn, chart, reach):
    """Write the ways of a UAV to all zones, and choose the one that takes the least battery."""
    for zone in range(mission.zones):
        turn.spent[zone] = -1
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        zone = np.int64(chart.zones[y, x])
        cells = distance(chart, u.x, u.y, x, y)
        spent = battery_of_way(mission, u, chart, u.x, u.y, x, y, cells, reach)
        spent += u.slots_left * max_slot_cost(mission)
        slots = cells * u.slots_per_cell + u.slots_left
        least = turn.spent[zone]
        if least < 0 or spent < least or (spent == least and slots < turn.way[zone]):
            turn.spent[zone] = spent
            turn.way[zone] = slots
    turn.zone = 0
    for zone in range(1, mission.zones):
        if turn.spent[zone] < turn.spent[turn.zone]:
            turn.zone = zone


@inlined
def _choose_zones(mission, uavs, chart, plan):
    """Let UAVs fly to other zones than those of their cheapest ways while this lowers the price."""
    total = 0
    for zone in range(mission.zones):
        plan.queues[zone].price = _price(mission, uavs, chart, zone, plan)
        total += plan.queues[zone].price
    while total > 0 and mission.zones > 1:
        who, where, least, farther = -1, -1, total, 0
        for j in range(mission.uavs):
            now = plan.turns[j].zone
            if now < 0 or uavs[j].pad_request >= 0 or plan.queues[now].price == 0:
                continue
            for zone in range(mission.zones):
                if zone == now:
                    continue
                plan.turns[j].zone = zone
                price = total - plan.queues[now].price - plan.queues[zone].price
                price += _price(mission, uavs, chart, now, plan)
                price += _price(mission, uavs, chart, zone, plan)
                more = plan.turns[j].spent[zone] - plan.turns[j].spent[now]
                if price < least or (price == least and who >= 0 and more < farther):
                    who, where, least, farther = j, zone, price, more
                plan.turns[j].zone = now
        if who < 0:
            break
        left = plan.turns[who].zone
        plan.turns[who].zone, total = where, least
        plan.queues[left].price = _price(mission, uavs, chart, left, plan)
        plan.queues[where].price = _price(mission, uavs, chart, where, plan)
    for zone in range(mission.zones):
        _price(mission, uavs, chart, zone, plan)


@shared_kernel
def _price(mission, uavs, chart, zone, plan):
    """The price of the best order in which a zone can charge its UAVs, which is written down."""
    count, asked = 0, True
    for j in range(mission.uavs):
        u, turn = uavs[j], plan.turns[j]
        if turn.zone != zone:
            continue
        count += 1
        way, spent = turn.way[zone], turn.spent[zone]
        turn.deadline = way + _slots_of(mission, thousandths_left(u) - spent) - 1
        if u.pad_request >= 0:
            turn.asks = u.pad_request - mission.slot
            continue
        asked = False
        turn.asks = way
        if not u.latch:
            turn.asks += _slots_to_charge_start(mission, thousandths_left(u) - spent)
    plan.queues[zone].order = _AS_ASKED
    plan.queues[zone].change = CHANGE if count > chart.sizes[zone] else 0
    least = _serve(mission, uavs, zone, _AS_ASKED, plan)
    if asked or count < 2:
        return least
    for order in (_URGENT_FIRST, _BY_DEADLINE):
        if least >= LACKING:
            price = _serve(mission, uavs, zone, order, plan)
            if price < least:
                least, plan.queues[zone].order = price, order
    return least + OUTSIDE * max(count - chart.sizes[zone], 0)


@shared_kernel
def _serve(mission, uavs, zone, order, plan):
    """Play the queue of a zone forward in an order; the price is returned."""
    pads = min(working_pads(mission, zone), mission.uavs)
    left = busy = 0
    for j in range(mission.uavs):
        if plan.turns[j].zone != zone:
            continue
        plan.turns[j].begins, plan.turns[j].pad = -1, -1
        if uavs[j].charging and busy < pads:
            plan.turns[busy].free = _charging_time(mission, uavs[j], zone, uavs[j].battery)
            plan.turns[busy].free += plan.queues[zone].change
            plan.turns[j].pad = busy
            busy += 1
        else:
            left += 1
    for pad in range(busy, pads):
        plan.turns[pad].free = 0
    price = 0
    while left > 0:
        pad = -1
        for other in range(pads):
            if pad < 0 or plan.turns[other].free < plan.turns[pad].free:
                pad = other
        free = plan.turns[pad].free if pad >= 0 else mission.max_slots
        j = _next(mission, uavs, zone, order, free, plan)
        begins = max(plan.turns[j].asks, free)
        plan.turns[j].begins, plan.turns[j].pad = begins, pad
        if pad >= 0:
            plan.turns[pad].free = begins + _time_on_pad(mission, uavs, j, begins, plan)
            plan.turns[pad].free += plan.queues[zone].change
        lacks = begins - plan.turns[j].deadline
        price += LACKING * max(lacks, 0) + max(lacks + SPARE, 0)
        left -= 1
    return price


@inlined
def _next(mission, uavs, zone, order, free, plan):
    """The UAV that a zone charges next, when a pad is free at so many slots from now."""
    soonest = mission.max_slots + free
    for j in range(mission.uavs):
        if _is_planned(uavs, j, zone, plan):
            soonest = min(soonest, plan.turns[j].asks)
    soonest = max(soonest, free)
    best = -1
    for j in range(mission.uavs):
        if not _is_planned(uavs, j, zone, plan):
            continue
        if best < 0 or _is_next(mission, uavs, j, best, order, soonest, plan):
            best = j
    return best


@inlined
def _is_planned(uavs, j, zone, plan):
    """Whether UAV ``j`` waits in the plan of a zone for its turn."""
    return plan.turns[j].zone == zone and plan.turns[j].begins < 0 and plan.turns[j].pad < 0


@inlined
def _is_next(mission, uavs, j, other, order, time, plan):
    """Whether UAV ``j`` is charged before another by an order, if a pad is free at this time."""
    if uavs[j].pad_request >= 0 and uavs[other].pad_request >= 0:
        return is_before(mission, uavs[j], uavs[other])
    if uavs[j].pad_request >= 0 or uavs[other].pad_request >= 0:
        return uavs[j].pad_request >= 0
    if order != _BY_DEADLINE:
        is_there, other_is_there = plan.turns[j].asks <= time, plan.turns[other].asks <= time
        if is_there != other_is_there:
            return is_there
        if not is_there or (order == _AS_ASKED and not mission.lowest_battery_first):
            return plan.turns[j].asks < plan.turns[other].asks
    return plan.turns[j].deadline < plan.turns[other].deadline


@inlined
def _time_on_pad(mission, uavs, j, begins, plan):
    """The slots for which UAV ``j`` charges if it begins so many slots from now."""
    empty = plan.turns[j].deadline + 1 - begins  # the slots that are left of its battery then
    percent = max(empty, 0) * waiting_slot(mission) // PERCENT
    return _charging_time(mission, uavs[j], plan.turns[j].zone, percent)


@inlined
def _charging_time(mission, u, zone, battery):
    """The slots for which a UAV charges, or goes on charging, from a battery [%]."""
    lacking = charge_limit(mission, u) - battery
    slots = slots_to_charge(mission, u, lacking, u.charge_slots if u.charging else 0)
    if mission.power > 0:
        share = max(mission.power // max(working_pads(mission, zone), 1), 1)
        slots = max(slots, (lacking + share - 1) // share)
    return slots


@inlined
def _latest(mission, uavs, i, plan):
    """When UAV ``i`` must begin to charge, so that it and those after it on its pad are in time."""
    latest = plan.turns[i].deadline - KEPT
    before, charging = i, 0
    while True:
        following = _following(mission, before, plan)
        if following < 0:
            return latest
        charging += _time_on_pad(mission, uavs, before, plan.turns[before].begins, plan)
        charging += plan.queues[plan.turns[i].zone].change
        latest = min(latest, plan.turns[following].deadline - KEPT - charging)
        before = following


@inlined
def _following(mission, j, plan):
    """The UAV that the plan charges after UAV ``j`` on the same pad, or -1."""
    best = -1
    for other in range(mission.uavs):
        turn, earlier = plan.turns[other], plan.turns[j]
        is_later = turn.begins > earlier.begins
        if turn.zone != earlier.zone or turn.pad != earlier.pad:
            continue
        if is_later and (best < 0 or plan.turns[other].begins < plan.turns[best].begins):
            best = other
    return best


@inlined
def _gives_way(mission, uavs, i, plan):
    """Whether UAV ``i`` must not ask now: a UAV that the plan has before it would come after it."""
    zone = plan.turns[i].zone
    takes_turns = plan.queues[zone].change > 0  # one that does not leave its cell keeps others out
    is_asking = plan.queues[zone].order != _AS_ASKED and plan.turns[i].asks <= 0
    if uavs[i].zone != zone or not (takes_turns or is_asking):
        return False
    for j in range(mission.uavs):
        begins_first = plan.turns[j].zone == zone and plan.turns[j].begins < plan.turns[i].begins
        has_asked = uavs[j].pad_request >= 0
        asks_after = plan.turns[j].asks > 0 or (j > i and not mission.lowest_battery_first)
        if begins_first and (asks_after or takes_turns) and not has_asked:
            return True
    return False
