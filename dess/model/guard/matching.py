"""Which zone each UAV counts on where the UAVs together would fill some zone.

If each chose the best zone for itself, two UAVs could count on the last cell of a small zone, and
the one that comes second may be too far from any other. So all UAVs are matched to the cells of
zones together: no zone gets more UAVs than it has cells, and the battery and the slots that UAVs
lack for their ways home are the least possible. A safe move keeps the zone in reach to which the
state before it matches the UAV. So if no UAV lacks anything in one slot, there is such a matching
in the next one as well. The start zone has a cell for each UAV, so there always is a matching.

In a full zone, UAVs are matched to its cells in the same way, by the squares of their ways. Cells
that UAVs close off by those that they keep do not count.

Where UAVs take turns at pads, the plan of pads (``dess.model.guard.queues``) tells the zones.
"""

import numpy as np

from dess.base.kernels import inlined, shared_kernel
from dess.model.guard.battery import late_slots, margin, margin_slots, usable_battery
from dess.model.guard.queues import KEPT, find_ways, is_given_up, needs_pad
from dess.model.guard.ways import battery_of_way
from dess.model.state import STEP_X, STEP_Y
from dess.physics.chart import distance, is_open, length_around
from dess.physics.energy import waiting_slot

# The price of a way home is the battery that it takes, and more for each unit that lacks for it and
# the margin, and if it is not possible at all. No sum of lesser prices comes near a larger one.
_LACKING, _UNREACHABLE = 2**24, 2**52
_NO_WAY = 2**60


@inlined
def keeps_cell(mission, u):
    """Whether a UAV in a zone stays in its cell, whatever teammates need.

    One that neither charges nor waits for a pad flies on if they need its cell.
    """
    return u.active and u.zone >= 0 and (u.charging or u.pad_request >= 0 or u.grounded)


@shared_kernel
def match_zones(mission, uavs, data, chart, plan, reach):
    """Match the UAVs that must charge to zones.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        data: Residual data of all nodes together [data units].
        chart: ``Chart``.
        plan: ``Plan``; the zone of each UAV is written into it, when it can be there, and whether
            it leaves its cell; and which zones are full.
        reach: ``Ways.reach``.
    """
    prices = np.full((mission.uavs, mission.zones), _NO_WAY, np.int64)
    zones = np.full(mission.uavs, -1, np.int64)
    closed = _kept_cells(mission, uavs, chart)
    left = chart.sizes - _shut_cells(mission, uavs, chart, closed)
    for j in range(mission.uavs):
        u, turn = uavs[j], plan.turns[j]
        if not needs_pad(mission, u, data):
            continue
        if keeps_cell(mission, u):
            zones[j] = u.zone
            turn.way[u.zone] = 0
        else:
            find_ways(mission, u, turn, chart, reach)
            for zone in range(mission.zones):
                prices[j, zone] = _price(mission, u, turn.spent[zone], turn.way[zone])
                if is_given_up(mission, zone):
                    prices[j, zone] += _UNREACHABLE
            zones[j] = np.argmin(prices[j])
        left[zones[j]] -= 1
    spread_out(prices, zones, left)
    for j in range(mission.uavs):
        turn = plan.turns[j]
        turn.zone, turn.cell = zones[j], -1
        if turn.zone >= 0:
            turn.asks = turn.way[turn.zone]
    for zone in range(mission.zones):
        plan.queues[zone].is_full = left[zone] <= 0
        plan.queues[zone].change = 0
        if left[zone] <= 0:
            _match_cells(mission, uavs, zone, chart, plan.turns, closed, reach)
    for j in range(mission.uavs):
        plan.turns[j].leaves = _leaves_cell(mission, uavs[j], plan.turns[j], chart)


@inlined
def _leaves_cell(mission, u, turn, chart):
    """Whether a UAV is in a zone, but matched to another one, or to another cell of a full one.

    One that has just been overruled on its way to such a cell stays where it is: a teammate wants
    the same cell, and they would block each other. So does one whose battery is nearly empty.
    """
    if u.zone < 0 or keeps_cell(mission, u):
        return False
    if turn.cell < 0 or u.zone != turn.zone:
        return u.zone != turn.zone
    x, y = chart.parking[turn.cell, 0], chart.parking[turn.cell, 1]
    cells = distance(chart, u.x, u.y, x, y)
    kept = waiting_slot(mission) * (cells * u.slots_per_cell + 1 + KEPT)
    return cells > 0 and not u.overruled and usable_battery(mission, u) > kept


@inlined
def _price(mission, u, spent, slots):
    """The price of a way home that takes so much battery and so many slots."""
    usable = usable_battery(mission, u)
    needed = spent + waiting_slot(mission)
    late = late_slots(mission, slots + 1 + margin_slots(mission, u))
    lacking = max(needed + margin(mission, u) - usable, waiting_slot(mission) * late, 0)
    price = spent + _LACKING * lacking
    if needed > usable or late_slots(mission, slots + 1) > 0:
        price += _UNREACHABLE
    return price


@shared_kernel
def _match_cells(mission, uavs, zone, chart, turns, closed, reach):
    """Match the UAVs that come to a full zone to its cells.

    The sum of the squares of their ways is the least possible, so that of two UAVs on one line the
    first flies on to the deeper cell. It falls with each cell that UAVs fly on their ways, so that
    no UAVs change places with each other again and again.
    """
    cells, count = np.empty(chart.sizes[zone], np.int64), 0
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        is_kept = (closed == y * chart.zones.shape[1] + x).any()
        if chart.zones[y, x] == zone and not is_kept:
            cells[count] = cell
            count += 1
    prices = np.full((mission.uavs, count), _NO_WAY, np.int64)
    places = np.full(mission.uavs, -1, np.int64)
    left = np.ones(count, np.int64)
    for j in range(mission.uavs):
        u = uavs[j]
        if count == 0 or turns[j].zone != zone or keeps_cell(mission, u):
            continue
        for place in range(count):
            x, y = chart.parking[cells[place], 0], chart.parking[cells[place], 1]
            way = distance(chart, u.x, u.y, x, y)
            if len(closed) > 0:
                way = length_around(chart.zones, chart.ways, chart.rows, closed, u.x, u.y, x, y)
            spent = battery_of_way(mission, u, chart, u.x, u.y, x, y, way, reach)
            bounded = min(spent, _LACKING)
            prices[j, place] = bounded * bounded
            if spent + waiting_slot(mission) > usable_battery(mission, u):
                prices[j, place] += _UNREACHABLE
        places[j] = np.argmin(prices[j])
        left[places[j]] -= 1
    spread_out(prices, places, left)
    for j in range(mission.uavs):
        if places[j] >= 0:
            turns[j].cell = cells[places[j]]


@shared_kernel
def _kept_cells(mission, uavs, chart):
    """The numbers of the cells, counted row by row, that UAVs keep."""
    cells, count = np.empty(mission.uavs, np.int64), 0
    for j in range(mission.uavs):
        if keeps_cell(mission, uavs[j]):
            cells[count] = uavs[j].y * chart.zones.shape[1] + uavs[j].x
            count += 1
    return cells[:count]


@shared_kernel
def _shut_cells(mission, uavs, chart, closed):
    """How many cells of each zone are shut: no UAV is there, and UAVs keep all cells beside it.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        chart: ``Chart``.
        closed: The numbers of the cells that UAVs keep.

    Returns:
        (Z,) the cells.
    """
    shut = np.zeros_like(chart.sizes)
    if len(closed) == 0:
        return shut
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        if not _has_uav(mission, uavs, x, y) and not _can_be_entered(chart, closed, x, y):
            shut[chart.zones[y, x]] += 1
    return shut


@inlined
def _has_uav(mission, uavs, x, y):
    """Whether an active UAV is in a cell."""
    count = 0
    for j in range(mission.uavs):
        count += uavs[j].active and uavs[j].x == x and uavs[j].y == y
    return count > 0


@shared_kernel
def _can_be_entered(chart, closed, x, y):
    """Whether one of the cells beside a cell is open, and no UAV keeps it."""
    for action in range(4):
        from_x, from_y = x + STEP_X[action], y + STEP_Y[action]
        number = from_y * chart.zones.shape[1] + from_x
        if is_open(chart.zones, from_x, from_y) and not (closed == number).any():
            return True
    return False


@shared_kernel
def spread_out(prices, places, left):
    """Spread UAVs that are in the best place for each over the places with the least sum of prices.

    A place is a zone, or a cell. While one has more UAVs than it has room for, one of them goes to
    another, and if this is full, one goes on from there, and so on: by the cheapest of such chains
    (successive shortest paths).

    Args:
        prices: (I, P) the price of each place for each UAV, ``_NO_WAY`` for one that stays.
        places: (I,) the place of each UAV, or -1; the result is written into it.
        left: (P,) the room that is left in each place, negative where there are too many UAVs.
    """
    for place in range(len(left)):
        while left[place] < 0:
            end = _move_on(prices, places, left, place)
            if end < 0:
                break
            left[end] -= 1
            left[place] += 1


@shared_kernel
def _move_on(prices, places, left, start):
    """Let a UAV leave a place by the cheapest chain; the place where this ends, or -1.

    This is Bellman and Ford's algorithm, on places. It ends with the first round that finds no
    cheaper chain.
    """
    least = np.full(len(left), _NO_WAY, np.int64)  # the price of a chain to each place
    least[start] = 0
    who = np.full(len(left), -1, np.int64)  # the UAV that goes there in it
    for _ in range(len(left)):
        is_settled = True
        for j in range(len(prices)):
            now = places[j]
            if now < 0 or prices[j, now] == _NO_WAY or least[now] == _NO_WAY:
                continue
            for place in range(len(left)):
                price = least[now] + prices[j, place] - prices[j, now]
                if place != now and place != start and price < least[place]:
                    least[place], who[place] = price, j
                    is_settled = False
        if is_settled:
            break
    end = -1
    for place in range(len(left)):
        if left[place] > 0 and who[place] >= 0 and (end < 0 or least[place] < least[end]):
            end = place
    place = end
    while place >= 0 and place != start:
        j = who[place]
        before = places[j]
        places[j] = place
        place = before
    return end
