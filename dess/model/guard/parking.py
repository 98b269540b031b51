"""Where a UAV will charge: the plan of parking cells, and of waits for charging pads."""

from typing import NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.model.guard.battery import will_charge
from dess.model.guard.ways import battery_of_way, is_crowded, is_parked, path_length
from dess.physics.charging import slots_to_charge
from dess.physics.chart import distance
from dess.physics.failures import working_pads
from dess.physics.landing import lands
from dess.physics.section import for_sections
from dess.physics.wind import is_calm
from dess.scenario.fields import MOST_ZONES


class Parking(NamedTuple):
    """Working memory of ``parking_cell``.

    Attributes:
        taken: (zone cells,) whether a teammate takes the cell.
        planned: (I,) the zone cell of each teammate that chooses before the UAV, or -1.
        order: (I,) the UAVs in the order in which they choose.
        free: (Z, I) in how many slots each pad of a zone will be free, at most I pads.
        free_after: The same if the UAV asks for a pad now.
    """

    taken: np.ndarray
    planned: np.ndarray
    order: np.ndarray
    free: np.ndarray
    free_after: np.ndarray


class Home(NamedTuple):
    """Where a UAV will charge.

    Attributes:
        x, y: The zone cell.
        cells: The way there [cells].
        wait: The slots that the UAV must keep there for a pad.
        lacks: The slots that it lacks.
        gives_way: 1 if it must not ask for a pad yet, since a teammate would run empty; else 0.
    """

    x: int
    y: int
    cells: int
    wait: int
    lacks: int
    gives_way: int


@kernel
def parking_memory(chart, uavs):
    """Working memory for missions with so many UAVs."""
    return Parking(
        np.empty(len(chart.parking), np.bool_),
        np.empty(uavs, np.int64),
        np.empty(uavs, np.int64),
        np.empty((MOST_ZONES, uavs), np.int64),
        np.empty((MOST_ZONES, uavs), np.int64),
    )


@inlined
def stays(u):
    """The ``Home`` of a UAV that need not charge."""
    return Home(np.int64(u.x), np.int64(u.y), np.int64(0), np.int64(0), np.int64(0), np.int64(0))


@kernel
def parking_cell(mission, uavs, i, chart, memory, reach):
    """The ``Home`` of UAV ``i``, the zone cell where it will charge.

    The UAVs choose one after another, as ``_plan`` says. If one of them would run empty and there
    are several zones, this one chooses before all others, except those that would lack more then.
    """
    if mission.active == 1 and is_calm(reach) and mission.zones == 1 and mission.pad_rate == 0.0:
        return _nearest(mission, uavs[i], chart, memory)
    first = -1
    if mission.plans_waits and mission.zones > 1 and mission.uavs > 1:
        first = _chooses_first(mission, uavs, i, chart, memory, reach)
    home = _plan(mission, uavs, i, first, chart, memory, reach)
    if first != i:
        return home
    # who would run empty flies there at once, in case that the others do not give way
    soon = np.int64(mission.charge_start - 1)
    return Home(home.x, home.y, home.cells, soon, home.lacks, home.gives_way)


@inlined
def _nearest(mission, u, chart, memory):
    """The ``Home`` of a UAV without teammates."""
    memory.planned[:] = -1
    cell = chart.nearest[u.y, u.x]
    x, y = np.int64(chart.parking[cell, 0]), np.int64(chart.parking[cell, 1])
    cells = np.int64(distance(chart, u.x, u.y, x, y))
    return Home(x, y, cells, np.int64(0), np.int64(max(cells + 1 - u.battery, 0)), np.int64(0))


@inlined
def _chooses_first(mission, uavs, i, chart, memory, reach):
    """Who of the UAVs that would run empty chooses its zone before all others, or -1 for none."""
    lacks = _plan(mission, uavs, i, -1, chart, memory, reach).lacks
    first = i if lacks > 0 else -1
    for j in range(mission.uavs):
        if first < 0 and will_charge(mission, uavs[j]) and not is_parked(mission, uavs[j]):
            first = j if _plan(mission, uavs, j, -1, chart, memory, reach).lacks > 0 else -1
    if first >= 0 and _plan(mission, uavs, i, first, chart, memory, reach).lacks > lacks:
        return -1
    return first


@inlined
def _sort(mission, uavs, first, order):
    """Sort the active UAVs: ``first``, then by battery, ties by index. How many there are."""
    count = 0
    for j in range(mission.uavs):
        if not uavs[j].active:
            continue
        place = count
        while place > 0 and order[place - 1] != first:
            if j != first and uavs[j].battery >= uavs[order[place - 1]].battery:
                break
            order[place] = order[place - 1]
            place -= 1
        order[place] = j
        count += 1
    return count


@kernel
def _plan(mission, uavs, i, first, chart, memory, reach):
    """Where UAV ``i`` will charge: of the zone cells that no teammate takes, the soonest.

    Parked teammates keep their cells, and their pads if they have asked for one. The other UAVs
    choose one after another, the lowest battery first (ties in index order), so that no two UAVs
    fly to the same cell. Each chooses the cell where it gets a pad first, the nearest on a tie.

    The UAV expects to wait for the pads of those who choose before it. It comes so early that those
    who choose after it get a pad in time, too, and does not ask for a free pad if a teammate would
    run empty then and this UAV would not run empty later.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        first: Index of a UAV that chooses before all others, -1 for none.
        chart: ``Chart``.
        memory: ``parking_memory``.
        reach: The table of ``reach_of``.

    Returns:
        The ``Home``; the UAV's own cell if all are taken.
    """
    u, taken, free = uavs[i], memory.taken, memory.free
    taken[:] = False
    for zone in range(mission.zones):
        if _plans_wait(mission, zone):
            free[zone, :] = 0
    for j in range(mission.uavs):
        o = uavs[j]
        memory.planned[j] = -1
        stays_there = j == i or is_parked(mission, o) or not is_crowded(mission, chart, o.zone)
        if o.active and o.zone >= 0 and stays_there:
            taken[chart.nearest[o.y, o.x]] = True
            if j != i and o.pad_request >= 0 and _plans_wait(mission, o.zone):
                _take_pad(mission, o, o.zone, 0, free)
    may_ask = u.zone >= 0 and u.latch and u.pad_request < 0 and _plans_wait(mission, u.zone)
    if may_ask:
        for pad in range(mission.uavs):
            memory.free_after[u.zone, pad] = free[u.zone, pad]
        _take_pad(mission, u, u.zone, 0, memory.free_after)
    home, home_zone, followers, starves = stays(u), -1, 0, False
    cell, slots, lacks, wait, zone = -1, 0, 0, 0, np.int64(0)
    for place in range(_sort(mission, uavs, first, memory.order)):
        j = memory.order[place]
        o = uavs[j]
        charges = will_charge(mission, o)
        if j != i and (o.grounded or o.pad_request >= 0 or (home_zone >= 0 and not charges)):
            continue
        if j != i and is_parked(mission, o):  # it asks for a pad in this slot
            cell, slots, zone = np.int64(chart.nearest[o.y, o.x]), 0, np.int64(o.zone)
        elif home_zone < 0 or mission.zones > 1:
            cell, slots, lacks = _soonest_free(mission, uavs, j, chart, memory, reach)
            if cell < 0 and j == i:
                break
            if cell < 0:
                continue
            taken[cell] = True
            zone = np.int64(chart.zones[chart.parking[cell, 1], chart.parking[cell, 0]])
        if home_zone >= 0:
            if zone == home_zone:
                followers += 1
                wait = max(wait, _kept(mission, u, o, zone, followers))
        elif j == i:
            wait, home_zone = _waiting_time(mission, u, zone, slots, free), zone
            gives_way = np.int64(may_ask and starves and lacks == 0)
            x, y = np.int64(chart.parking[cell, 0]), np.int64(chart.parking[cell, 1])
            home = Home(x, y, np.int64(slots), np.int64(0), np.int64(lacks), gives_way)
            if u.pad_request >= 0 or not mission.plans_waits or not _plans_wait(mission, zone):
                break
        else:
            memory.planned[j] = cell
            if not charges or not _plans_wait(mission, zone):
                continue
            asked = _until_asked(mission, o, slots)
            if may_ask and zone == u.zone:
                begin = max(asked, _until_free(mission, zone, free))
                later = max(asked, _until_free(mission, zone, memory.free_after))
                starves = starves or begin < o.battery <= later
                _take_pad(mission, o, zone, asked, memory.free_after)
            _take_pad(mission, o, zone, asked, free)
    # To wait for more than C_S is of no use, as a UAV may ask only at or below C_S.
    wait = np.int64(min(wait, mission.charge_start - 1))
    return Home(home.x, home.y, home.cells, wait, home.lacks, home.gives_way)


@inlined
def _kept(mission, u, o, zone, followers):
    """The slots that UAV ``u`` keeps so that the UAV so many places after it is charged in time.

    A pad charges one UAV after another. So of those who come to the same zone, every one after as
    many as there are pads waits until this UAV is charged, and its battery must last for so long.
    """
    pads = working_pads(mission, zone)
    if pads == 0 or followers % pads != 0:
        return 0
    charge = slots_to_charge(mission, mission.charge_complete)
    return followers // pads * charge - (o.battery - u.battery) // max(mission.flight_cost, 1)


@inlined
def _soonest_free(mission, uavs, i, chart, memory, reach):
    """The number of the best parking cell that is not taken (-1 if none), the way, what lacks."""
    u = uavs[i]
    # The nearest cell of all is free most of the time, so this one is tried first.
    cell = np.int64(chart.nearest[u.y, u.x])
    x, y = chart.parking[cell, 0], chart.parking[cell, 1]
    zone, slots = np.int64(chart.zones[y, x]), distance(chart, u.x, u.y, x, y)
    free = (slots == 0 or not memory.taken[cell]) and not _is_given_up(mission, zone)
    free = free and (mission.zones == 1 or not _waiting_time(mission, u, zone, slots, memory.free))
    free = free and is_calm(reach)
    if free and path_length(mission, uavs, i, chart, None, u.x, u.y, x, y) == slots:
        return cell, slots, max(slots + 1 - u.battery, 0)
    best, best_zone, way, least, fewest = -1, -1, -1, -1, -1
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        zone = np.int64(chart.zones[y, x])
        if (memory.taken[cell] and not (u.x == x and u.y == y)) or _is_given_up(mission, zone):
            continue
        # no detour and no wait makes a cell better than a nearer one of the same zone
        if is_calm(reach) and zone == best_zone and distance(chart, u.x, u.y, x, y) >= way:
            continue
        slots = path_length(mission, uavs, i, chart, None, u.x, u.y, x, y)
        wait = _waiting_time(mission, u, zone, slots, memory.free)
        until = battery_of_way(mission, u, chart, u.x, u.y, x, y, slots, reach)
        # the slots that lack if it begins to charge as soon as it may and a pad is free
        spare = u.battery - mission.charge_start
        lacks = max(max(until, spare) + wait + 1 - u.battery, 0)
        until += wait
        is_sooner = until < least or (until == least and slots < way)
        if best < 0 or lacks < fewest or (lacks == fewest and is_sooner):
            best, best_zone, way, least, fewest = cell, zone, slots, until, lacks
    return best, way, fewest


@for_sections
def _is_given_up(mission, zone):
    """Whether no pad of one of several zones will ever work again."""
    never = mission.zones > 1 and mission.pad_rate > 0.0 and mission.pad_repair == 0.0
    return never and working_pads(mission, zone) == 0


@inlined
def _plans_wait(mission, zone):
    """Whether the guard allows for waits for a pad of a zone; on the ground, they cost nothing."""
    if lands(mission):
        return False
    few = mission.plans_waits and mission.uavs > mission.zone_pads[zone]
    return few or mission.pad_rate > 0.0


@inlined
def _waiting_time(mission, u, zone, cells, free):
    """The slots for which a UAV must expect to wait for a pad of a zone so many cells away.

    It asks for one on its arrival, if its battery is not above C_S then.

    Args:
        mission: ``MISSION`` record.
        u: ``UAV`` record.
        zone: The number of the zone.
        cells: Cells on the way to it.
        free: As in ``Parking``.
    """
    if u.pad_request >= 0 or not _plans_wait(mission, zone):
        return 0
    return max(_until_free(mission, zone, free) - _until_asked(mission, u, cells), 0)


@inlined
def _until_free(mission, zone, free):
    """In how many slots a pad of a zone will be free; the whole mission if none works."""
    pad = _first_pad(mission, zone, free)
    return free[zone, pad] if pad >= 0 else mission.max_slots


@inlined
def _first_pad(mission, zone, free):
    """The pad of a zone that will be free first, or -1 if none works."""
    first = -1
    for pad in range(min(working_pads(mission, zone), mission.uavs)):
        if first < 0 or free[zone, pad] < free[zone, first]:
            first = pad
    return first


@inlined
def _until_asked(mission, u, cells):
    """The slots until a UAV may ask for a pad at a parking cell that is so many cells away."""
    spare = u.battery - mission.charge_start
    return max(cells * u.slots_per_cell, spare // max(mission.flight_cost, 1))


@inlined
def _take_pad(mission, u, zone, asked, free):
    """Let a UAV that asks for a pad in so many slots use the one that is free first."""
    pad = _first_pad(mission, zone, free)
    if pad < 0:
        return
    begin = max(free[zone, pad], asked)
    flying = 0 if u.charging else begin
    lacking = mission.charge_complete - max(u.battery - flying * mission.flight_cost, 0)
    slots = slots_to_charge(mission, lacking)
    if mission.power > 0:
        share = max(mission.power // working_pads(mission, zone), 1)
        slots = max(slots, (lacking + share - 1) // share)
    free[zone, pad] = begin + slots
