"""The return guard: which actions let a UAV still reach the charging zone in time.

    mask = guard(view)                                   # (R, 5), at least one action per row
    actions = np.where(mask, values, -np.inf).argmax(1)

A UAV that cannot fill its quota with its present battery must be able to reach a free cell of the
charging zone, with a margin of some slots for detours around teammates. The rules are described in
``docs/concepts/return-guard.md``. The functions below are compiled and work on the arrays of one
mission; ``chart`` is a ``dess.sea.chart.Chart``, ``reach`` the table of
``dess.sections.wind``.
"""

import math
from typing import NamedTuple

import numpy as np

from dess.code.kernels import inlined, kernel
from dess.rules import data_left
from dess.scenario import MOST_ZONES
from dess.sea.chart import distance, in_zone, is_open, length_around
from dess.sections.charging import slots_to_charge
from dess.sections.failures import working_pads
from dess.sections.landing import flies, lands
from dess.sections.radio import has_range
from dess.sections.section import for_sections
from dess.sections.wind import move_surcharge, reach_of
from dess.state import HOVER, STEP_X, STEP_Y
from dess.view import View

# Margin [cells] on the way to the zone per active teammate, since each may cause a detour.
MARGIN_PER_TEAMMATE = 2
# Data [data units] that a UAV collects in a slot near an average node, and the communication slots
# that each UAV can fill with a data unit that arrives at an empty sea.
MEAN_RATE, SLOTS_PER_PACKET = 0.3, 1.0
# Margin [slots] for the quota when little data is left, as some slots may find no data to collect.
SCARCE_SLOTS = 6
# Further margin [slots] of a UAV with teammates in missions that end on the ground.
MARGIN_LANDING = 3
# Slots before the end of a mission without a quota in which UAVs do not leave a zone any more.
LAST_SLOTS = 16
# Zone cells per UAV below which the UAVs count on the cells that teammates will take to be closed.
CELLS_PER_UAV = 4


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
    slots out of range do not count, it cannot tell, and expects to fly to the end.

    Args:
        mission: ``MISSION`` record.
        u: ``UAV`` record.
        data: Residual data of all nodes together [data units].
    """
    needed = slots_needed(mission, u)
    if has_range(mission):
        return mission.max_slots
    if data >= MEAN_RATE * needed * mission.active:
        return needed
    served = data / (MEAN_RATE * mission.active)
    arriving = SLOTS_PER_PACKET * mission.arrival_rate * mission.nodes
    share = min(arriving / mission.communication_slots, 1.0)
    if (needed - served) >= share * mission.max_slots:
        return mission.max_slots
    return int(math.ceil(served + (needed - served) / share)) + SCARCE_SLOTS


@inlined
def must_charge(mission, u, data):
    """Whether UAV ``u`` cannot fill its quota with its battery and must charge first.

    In wind, every move until then may cost the most. If little data is left, a communication slot
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
    return u.battery < mission.flight_cost * (needed + _most_wind(mission, u, needed))


@inlined
def slots_left(mission, u):
    """The slots that UAV ``u`` may fly at most: as many as it has battery [%].

    If missions end on the ground, no more than to the end of the mission.
    """
    if not lands(mission):
        return u.battery
    left = mission.max_slots - mission.slot
    return min(u.battery, left) if mission.flight_cost > 0 else left


@inlined
def _all_pads(mission):
    """The working pads of all zones together."""
    pads = 0
    for zone in range(mission.zones):
        pads += working_pads(mission, zone)
    return pads


@for_sections
def _most_wind(mission, u, slots):
    """The battery [%] that the wind costs at most in moves that take so many slots."""
    return mission.wind_most * ((slots + u.slots_per_cell - 1) // u.slots_per_cell)


@inlined
def is_parked(mission, u):
    """Whether a UAV blocks its cell: it charges or is about to charge, or is grounded.

    Shortly before the end of a mission that ends on the ground, it stands on the ground, too.
    """
    stays = u.latch
    if lands(mission):  # there the latch is set whenever a UAV may charge
        stays = u.charging or u.pad_request >= 0 or u.battery <= mission.charge_start
        stays = stays or ends_soon(mission, u)
    return u.active and (u.grounded or (stays and u.zone >= 0))


@inlined
def ends_soon(mission, u):
    """Whether UAV ``u`` does not leave a zone any more, as it has to be on the ground soon."""
    return lands(mission) and u.quota == 0 and mission.max_slots - mission.slot <= LAST_SLOTS


@inlined
def is_crowded(mission, chart, zone):
    """Whether a zone is so small that UAVs in it close the way to its other cells."""
    return chart.sizes[zone] < CELLS_PER_UAV * mission.uavs


@inlined
def _lasts(mission, u):
    """Whether the battery lasts to the end of the mission in any wind, so that only time counts."""
    left = mission.max_slots - mission.slot
    return ends_soon(mission, u) and u.battery > left * (1 + mission.wind_most)


@inlined
def path_length(mission, uavs, i, chart, planned, x, y, to_x, to_y):
    """Cells that UAV ``i`` flies from one to another, with a detour around teammates.

    Those are parked ones, and if ``planned`` is given, as in ``Parking``, those who will be.
    """
    length, between = distance(chart, x, y, to_x, to_y), 0
    for j in range(mission.uavs):
        closed_x, closed_y = _closed(mission, uavs, i, j, chart, planned)
        if closed_x >= 0:
            before = distance(chart, x, y, closed_x, closed_y)
            between += before + distance(chart, closed_x, closed_y, to_x, to_y) == length
    if between == 0:
        return length
    if between == 1 and chart.ways is None and not ends_soon(mission, uavs[i]):
        # without no-fly cells, a way that does not follow a line has others of the same length
        return length + 2 if x == to_x or y == to_y else length
    return _length_around(mission, uavs, i, chart, planned, x, y, to_x, to_y)


@inlined
def _closed(mission, uavs, i, j, chart, planned):
    """The cell that UAV ``j`` closes to UAV ``i``, or -1."""
    o = uavs[j]
    if j != i and is_parked(mission, o):
        return o.x, o.y
    if planned is not None and planned[j] >= 0:
        return np.int64(chart.parking[planned[j], 0]), np.int64(chart.parking[planned[j], 1])
    return -1, -1


@kernel
def _length_around(mission, uavs, i, chart, planned, x, y, to_x, to_y):
    """The way around all cells that teammates close.

    Or, if that is shorter, the way through and the time that a teammate charges in it, unless none
    leaves its cell any more.
    """
    width = chart.zones.shape[1]
    closed, count = np.empty(mission.uavs, np.int64), 0
    for j in range(mission.uavs):
        closed_x, closed_y = _closed(mission, uavs, i, j, chart, planned)
        if closed_x >= 0 and not (closed_x == to_x and closed_y == to_y):
            closed[count] = closed_y * width + closed_x
            count += 1
    zones, ways, rows = chart.zones, chart.ways, chart.rows
    around = length_around(zones, ways, rows, closed[:count], x, y, to_x, to_y)
    if ends_soon(mission, uavs[i]):
        return around
    lacking = mission.charge_complete - mission.charge_start
    through = distance(chart, x, y, to_x, to_y)
    return min(around, through + slots_to_charge(mission, lacking))


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
    if mission.active == 1 and reach is None and mission.zones == 1 and mission.pad_rate == 0.0:
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
        if first < 0 and _will_charge(mission, uavs[j]) and not is_parked(mission, uavs[j]):
            first = j if _plan(mission, uavs, j, -1, chart, memory, reach).lacks > 0 else -1
    if first >= 0 and _plan(mission, uavs, i, first, chart, memory, reach).lacks > lacks:
        return -1
    return first


@inlined
def _will_charge(mission, u):
    """Whether a UAV in the air cannot fill its quota with its battery, or has to land."""
    needs = u.battery < mission.flight_cost * slots_needed(mission, u)
    return flies(u) and (needs or lands(mission) or has_range(mission))


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
        will_charge = _will_charge(mission, o)
        if j != i and (o.grounded or o.pad_request >= 0 or (home_zone >= 0 and not will_charge)):
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
            wait, home_zone = waiting_time(mission, u, zone, slots, free), zone
            gives_way = np.int64(may_ask and starves and lacks == 0)
            x, y = np.int64(chart.parking[cell, 0]), np.int64(chart.parking[cell, 1])
            home = Home(x, y, np.int64(slots), np.int64(0), np.int64(lacks), gives_way)
            if u.pad_request >= 0 or not mission.plans_waits or not _plans_wait(mission, zone):
                break
        else:
            memory.planned[j] = cell
            if not will_charge or not _plans_wait(mission, zone):
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
    free = free and (mission.zones == 1 or not waiting_time(mission, u, zone, slots, memory.free))
    free = free and reach is None
    if free and path_length(mission, uavs, i, chart, None, u.x, u.y, x, y) == slots:
        return cell, slots, max(slots + 1 - u.battery, 0)
    best, best_zone, way, least, fewest = -1, -1, -1, -1, -1
    for cell in range(len(chart.parking)):
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        zone = np.int64(chart.zones[y, x])
        if (memory.taken[cell] and not (u.x == x and u.y == y)) or _is_given_up(mission, zone):
            continue
        # no detour and no wait makes a cell better than a nearer one of the same zone
        if reach is None and zone == best_zone and distance(chart, u.x, u.y, x, y) >= way:
            continue
        slots = path_length(mission, uavs, i, chart, None, u.x, u.y, x, y)
        wait = waiting_time(mission, u, zone, slots, memory.free)
        until = _battery(mission, u, chart, u.x, u.y, x, y, slots, reach)
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
def waiting_time(mission, u, zone, cells, free):
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


@inlined
def margin(mission, u):
    """The margin [%] on the way of UAV ``u`` to the zone for detours around teammates.

    A detour goes forth and back, so the wind costs the most in one direction only.
    """
    teammates = mission.active - 1
    slots = teammates * (MARGIN_PER_TEAMMATE * u.slots_per_cell + mission.wind_most)
    return slots + MARGIN_LANDING if lands(mission) and teammates > 0 else slots


@inlined
def battery_home(mission, uavs, i, chart, planned, x, y, home, reach):
    """The battery [%] that UAV ``i`` needs from a cell to its parking cell.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        chart: ``Chart``.
        x, y: The cell.
        home: ``Home``.
        reach: The table of ``reach_of``. A detour around parked teammates is not in it; each of
            its cells may cost the most.
    """
    if reach is None and is_crowded(mission, chart, chart.zones[home.y, home.x]):
        return path_length(mission, uavs, i, chart, planned, x, y, home.x, home.y)
    cells = path_length(mission, uavs, i, chart, None, x, y, home.x, home.y)
    return _battery(mission, uavs[i], chart, x, y, home.x, home.y, cells, reach)


@inlined
def _battery(mission, u, chart, x, y, home_x, home_y, cells, reach):
    """The battery [%] for a way home of so many cells, those of a detour included."""
    if reach is None:
        return cells
    if _lasts(mission, u):
        return cells * u.slots_per_cell
    dearest = u.slots_per_cell + mission.wind_most
    if reach.size == 0:  # too many cells for a table
        return cells * dearest
    detour = cells - distance(chart, x, y, home_x, home_y)
    home = chart.nearest[home_y, home_x]
    return reach[home, u.slots_per_cell - 1, y, x] + detour * dearest


@inlined
def round_trip(mission, u, chart, x, y, home, reach):
    """The battery [%] that UAV ``u`` needs to fly to a cell and from there to the zone.

    Gusts on the way out are not considered; the safe moves are what keeps the zone in reach.
    """
    cells = distance(chart, x, y, home.x, home.y)
    back = _battery(mission, u, chart, x, y, home.x, home.y, cells, reach)
    if mission.zones > 1:  # once there, another zone may be nearer
        near = chart.parking[chart.nearest[y, x]]
        cells = distance(chart, x, y, near[0], near[1])
        back = min(back, _battery(mission, u, chart, x, y, near[0], near[1], cells, reach))
    cells = distance(chart, u.x, u.y, x, y)
    if reach is None:
        return cells + back
    along_x = mission.wind_east if x > u.x else mission.wind_west
    along_y = mission.wind_south if y > u.y else mission.wind_north
    against = max(along_x * abs(x - u.x), 0.0) + max(along_y * abs(y - u.y), 0.0)
    return cells * u.slots_per_cell + int(against) + back


@inlined
def contests(mission, uavs, i):
    """Whether teammates of UAV ``i`` may occupy the cells that its actions lead to.

    Returns:
        Two bits for each action, as ``contest`` reads them: 0 if the cell is free; 1 if a teammate
        that gives way is on it; 2 if a teammate with the right of way (less battery; on a tie,
        lower index) may come or stay there; 3 if a parked teammate is on it.
    """
    u = uavs[i]
    levels = 0
    for j in range(mission.uavs):
        o = uavs[j]
        east, south = o.x - u.x, o.y - u.y
        if j == i or not o.active or abs(east) + abs(south) > 2:
            continue
        parked = is_parked(mission, o)
        goes_first = o.battery < u.battery or (o.battery == u.battery and j < i)
        for action in range(5):
            slots = abs(east - STEP_X[action]) + abs(south - STEP_Y[action])
            level = 0
            if slots == 0:
                level = 3 if parked else 2 if goes_first else 1
            elif slots == 1 and goes_first and not parked:
                level = 2
            levels += max(level - contest(levels, action), 0) << 2 * action
    return levels


@inlined
def contest(levels, action):
    """The two bits of ``contests`` for an action."""
    return levels >> 2 * action & 3


@inlined
def _is_in_the_way(mission, uavs, i):
    """Whether UAV ``i`` has just overruled a teammate that must charge and has less battery."""
    for j in range(mission.uavs):
        o = uavs[j]
        blocked = o.overruled and o.overruled_by == i and o.battery < uavs[i].battery
        if blocked and _will_charge(mission, o):
            return True
    return False


@inlined
def safe_moves(mission, uavs, i, chart, charge, home, planned, reach):
    """Find the safe actions: those after which UAV ``i`` can still reach its parking cell in time.

    If there is no such action, the actions that lead nearest to the parking cell are safe, except
    moves into a cell that a teammate with the right of way may take; the UAV may spend its margin
    to let this teammate pass. Moves off the grid, into a no-fly cell and into the cell of a parked
    teammate are never safe. A UAV that has just been overruled also avoids cells that a teammate
    may occupy: otherwise two UAVs could block each other until the battery of one of them is
    depleted. A UAV leaves its cell if a teammate that must charge has just been overruled by it.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        chart: ``Chart``.
        charge: Whether the UAV must charge; if not, every legal action is safe.
        home: The result of ``parking_cell``.
        planned: As in ``Parking``, as ``parking_cell`` leaves it.
        reach: The table of ``reach_of``.

    Returns:
        The safe actions, a bit for each.
    """
    u = uavs[i]
    if charge and (u.pad_request >= 0 or (lands(mission) and is_parked(mission, u))):
        return 1 << HOVER  # it would lose its place in the queue, or on the ground
    reserve = margin(mission, u) + home.wait if charge else 0
    # Sets of actions, a bit for each: those that no teammate with the right of way contests, those
    # that lead nearest to the parking cell, and those after which it is reached if the margin and
    # the slots for a pad are spent.
    clear = nearest = in_time = 0
    least = 1_000_000  # battery [%] that lacks on the way to the parking cell
    fewest = 1_000_000  # battery [%] that a move and the way from there need
    levels = contests(mission, uavs, i)
    for action in range(5):
        x, y = u.x + STEP_X[action], u.y + STEP_Y[action]
        # Teammates fly around a parked UAV, so it need not leave its cell for any.
        stays = action == HOVER and is_parked(mission, u)
        contested = 0 if stays else contest(levels, action)
        gives_way = charge and home.gives_way == 1 and action == HOVER
        if not is_open(chart, x, y) or contested == 3 or gives_way:
            continue
        late = 0
        if charge:
            needed = battery_home(mission, uavs, i, chart, planned, x, y, home, reach)
            needed += 1 if reach is None else _cost(mission, u, chart, action, x, y)
            # The cheapest way in wind may lead through a parked teammate; a move must do as well.
            if lands(mission) and reach is not None and home.cells > 0:
                needed = max(needed, fewest + 1) if action == HOVER else needed
                fewest = min(fewest, needed)
            # One slot is the charging slot itself; the battery must not be depleted before it.
            late = max(needed + 1 + reserve - slots_left(mission, u), 0)
        bit = 1 << action
        if contested < 2:
            clear |= bit
        if late <= reserve:
            in_time |= bit
        if late < least:
            least, nearest = late, 0
        if late == least:
            nearest |= bit
    if nearest & clear and (least > 0 or u.overruled):
        return nearest & clear
    elsewhere = nearest & clear & ~(1 << HOVER)
    if elsewhere and not is_parked(mission, u) and _is_in_the_way(mission, uavs, i):
        return elsewhere
    if least > 0 and clear & in_time:
        # these slots are there to wait or step aside until the teammate has passed
        return clear & in_time
    # Two UAVs that both insist block each other: the one without the right of way waits a slot.
    if u.overruled and not nearest & clear and (least > 0 or nearest >> HOVER & 1):
        return 1 << HOVER
    return nearest or 1 << HOVER  # who gives way may have nowhere to go


@inlined
def _cost(mission, u, chart, action, x, y):
    """The battery [%] for an action of a UAV that leads to a cell, in wind or at a low speed."""
    if action == HOVER:
        return 0 if u.latch and in_zone(chart, x, y) else 1
    if _lasts(mission, u):
        return u.slots_per_cell
    return u.slots_per_cell + move_surcharge(mission, STEP_X[action], STEP_Y[action], x, y)


@kernel
def _mask(missions, uavs, residual, rows_mission, rows_uav, chart, reach):
    masks = np.zeros((len(rows_mission), 5), np.bool_)
    memory = parking_memory(chart, uavs.shape[1])
    for row in range(len(rows_mission)):
        b, i = rows_mission[row], rows_uav[row]
        mission, team = missions[b], uavs[b]
        charge = must_charge(mission, team[i], data_left(mission, residual[b]))
        home = stays(team[i])
        if charge:
            home = parking_cell(mission, team, i, chart, memory, reach)
        safe = safe_moves(mission, team, i, chart, charge, home, memory.planned, reach)
        for action in range(5):
            masks[row, action] = safe >> action & 1
    return masks


def guard(view: View) -> np.ndarray:
    """The (R, 5) mask of the actions after which the charging zone is still reached in time.

    Every row allows at least one action. Any policy can restrict its choice to the mask.
    """
    state, chart = view.state, view.world.chart
    reach = reach_of(state.missions, chart)
    return _mask(state.missions, state.uavs, state.residual, view.mission, view.uav, chart, reach)
