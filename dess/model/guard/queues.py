"""The plan of charging pads: which zone each UAV flies to, and until when it may stay away.

A pad charges one UAV after another, and those who wait for it lose battery. So where a zone has
fewer pads than UAVs, the guard plans who is charged when. The plan depends on the state of the
mission alone, so all teammates have the same one. For every UAV that must charge it is known

- when it can ask for a pad: in the slot in which it can be there, but not before its battery is at
  C_S (``asks``), and
- when it must begin to charge at the latest, or its battery will be empty (``deadline``).

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

from dess.base.kernels import inlined, kernel
from dess.model.guard.battery import must_charge
from dess.model.guard.ways import battery_of_way
from dess.model.state import HOVER
from dess.physics.charging import is_before, slots_to_charge
from dess.physics.chart import distance
from dess.physics.failures import working_pads
from dess.physics.landing import lands
from dess.scenario.fields import MOST_ZONES

# The price of a slot that a UAV lacks; one that it has not to spare, of so many, costs 1.
LACKING, SPARE = 64, 4
# The slots that a UAV keeps for delays of those who are charged before it.
KEPT = 2

# The orders in which a zone may charge the UAVs that come to it: as they ask; of those that wait,
# the one with the earliest deadline; by their deadlines, though a pad is idle until one comes.
_AS_ASKED, _URGENT_FIRST, _BY_DEADLINE = range(3)


class Queues(NamedTuple):
    """Working memory of ``plan_pads``, and the plan. Slots are counted from now.

    Attributes:
        zone: (I,) the zone where a UAV will charge, -1 if it need not.
        way: (Z, I) the slots to the nearest cell of a zone.
        spent: (Z, I) the battery that this takes [%].
        asks: (I,) when a UAV can ask for a pad; before now if it has asked.
        deadline: (I,) when it must begin to charge at the latest.
        begins: (I,) when it begins to charge; -1 if it is charging, or waits to be planned.
        pad: (I,) the pad of its zone that it is given.
        free: (I,) when each pad of the zone in question is free.
        order: (Z,) the order in which each zone charges UAVs.
        price: (Z,) the price of each zone's plan.
    """

    zone: np.ndarray
    way: np.ndarray
    spent: np.ndarray
    asks: np.ndarray
    deadline: np.ndarray
    begins: np.ndarray
    pad: np.ndarray
    free: np.ndarray
    order: np.ndarray
    price: np.ndarray


@kernel
def queue_memory(uavs):
    """Working memory for missions with so many UAVs."""
    return Queues(
        np.empty(uavs, np.int64),
        np.empty((MOST_ZONES, uavs), np.int64),
        np.empty((MOST_ZONES, uavs), np.int64),
        np.empty(uavs, np.int64),
        np.empty(uavs, np.int64),
        np.empty(uavs, np.int64),
        np.empty(uavs, np.int64),
        np.empty(uavs, np.int64),
        np.empty(MOST_ZONES, np.int64),
        np.empty(MOST_ZONES, np.int64),
    )


@inlined
def waits_in_zone(mission, u):
    """Whether a UAV hovers in a zone with few pads, where it waits until it may ask for one.

    It hardly ever moves on, so it keeps its cell, and nobody out of the cells beside it.
    """
    if not u.active or u.zone < 0 or u.executed != HOVER or lands(mission):
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
    count = 0
    for j in range(mission.uavs):
        count += _needs_pad(mission, uavs[j], data)
    return count > fewest


@inlined
def _needs_pad(mission, u, data):
    """Whether a UAV charges, has asked for a pad, or will have to."""
    return u.active and not u.grounded and (u.pad_request >= 0 or must_charge(mission, u, data))


@kernel
def plan_pads(mission, uavs, i, data, chart, queues, reach):
    """Plan where and when all UAVs charge that must; see the text of the module.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV that asks.
        data: Residual data of all nodes together [data units].
        chart: ``Chart``.
        queues: ``queue_memory``; the plan is written into it.
        reach: The table of ``reach_of``.

    Returns:
        The slots of its battery that UAV ``i`` must keep for waits; in how many slots it begins to
        charge; and 1 if it must not ask for a pad in this slot, else 0.
    """
    for j in range(mission.uavs):
        queues.zone[j] = -1
        u = uavs[j]
        if not _needs_pad(mission, u, data):
            continue
        if u.pad_request >= 0:
            queues.zone[j], queues.way[u.zone, j], queues.spent[u.zone, j] = u.zone, 0, 0
        else:
            _find_ways(mission, u, j, chart, queues, reach)
    _choose_zones(mission, uavs, chart, queues)
    zone = queues.zone[i]
    if zone < 0 or uavs[i].pad_request >= 0:
        return np.int64(0), np.int64(0), np.int64(0)
    _serve(mission, uavs, zone, queues.order[zone], queues)
    kept = queues.deadline[i] - _latest(mission, uavs, i, queues)
    # It can ask no earlier than at C_S.
    kept = max(min(kept, mission.charge_start - 1), 0)
    gives_way = np.int64(_gives_way(mission, uavs, i, queues))
    return np.int64(kept), queues.begins[i], gives_way


@inlined
def _find_ways(mission, u, j, chart, queues, reach):
    """Write the ways of UAV ``j`` to all zones, and choose the one that takes the least battery."""
    for zone in range(mission.zones):
        queues.spent[zone, j] = -1
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        zone = np.int64(chart.zones[y, x])
        cells = distance(chart, u.x, u.y, x, y)
        spent = battery_of_way(mission, u, chart, u.x, u.y, x, y, cells, reach) + u.slots_left
        slots = cells * u.slots_per_cell + u.slots_left
        least, way = queues.spent[zone, j], queues.way[zone, j]
        if least < 0 or spent < least or (spent == least and slots < way):
            queues.spent[zone, j], queues.way[zone, j] = spent, slots
    best = 0
    for zone in range(1, mission.zones):
        if queues.spent[zone, j] < queues.spent[best, j]:
            best = zone
    queues.zone[j] = best


@inlined
def _choose_zones(mission, uavs, chart, queues):
    """Let UAVs fly to other zones than those of their cheapest ways while this lowers the price."""
    total = 0
    for zone in range(mission.zones):
        queues.price[zone] = _price(mission, uavs, chart, zone, queues)
        total += queues.price[zone]
    while total > 0 and mission.zones > 1:
        who, where, least, farther = -1, -1, total, 0
        for j in range(mission.uavs):
            now = queues.zone[j]
            if now < 0 or uavs[j].pad_request >= 0 or queues.price[now] == 0:
                continue
            for zone in range(mission.zones):
                if zone == now:
                    continue
                queues.zone[j] = zone
                price = total - queues.price[now] - queues.price[zone]
                price += _price(mission, uavs, chart, now, queues)
                price += _price(mission, uavs, chart, zone, queues)
                more = queues.spent[zone, j] - queues.spent[now, j]
                if price < least or (price == least and who >= 0 and more < farther):
                    who, where, least, farther = j, zone, price, more
                queues.zone[j] = now
        if who < 0:
            break
        left = queues.zone[who]
        queues.zone[who], total = where, least
        queues.price[left] = _price(mission, uavs, chart, left, queues)
        queues.price[where] = _price(mission, uavs, chart, where, queues)
    for zone in range(mission.zones):
        _price(mission, uavs, chart, zone, queues)


@kernel
def _price(mission, uavs, chart, zone, queues):
    """The price of the best order in which a zone can charge its UAVs, which is written down."""
    count, asked = 0, True
    for j in range(mission.uavs):
        if queues.zone[j] != zone:
            continue
        u = uavs[j]
        way, spent = queues.way[zone, j], queues.spent[zone, j]
        count += 1
        queues.deadline[j] = u.battery - 1 - (spent - way)
        if u.pad_request >= 0:
            queues.asks[j] = u.pad_request - mission.slot
            continue
        asked = False
        queues.asks[j] = way if u.latch else way + max(u.battery - spent - mission.charge_start, 0)
    queues.order[zone] = _AS_ASKED
    least = _serve(mission, uavs, zone, _AS_ASKED, queues)
    if asked or count < 2:
        return least
    for order in (_URGENT_FIRST, _BY_DEADLINE):
        if least >= LACKING:
            price = _serve(mission, uavs, zone, order, queues)
            if price < least:
                least, queues.order[zone] = price, order
    return least + LACKING * max(count - chart.sizes[zone], 0)


@inlined
def _serve(mission, uavs, zone, order, queues):
    """Play the queue of a zone forward in an order; the price is returned."""
    pads = min(working_pads(mission, zone), mission.uavs)
    left = busy = 0
    for j in range(mission.uavs):
        if queues.zone[j] != zone:
            continue
        queues.begins[j], queues.pad[j] = -1, -1
        if uavs[j].charging and busy < pads:
            queues.free[busy] = _charging_time(mission, uavs[j], zone, uavs[j].battery)
            queues.pad[j] = busy
            busy += 1
        else:
            left += 1
    for pad in range(busy, pads):
        queues.free[pad] = 0
    price = 0
    while left > 0:
        pad = -1
        for other in range(pads):
            if pad < 0 or queues.free[other] < queues.free[pad]:
                pad = other
        free = queues.free[pad] if pad >= 0 else mission.max_slots
        j = _next(mission, uavs, zone, order, free, queues)
        begins = max(queues.asks[j], free)
        queues.begins[j], queues.pad[j] = begins, pad
        if pad >= 0:
            queues.free[pad] = begins + _time_on_pad(mission, uavs, j, begins, queues)
        lacks = begins - queues.deadline[j]
        price += LACKING * max(lacks, 0) + max(lacks + SPARE, 0)
        left -= 1
    return price


@inlined
def _next(mission, uavs, zone, order, free, queues):
    """The UAV that a zone charges next, when a pad is free at so many slots from now."""
    soonest = mission.max_slots + free
    for j in range(mission.uavs):
        if _is_planned(uavs, j, zone, queues):
            soonest = min(soonest, queues.asks[j])
    soonest = max(soonest, free)
    best = -1
    for j in range(mission.uavs):
        if not _is_planned(uavs, j, zone, queues):
            continue
        if best < 0 or _is_next(mission, uavs, j, best, order, soonest, queues):
            best = j
    return best


@inlined
def _is_planned(uavs, j, zone, queues):
    """Whether UAV ``j`` waits in the plan of a zone for its turn."""
    return queues.zone[j] == zone and queues.begins[j] < 0 and queues.pad[j] < 0


@inlined
def _is_next(mission, uavs, j, other, order, time, queues):
    """Whether UAV ``j`` is charged before another by an order, if a pad is free at this time."""
    if uavs[j].pad_request >= 0 and uavs[other].pad_request >= 0:
        return is_before(mission, uavs[j], uavs[other])
    if uavs[j].pad_request >= 0 or uavs[other].pad_request >= 0:
        return uavs[j].pad_request >= 0
    if order != _BY_DEADLINE:
        is_there, other_is_there = queues.asks[j] <= time, queues.asks[other] <= time
        if is_there != other_is_there:
            return is_there
        if not is_there or (order == _AS_ASKED and not mission.lowest_battery_first):
            return queues.asks[j] < queues.asks[other]
    return queues.deadline[j] < queues.deadline[other]


@inlined
def _time_on_pad(mission, uavs, j, begins, queues):
    """The slots for which UAV ``j`` charges if it begins so many slots from now."""
    empty = queues.deadline[j] + 1 - begins  # what is left of its battery then
    return _charging_time(mission, uavs[j], queues.zone[j], max(empty, 0))


@inlined
def _charging_time(mission, u, zone, battery):
    """The slots for which a UAV charges, or goes on charging, from a battery [%]."""
    lacking = mission.charge_complete - battery
    slots = slots_to_charge(mission, lacking, u.charge_slots if u.charging else 0)
    if mission.power > 0:
        share = max(mission.power // max(working_pads(mission, zone), 1), 1)
        slots = max(slots, (lacking + share - 1) // share)
    return slots


@inlined
def _latest(mission, uavs, i, queues):
    """When UAV ``i`` must begin to charge, so that it and those after it on its pad are in time."""
    latest = queues.deadline[i] - KEPT
    before, charging = i, 0
    while True:
        following = _following(mission, before, queues)
        if following < 0:
            return latest
        charging += _time_on_pad(mission, uavs, before, queues.begins[before], queues)
        latest = min(latest, queues.deadline[following] - KEPT - charging)
        before = following


@inlined
def _following(mission, j, queues):
    """The UAV that the plan charges after UAV ``j`` on the same pad, or -1."""
    best = -1
    for other in range(mission.uavs):
        if other == j or queues.zone[other] != queues.zone[j] or queues.pad[other] != queues.pad[j]:
            continue
        is_later = queues.begins[other] > queues.begins[j]
        if is_later and (best < 0 or queues.begins[other] < queues.begins[best]):
            best = other
    return best


@inlined
def _gives_way(mission, uavs, i, queues):
    """Whether UAV ``i`` must not ask now: a UAV that the plan has before it would come after it."""
    zone = queues.zone[i]
    if queues.order[zone] == _AS_ASKED or queues.asks[i] > 0 or uavs[i].zone != zone:
        return False
    for j in range(mission.uavs):
        begins_first = queues.zone[j] == zone and queues.begins[j] < queues.begins[i]
        asks_after = queues.asks[j] > 0 or (j > i and not mission.lowest_battery_first)
        if begins_first and asks_after:
            return True
    return False
