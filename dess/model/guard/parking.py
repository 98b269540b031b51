"""Where a UAV will charge: the plan of parking cells, in the zones that the plan of pads tells."""

from typing import NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel, shared_kernel
from dess.model.guard.battery import ends_soon, late_slots, margin_slots, usable_battery
from dess.model.guard.matching import keeps_cell, match_zones
from dess.model.guard.queues import (
    QUEUE,
    TURN,
    Plan,
    forget_plan,
    is_given_up,
    may_wait,
    plan_pads,
    waits_in_zone,
)
from dess.model.guard.ways import (
    battery_of_way,
    is_crowded,
    is_parked,
    is_tight,
    may_stand,
    path_length,
)
from dess.model.ways import is_calm
from dess.physics.chart import distance
from dess.physics.landing import lands
from dess.scenario.fields import MOST_ZONES

# What teammates do with a zone cell: nothing; one is on it that may leave it, as it is not parked;
# one takes it.
_FREE, _OCCUPIED, _TAKEN = range(3)
_LATE = 2**24  # a slot of being late counts more than all battery of a way [% / 1000]


class Parking(NamedTuple):
    """Working memory of ``parking_cell``.

    Attributes:
        taken: (zone cells,) whether a cell is ``_FREE``, ``_OCCUPIED`` or ``_TAKEN``.
        planned: (I,) the zone cell of each teammate that chooses before the UAV, or -1.
        order: (I,) the UAVs in the order in which they choose.
        plan: The plan of pads; its zones are -1 where no UAV may have to wait for a pad.
    """

    taken: np.ndarray
    planned: np.ndarray
    order: np.ndarray
    plan: Plan


class Home(NamedTuple):
    """Where a UAV will charge.

    Attributes:
        x, y: The zone cell.
        cells: The way there [cells].
        wait: The slots that the UAV must keep there for waits for a pad, its own and those of
            teammates that are charged after it.
        begins: In how many slots it begins to charge by the plan of pads, 0 without a plan.
        gives_way: 1 if it must not ask for a pad yet, since a teammate would run empty; else 0.
    """

    x: int
    y: int
    cells: int
    wait: int
    begins: int
    gives_way: int


# A ``Home`` in an array of them.
HOME = np.dtype([(name, np.int64) for name in Home._fields])


@inlined
def write_home(record, home):
    """Write a ``Home`` into a ``HOME`` record."""
    record.x, record.y, record.cells = home.x, home.y, home.cells
    record.wait, record.begins, record.gives_way = home.wait, home.begins, home.gives_way


@kernel
def parking_memory(chart, uavs):
    """Working memory for missions with so many UAVs."""
    return Parking(
        np.empty(len(chart.parking), np.int64),
        np.empty(uavs, np.int64),
        np.empty(uavs, np.int64),
        Plan(np.empty(uavs, TURN), np.empty(MOST_ZONES, QUEUE)),
    )


@inlined
def stays(u):
    """The ``Home`` of a UAV that need not charge."""
    return _home(u.x, u.y, 0)


@inlined
def _home(x, y, cells):
    """A ``Home`` without waits; the compiler needs all its numbers to be of one type."""
    none = np.int64(0)
    return Home(np.int64(x), np.int64(y), np.int64(cells), none, none, none)


@inlined
def parking_cell(mission, uavs, i, data, chart, memory, reach):
    """The ``Home`` of UAV ``i``, the zone cell where it will charge.

    Where UAVs may have to wait for pads, the plan of pads tells the zone. Of the cells, the UAVs
    choose one after another (``_choose``).

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        data: Residual data of all nodes together [data units].
        chart: ``Chart``.
        memory: ``parking_memory``.
        reach: ``Ways.reach``.
    """
    forget_plan(mission, memory.plan)
    if mission.active == 1 and is_calm(reach) and mission.zones == 1 and mission.pad_rate == 0.0:
        memory.planned[:] = -1
        return _nearest(uavs[i], chart)
    wait = begins = gives_way = np.int64(0)
    is_planned = may_wait(mission, uavs, data)
    is_matched = not is_planned and is_tight(mission, chart.sizes)
    if is_planned:
        for zone in range(mission.zones):
            memory.plan.queues[zone].is_full = 0
        wait, begins, gives_way = plan_pads(mission, uavs, i, data, chart, memory.plan, reach)
    elif is_matched:
        match_zones(mission, uavs, data, chart, memory.plan, reach)
    home = _choose(mission, uavs, i, chart, memory, reach)
    if is_matched:
        wait = _slots_for_others(mission, uavs, i, memory.plan.turns)
        gives_way = memory.plan.turns[i].leaves
    return Home(home.x, home.y, home.cells, wait, begins, gives_way)


@inlined
def _slots_for_others(mission, uavs, i, turns):
    """The slots that a UAV keeps for teammates that come to its zone at the same time or sooner.

    Those are the ones that are in the air and can spare no more battery than it. In missions that
    go on in the air, the margin has slots for all teammates.
    """
    count = np.int64(0)
    zone = turns[i].zone
    if zone < 0 or not lands(mission) or keeps_cell(mission, uavs[i]):
        return count
    spare = usable_battery(mission, uavs[i]) - turns[i].spent[zone]
    for j in range(mission.uavs):
        if j == i or turns[j].zone != zone or keeps_cell(mission, uavs[j]):
            continue
        if usable_battery(mission, uavs[j]) - turns[j].spent[zone] <= spare:
            count += 1
    return count * uavs[i].slots_per_cell


@inlined
def _nearest(u, chart):
    """The ``Home`` of a UAV without teammates."""
    cell = chart.nearest[u.y, u.x]
    x, y = chart.parking[cell, 0], chart.parking[cell, 1]
    return _home(x, y, distance(chart, u.x, u.y, x, y))


@inlined
def _sort(mission, uavs, turns, order):
    """Sort the active UAVs in the order in which they choose. How many there are."""
    count = 0
    for j in range(mission.uavs):
        if not uavs[j].active:
            continue
        place = count
        while place > 0 and _chooses_before(mission, uavs, j, order[place - 1], turns):
            order[place] = order[place - 1]
            place -= 1
        order[place] = j
        count += 1
    return count


@inlined
def _chooses_before(mission, uavs, j, other, turns):
    """Whether UAV ``j`` chooses before another with a lower index.

    In the plan of pads, who can ask sooner comes sooner, and needs the cell that it can reach then.
    Where missions end on the ground there is none: a charged UAV in a zone makes room for those
    that come, so it has to know their cells.
    """
    are_planned = turns[j].zone >= 0 and turns[other].zone >= 0 and not lands(mission)
    if are_planned and turns[j].asks != turns[other].asks:
        return turns[j].asks < turns[other].asks
    return uavs[j].battery < uavs[other].battery


@inlined
def _choose(mission, uavs, i, chart, memory, reach):
    """The cell of UAV ``i``: of those that no teammate takes, the one that takes least battery.

    Parked teammates keep their cells. The other UAVs choose one after another, the lowest battery
    first (ties in index order), so that no two UAVs fly to the same cell.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        chart: ``Chart``.
        memory: ``parking_memory``, with the plan of pads.
        reach: ``Ways.reach``.

    Returns:
        The ``Home``, without waits; the UAV's own cell if all are taken.
    """
    u, taken, turns = uavs[i], memory.taken, memory.plan.turns
    are_matched = is_tight(mission, chart.sizes)
    if are_matched and _has_cell(mission, u, turns[i], chart, are_matched):
        memory.planned[:] = -1
        return stays(u)
    taken[:] = _FREE
    for j in range(mission.uavs):
        o = uavs[j]
        memory.planned[j] = -1
        if not o.active or o.zone < 0:
            continue
        keeps = _has_cell(mission, o, turns[j], chart, are_matched)
        keeps = keeps or not is_crowded(mission, chart, o.zone)
        keeps = keeps or (j == i and not are_matched)
        keeps = keeps or (waits_in_zone(mission, o) and not turns[j].leaves)
        taken[chart.nearest[o.y, o.x]] = _TAKEN if keeps else _OCCUPIED
    count = _sort(mission, uavs, turns, memory.order)
    for place in range(count):
        j = memory.order[place]
        o = uavs[j]
        if j != i and (o.grounded or _has_cell(mission, o, turns[j], chart, are_matched)):
            continue
        if j != i and are_matched and turns[j].zone < 0:
            continue  # it needs no cell
        cell, cells = _soonest_free(mission, uavs, j, chart, memory, reach)
        if j == i:
            if cell < 0:
                break
            return _home(chart.parking[cell, 0], chart.parking[cell, 1], cells)
        if cell >= 0:
            taken[cell] = _TAKEN
            memory.planned[j] = cell
    return stays(u)


@inlined
def _has_cell(mission, u, turn, chart, are_matched):
    """Whether a UAV keeps its cell, and chooses none."""
    if are_matched:
        return keeps_cell(mission, u) or (may_stand(mission, u) and not turn.leaves)
    return is_parked(mission, u, chart.sizes)


@inlined
def _soonest_free(mission, uavs, i, chart, memory, reach):
    """The number of the best parking cell that is not taken (-1 if none), and the way to it.

    It is the one that the UAV is matched to, if there is one. Otherwise it is in the zone that the
    plan of pads tells, unless this is full. A mission may end on the ground before a teammate has
    left its cell, so there a UAV counts on the cells of teammates only if no other is in reach.
    """
    u, zone = uavs[i], memory.plan.turns[i].zone
    most = _FREE if lands(mission) else _OCCUPIED
    # The nearest cell of all is free most of the time, so this one is tried first.
    cell = np.int64(memory.plan.turns[i].cell)
    is_matched = cell >= 0
    if not is_matched:
        cell = np.int64(chart.nearest[u.y, u.x])
    x, y = chart.parking[cell, 0], chart.parking[cell, 1]
    cells, nearest_zone = distance(chart, u.x, u.y, x, y), np.int64(chart.zones[y, x])
    free = (cells == 0 or memory.taken[cell] <= most) and not is_given_up(mission, nearest_zone)
    free = free and is_calm(reach) and (zone < 0 or zone == nearest_zone)
    if is_matched or free:
        way = path_length(mission, uavs, i, chart, None, u.x, u.y, x, y)
        if is_matched or way == cells:
            return cell, way
    cell, cells, spent = _best_cell(mission, uavs, i, zone, most, chart, memory, reach)
    is_in_reach = cell >= 0 and (not lands(mission) or spent < usable_battery(mission, u))
    is_in_reach = is_in_reach and late_slots(mission, cells * u.slots_per_cell + 1) == 0
    if not is_in_reach and (zone >= 0 or lands(mission)):
        only, most = np.int64(-1), _OCCUPIED
        if zone >= 0 and memory.plan.queues[zone].change > 0:
            only, most = zone, _TAKEN  # it waits outside until a teammate has left its cell
        cell, cells, spent = _best_cell(mission, uavs, i, only, most, chart, memory, reach)
    return cell, cells


@shared_kernel
def _best_cell(mission, uavs, i, only, most, chart, memory, reach):
    """The cell of one zone, or of all (-1), that takes least battery.

    One that the UAV cannot reach before the mission ends is worse than any that it can: where the
    wind makes the ways to a zone cheap, the way to another may be shorter.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        only: The zone, or -1.
        most: ``_FREE`` for a cell without a teammate, or ``_OCCUPIED``.
        chart: ``Chart``.
        memory: ``parking_memory``.
        reach: ``Ways.reach``.

    Returns:
        The number of the cell, -1 if there is none; the way to it [cells]; the battery for it.
    """
    u, best, best_zone, way, least = uavs[i], -1, -1, -1, -1
    battery = -1
    # shortly before the end, no teammate leaves the cell again that it will take
    are_closed = is_tight(mission, chart.sizes) and ends_soon(mission, u)
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        zone = np.int64(chart.zones[y, x])
        is_elsewhere = u.x != x or u.y != y
        if (memory.taken[cell] > most and is_elsewhere) or is_given_up(mission, zone):
            continue
        # no detour makes a cell better than a nearer one of the same zone
        is_far = zone == best_zone and distance(chart, u.x, u.y, x, y) >= way
        if (only >= 0 and zone != only) or (is_calm(reach) and is_far):
            continue
        cells = distance(chart, u.x, u.y, x, y)
        if best >= 0 and _price_of_way(mission, u, chart, x, y, cells, reach) > least:
            continue  # and more with a detour
        if are_closed:
            cells = path_length(mission, uavs, i, chart, memory.planned, u.x, u.y, x, y)
        else:
            cells = path_length(mission, uavs, i, chart, None, u.x, u.y, x, y)
        spent = battery_of_way(mission, u, chart, u.x, u.y, x, y, cells, reach)
        price = _price_of_way(mission, u, chart, x, y, cells, reach)
        if best < 0 or price < least or (price == least and cells < way):
            best, best_zone, way, least, battery = cell, zone, cells, price, spent
    return best, way, battery


@inlined
def _price_of_way(mission, u, chart, x, y, cells, reach):
    """The battery of a way of so many cells to a parking cell, and more if it takes too long."""
    spent = battery_of_way(mission, u, chart, u.x, u.y, x, y, cells, reach)
    slots = cells * u.slots_per_cell + 1 + margin_slots(mission, u)
    return spent + _LATE * late_slots(mission, slots)
