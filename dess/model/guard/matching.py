"""Which zone each UAV counts on where some zone has fewer cells than there are UAVs.

If each chose the best zone for itself, two UAVs could count on the last cell of a small zone, and
the one that comes second may be too far from any other. So all UAVs are matched to the cells of
zones together: no zone gets more UAVs than it has cells, and the battery and the slots that UAVs
lack for their ways home are the least possible. A safe move keeps the zone in reach to which the
state before it matches the UAV. So if no UAV lacks anything in one slot, there is such a matching
in the next one as well. The start zone has a cell for each UAV, so there always is a matching.

Where UAVs take turns at pads, the plan of pads (``dess.model.guard.queues``) tells the zones.
"""

import numpy as np

from dess.base.kernels import inlined, shared_kernel
from dess.model.guard.battery import dearest_slot, late_slots, margin, margin_slots, usable_battery
from dess.model.guard.queues import find_ways, is_given_up, needs_pad
from dess.model.guard.ways import is_parked
from dess.physics.landing import lands

# The price of a way home is the battery that it takes, and more for each unit that lacks for it and
# the margin, and if it is not possible at all. No sum of lesser prices comes near a larger one.
_LACKING, _UNREACHABLE = 2**24, 2**52
_NO_WAY = 2**60


@inlined
def is_tight(mission, chart):
    """Whether some zone has fewer cells than the mission has UAVs."""
    fewest = mission.uavs
    for zone in range(mission.zones):
        fewest = min(fewest, chart.sizes[zone])
    return fewest < mission.uavs


@inlined
def keeps_cell(mission, u):
    """Whether a UAV in a zone stays in its cell, whatever teammates need.

    On the ground, one that neither charges nor waits for a pad flies on if they need its cell.
    """
    if not lands(mission):
        return is_parked(mission, u)
    return u.active and u.zone >= 0 and (u.charging or u.pad_request >= 0 or u.grounded)


@shared_kernel
def match_zones(mission, uavs, data, chart, plan, reach):
    """Match the UAVs that must charge to zones.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        data: Residual data of all nodes together [data units].
        chart: ``Chart``.
        plan: ``Plan``; the zone of each UAV is written into it, when it can be there, and which
            zones are full.
        reach: ``Ways.reach``.
    """
    prices = np.full((mission.uavs, mission.zones), _NO_WAY, np.int64)
    left = chart.sizes.copy()
    for j in range(mission.uavs):
        u, turn = uavs[j], plan.turns[j]
        turn.zone = -1
        if not needs_pad(mission, u, data):
            continue
        if keeps_cell(mission, u):
            turn.zone = u.zone
            turn.way[u.zone] = 0
        else:
            find_ways(mission, u, turn, chart, reach)
            for zone in range(mission.zones):
                prices[j, zone] = _price(mission, u, turn.spent[zone], turn.way[zone])
                if is_given_up(mission, zone):
                    prices[j, zone] += _UNREACHABLE
            turn.zone = np.argmin(prices[j])
        left[turn.zone] -= 1
    spread_out(prices, plan.turns, left)
    for j in range(mission.uavs):
        turn = plan.turns[j]
        if turn.zone >= 0:
            turn.asks = turn.way[turn.zone]
    for zone in range(mission.zones):
        plan.queues[zone].is_full = left[zone] <= 0
        plan.queues[zone].change = 0


@inlined
def _price(mission, u, spent, slots):
    """The price of a way home that takes so much battery and so many slots."""
    usable = usable_battery(mission, u)
    needed = spent + dearest_slot(mission)
    late = late_slots(mission, slots + 1 + margin_slots(mission, u))
    lacking = max(needed + margin(mission, u) - usable, dearest_slot(mission) * late, 0)
    price = spent + _LACKING * lacking
    if needed > usable or late_slots(mission, slots + 1) > 0:
        price += _UNREACHABLE
    return price


@shared_kernel
def spread_out(prices, turns, left):
    """Spread UAVs that are in the best zone for each over the zones with the least sum of prices.

    While a zone has more UAVs than cells, one of them goes to another zone, and if this is full,
    one of that zone goes on from there, and so on: by the cheapest of such chains (successive
    shortest paths).

    Args:
        prices: (I, Z) the price of each zone for each UAV; that of a UAV that stays is ``_NO_WAY``.
        turns: (I,) ``TURN`` records with the zones, -1 for UAVs without one.
        left: (Z,) the cells that are left in each zone, negative where there are too many UAVs.
    """
    for zone in range(len(left)):
        while left[zone] < 0:
            end = _move_on(prices, turns, left, zone)
            if end < 0:
                break
            left[end] -= 1
            left[zone] += 1


@shared_kernel
def _move_on(prices, turns, left, start):
    """Let a UAV leave a zone by the cheapest chain; the zone where this ends, or -1.

    This is Bellman and Ford's algorithm, on zones.
    """
    least = np.full(len(left), _NO_WAY, np.int64)  # the price of a chain to each zone
    least[start] = 0
    who = np.full(len(left), -1, np.int64)  # the UAV that goes there in it
    for _ in range(len(left)):
        for j in range(len(prices)):
            now = turns[j].zone
            if now < 0 or prices[j, now] == _NO_WAY or least[now] == _NO_WAY:
                continue
            for zone in range(len(left)):
                price = least[now] + prices[j, zone] - prices[j, now]
                if zone != now and zone != start and price < least[zone]:
                    least[zone], who[zone] = price, j
    end = -1
    for zone in range(len(left)):
        if left[zone] > 0 and who[zone] >= 0 and (end < 0 or least[zone] < least[end]):
            end = zone
    zone = end
    while zone >= 0 and zone != start:
        j = who[zone]
        before = turns[j].zone
        turns[j].zone = zone
        zone = before
    return end
