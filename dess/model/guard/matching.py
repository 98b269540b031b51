"""Which zone each UAV counts on where some zone has fewer cells than there are UAVs.

If each chose the best zone for itself, two UAVs could count on the last cell of a small zone, and
the one that comes second may be too far from any other. So all UAVs are matched to the cells of
zones together: no zone gets more UAVs than it has cells, and the battery and the slots that UAVs
lack for their ways home are the least possible. A safe move keeps the zone in reach to which the
state before it matches the UAV. So if nobody lacks anything in one slot, there is such a matching
in the next one as well.

The start zone has a cell for each UAV, so there is a matching in every state.
"""

import numpy as np

from dess.base.kernels import inlined, shared_kernel
from dess.model.guard.battery import dearest_slot, late_slots, margin, margin_slots, usable_battery
from dess.model.guard.queues import needs_pad
from dess.model.guard.ways import battery_of_way, is_parked
from dess.physics.chart import distance
from dess.physics.landing import lands

# The prices of a zone, so far apart that no sum of lesser ones comes near: of a way home that the
# battery does not last for, and of each unit of battery that lacks for the margin; the battery for
# the way has a price of 1.
_UNREACHABLE, _LACKING = 2**52, 2**24
_NO_WAY = 2**60  # more than any sum of prices


@inlined
def is_tight(mission, chart):
    """Whether some zone has fewer cells than the mission has UAVs."""
    for zone in range(mission.zones):
        if chart.sizes[zone] < mission.uavs:
            return True
    return False


@inlined
def keeps_cell(mission, u):
    """Whether a UAV stays in its cell of a zone, whatever teammates need.

    One that only stands there flies on if a teammate needs the cell.
    """
    if not lands(mission):
        return is_parked(mission, u)
    return u.active and u.zone >= 0 and (u.charging or u.pad_request >= 0 or u.grounded)


@shared_kernel
def match_zones(mission, uavs, data, chart, plan, reach):
    """Match the UAVs that must charge to zones; the zone of each is written into its ``TURN``.

    Each UAV begins in the zone that is best for it. While a zone has more UAVs than cells, one of
    them goes to another zone, and if this is full, one of that zone goes on from there, and so on:
    by the chain with the lowest price. This finds the matching with the lowest sum of prices
    (successive shortest paths; the chains are found by Bellman and Ford's algorithm).

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        data: Residual data of all nodes together [data units].
        chart: ``Chart``.
        plan: ``Plan``; the zones are written into it.
        reach: The table of ``reach_of``.
    """
    prices = np.full((mission.uavs, mission.zones), _NO_WAY, np.int64)
    left = chart.sizes[: mission.zones].copy()  # the cells that are left in each zone
    for j in range(mission.uavs):
        u, turn = uavs[j], plan.turns[j]
        turn.zone, turn.asks = -1, 0
        if not needs_pad(mission, u, data):
            continue
        if keeps_cell(mission, u):
            turn.zone = u.zone
        else:
            _write_prices(mission, u, chart, prices[j], reach)
            turn.zone = np.argmin(prices[j])
        left[turn.zone] -= 1
    for zone in range(mission.zones):
        plan.queues[zone].change = 0
        while left[zone] < 0 and _move_on(mission, plan.turns, prices, left, zone):
            left[zone] += 1
    for zone in range(mission.zones):
        plan.queues[zone].is_full = left[zone] <= 0
    for j in range(mission.uavs):
        if plan.turns[j].zone >= 0:
            plan.turns[j].asks = _slots_to_zone(uavs[j], chart, plan.turns[j].zone)


@inlined
def _write_prices(mission, u, chart, prices, reach):
    """Write what each zone costs a UAV: its way there, and what it lacks for it."""
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        zone = np.int64(chart.zones[y, x])
        cells = distance(chart, u.x, u.y, x, y)
        spent = battery_of_way(mission, u, chart, u.x, u.y, x, y, cells, reach)
        spent += u.slots_left * dearest_slot(mission)
        slots = cells * u.slots_per_cell + u.slots_left
        prices[zone] = min(prices[zone], _price(mission, u, spent, slots))


@inlined
def _slots_to_zone(u, chart, zone):
    """The slots in which a UAV can be in a zone."""
    cells = chart.zones.size
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        if chart.zones[y, x] == zone:
            cells = min(cells, distance(chart, u.x, u.y, x, y))
    return cells * u.slots_per_cell + u.slots_left


@inlined
def _price(mission, u, spent, slots):
    """The price of a way home that takes so much battery and so many slots."""
    needed = spent + dearest_slot(mission)
    lacking = needed + margin(mission, u) - usable_battery(mission, u)
    late = late_slots(mission, slots + 1 + margin_slots(mission, u))
    lacking = max(lacking, dearest_slot(mission) * late, 0)
    price = spent + _LACKING * lacking
    if needed > usable_battery(mission, u) or late_slots(mission, slots + 1) > 0:
        price += _UNREACHABLE
    return price


@shared_kernel
def _move_on(mission, turns, prices, left, start):
    """Let one UAV too many in a zone go elsewhere, by the cheapest chain; whether there is one."""
    least = np.full(mission.zones, _NO_WAY, np.int64)
    who = np.full(mission.zones, -1, np.int64)  # the UAV that goes to each zone
    least[start] = 0
    for _ in range(mission.zones):
        for j in range(mission.uavs):
            now = turns[j].zone
            if now < 0 or prices[j, now] == _NO_WAY or least[now] == _NO_WAY:
                continue
            for zone in range(mission.zones):
                price = least[now] + prices[j, zone] - prices[j, now]
                if zone != now and zone != start and price < least[zone]:
                    least[zone], who[zone] = price, j
    end = -1
    for zone in range(mission.zones):
        if left[zone] > 0 and who[zone] >= 0 and (end < 0 or least[zone] < least[end]):
            end = zone
    if end < 0:
        return False
    left[end] -= 1
    while end != start:
        j = who[end]
        end, turns[j].zone = turns[j].zone, end
    return True
