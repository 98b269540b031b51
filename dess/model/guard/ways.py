"""The ways to a charging zone around parked teammates, and the battery that they take."""

import numpy as np

from dess.base.kernels import inlined, shared_kernel
from dess.model.guard.battery import cannot_leave, ends_soon, margin, usable_battery
from dess.model.state import EAST, NORTH, SOUTH, WEST
from dess.model.ways import is_calm
from dess.physics.charging import charge_limit, longest_charge
from dess.physics.chart import cost_around, distance, length_around
from dess.physics.energy import PERCENT, has_costs, max_slot_cost, slot_cost, waiting_slot
from dess.physics.landing import lands

# Zone cells per UAV below which the UAVs count on the cells that teammates will take to be closed.
CELLS_PER_UAV = 4


@inlined
def may_stand(mission, u):
    """Whether a UAV keeps its cell unless a plan tells it to leave: it charges or is about to.

    Or it is grounded. In missions that end on the ground, a UAV also stands shortly before the end,
    and if it could not leave the zone (``cannot_leave``).
    """
    stays = u.charging or u.pad_request >= 0
    if not lands(mission):
        stays = stays or u.latch
    else:  # there the latch is set whenever a UAV may charge
        stays = stays or u.battery <= mission.charge_start
        stays = stays or ends_soon(mission, u) or cannot_leave(mission, u)
    return u.active and (u.grounded or (stays and u.zone >= 0))


@inlined
def is_parked(mission, u, sizes):
    """Whether a UAV blocks its cell, as far as its state tells.

    Where all UAVs together would fill a zone, one in the air that has not yet asked for a pad may
    only fly over it.
    """
    may_fly_over = not lands(mission) and is_tight(mission, sizes)
    has_place = u.charging or u.pad_request >= 0 or u.grounded
    return may_stand(mission, u) and (has_place or not may_fly_over)


@inlined
def is_crowded(mission, chart, zone):
    """Whether a zone is so small that UAVs in it close the way to its other cells."""
    return chart.sizes[zone] < CELLS_PER_UAV * mission.uavs


@inlined
def is_tight(mission, sizes):
    """Whether all UAVs together would fill some zone."""
    fewest = mission.uavs + 1
    for zone in range(mission.zones):
        fewest = min(fewest, sizes[zone])
    return fewest <= mission.uavs


@inlined
def path_length(mission, uavs, i, chart, planned, x, y, to_x, to_y):
    """Cells that UAV ``i`` flies from one to another, with a detour around teammates.

    Those are parked ones, and if ``planned`` is given, as in ``Parking``, those who will be.
    """
    length, between, beside = distance(chart, x, y, to_x, to_y), 0, 0
    for j in range(mission.uavs):
        closed_x, closed_y = _closed(mission, uavs, i, j, chart, planned)
        if closed_x < 0:
            continue
        is_there = closed_x == to_x and closed_y == to_y
        if is_there and (planned is not None or is_tight(mission, chart.sizes)):
            continue  # it leaves the cell, or the UAV waits there for its turn in it
        before = distance(chart, x, y, closed_x, closed_y)
        more = before + distance(chart, closed_x, closed_y, to_x, to_y) - length
        between += more == 0
        beside += more == 2  # it may close the way around the one between
    if between == 0:
        return length
    is_line = x == to_x or y == to_y
    is_simple = between == 1 and chart.ways.size == 0 and not (is_line and beside > 0)
    if is_simple and not ends_soon(mission, uavs[i]):
        # without no-fly cells, a way that does not follow a line has others of the same length
        return length + 2 if is_line else length
    return _length_around(mission, uavs, i, chart, planned, x, y, to_x, to_y)


@inlined
def _closed(mission, uavs, i, j, chart, planned):
    """The cell that UAV ``j`` closes to UAV ``i``, or -1."""
    o = uavs[j]
    if j != i and is_parked(mission, o, chart.sizes):
        return o.x, o.y
    if planned is not None and planned[j] >= 0:
        return np.int64(chart.parking[planned[j], 0]), np.int64(chart.parking[planned[j], 1])
    return -1, -1


@shared_kernel
def _length_around(mission, uavs, i, chart, planned, x, y, to_x, to_y):
    """The way around all cells that teammates close.

    Or, if that is shorter, the way through and the time that a teammate charges in it, unless none
    leaves its cell any more.
    """
    closed = _closed_cells(mission, uavs, i, chart, planned, to_x, to_y)
    zones, ways, rows = chart.zones, chart.ways, chart.rows
    around = length_around(zones, ways, rows, closed, x, y, to_x, to_y)
    if ends_soon(mission, uavs[i]):
        return around
    through = distance(chart, x, y, to_x, to_y)
    return min(around, through + longest_charge(mission, uavs))


@shared_kernel
def _closed_cells(mission, uavs, i, chart, planned, to_x, to_y):
    """The numbers of the cells, counted row by row, that teammates close on the way to a cell."""
    width = chart.zones.shape[1]
    closed, count = np.empty(mission.uavs, np.int64), 0
    for j in range(mission.uavs):
        closed_x, closed_y = _closed(mission, uavs, i, j, chart, planned)
        if closed_x >= 0 and not (closed_x == to_x and closed_y == to_y):
            closed[count] = closed_y * width + closed_x
            count += 1
    return closed[:count]


@inlined
def battery_home(mission, uavs, i, chart, planned, x, y, home, reach):
    """The battery that UAV ``i`` needs from a cell to its parking cell.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        chart: ``Chart``.
        x, y: The cell.
        home: ``Home``.
        reach: ``Ways.reach``. A detour around parked teammates is not in it; each of
            its cells may cost the most.
    """
    cells = cells_home(mission, uavs, i, chart, planned, x, y, home)
    return battery_of_way(mission, uavs[i], chart, x, y, home.x, home.y, cells, reach)


@inlined
def cells_home(mission, uavs, i, chart, planned, x, y, home):
    """The cells that UAV ``i`` flies from a cell to its parking cell."""
    if is_crowded(mission, chart, chart.zones[home.y, home.x]):
        return path_length(mission, uavs, i, chart, planned, x, y, home.x, home.y)
    return path_length(mission, uavs, i, chart, None, x, y, home.x, home.y)


@shared_kernel
def is_late(mission, uavs, i, chart, planned, home, kept, reach):
    """Whether the battery of UAV ``i`` is too low for its way home and the slots that it keeps.

    In missions that end on the ground, no UAV is where a slot takes one percent: there the time may
    lack, and not the battery.
    """
    if lands(mission) and not has_costs(mission):
        return False
    u = uavs[i]
    spent = battery_home(mission, uavs, i, chart, planned, u.x, u.y, home, reach)
    return spent + waiting_slot(mission) + kept > usable_battery(mission, u)


@shared_kernel
def battery_around(mission, uavs, i, chart, planned, x, y, home, reach):
    """The battery that UAV ``i`` needs to its parking cell: the exact one, and not a bound.

    ``battery_home`` takes the detour of the shortest ways around closed cells, and the battery of
    the cheapest way, which may be another. By this, each cell of two may seem to be on the better
    way, and a UAV flies to and fro between them. Here the cheapest way around all closed cells is
    found. The arguments are those of ``battery_home``.
    """
    if reach is None or reach.size == 0:
        return np.int64(battery_home(mission, uavs, i, chart, planned, x, y, home, reach))
    if is_crowded(mission, chart, chart.zones[home.y, home.x]):
        closed = _closed_cells(mission, uavs, i, chart, planned, home.x, home.y)
    else:
        closed = _closed_cells(mission, uavs, i, chart, None, home.x, home.y)
    slots = uavs[i].slots_per_cell
    least = reach[mission.energy, chart.nearest[home.y, home.x], slots - 1].reshape((1, -1))
    waits = waiting_slot(mission) * longest_charge(mission, uavs)
    through = np.int64(least[0, y * chart.zones.shape[1] + x]) + waits
    costs = np.full(chart.zones.size, through, np.int32)
    costs[closed] = -1
    return cost_around(chart.zones, mission, slots, least, 0, costs, x, y, home.x, home.y, through)


@inlined
def battery_of_way(mission, u, chart, x, y, home_x, home_y, cells, reach):
    """The battery for a way home of so many cells, those of a detour included [% / 1000]."""
    if reach is None or len(reach) == 0:
        return PERCENT * cells
    max_cost = u.slots_per_cell * max_slot_cost(mission)
    if reach.size == 0:  # too many cells for a table
        return cells * max_cost
    detour = cells - distance(chart, x, y, home_x, home_y)
    home = chart.nearest[home_y, home_x]
    return reach[mission.energy, home, u.slots_per_cell - 1, y, x] + detour * max_cost


@inlined
def round_trip(mission, u, chart, x, y, home, reach):
    """The battery that UAV ``u`` needs to fly to a cell and from there to the zone.

    Gusts on the way out are not considered; the safe moves are what keeps the zone in reach.
    """
    cells = distance(chart, x, y, home.x, home.y)
    back = battery_of_way(mission, u, chart, x, y, home.x, home.y, cells, reach)
    if mission.zones > 1:  # once there, another zone may be nearer
        near = chart.parking[chart.nearest[y, x]]
        cells = distance(chart, x, y, near[0], near[1])
        back = min(back, battery_of_way(mission, u, chart, x, y, near[0], near[1], cells, reach))
    return _battery_to(mission, u, chart, u.x, u.y, x, y, reach) + back


@inlined
def is_beyond_battery(mission, u, chart, x, y, reach):
    """Whether UAV ``u`` cannot fly to a cell and back from the nearest zone, fully charged."""
    near = chart.parking[chart.nearest[y, x]]
    cells = distance(chart, x, y, near[0], near[1])
    spent = _battery_to(mission, u, chart, near[0], near[1], x, y, reach)
    spent += battery_of_way(mission, u, chart, x, y, near[0], near[1], cells, reach)
    kept = margin(mission, u) + waiting_slot(mission)
    return spent + kept > PERCENT * charge_limit(mission, u)


@inlined
def _battery_to(mission, u, chart, from_x, from_y, x, y, reach):
    """The battery that UAV ``u`` needs from one cell to another, without gusts."""
    cells = distance(chart, from_x, from_y, x, y)
    if is_calm(reach):
        return PERCENT * cells
    return battery_of_flight(mission, u.slots_per_cell, x - from_x, y - from_y, cells)


@inlined
def battery_of_flight(mission, slots, east, south, cells):
    """The battery for a flight, without gusts [% / 1000].

    Args:
        mission: ``MISSION`` record.
        slots: The slots that the UAV takes for a cell.
        east, south: Where it leads to [cells].
        cells: Its length, those of a detour included [cells]; these may cost the most.
    """
    along_x = slot_cost(mission, slots, EAST if east > 0 else WEST)
    along_y = slot_cost(mission, slots, SOUTH if south > 0 else NORTH)
    detour = (cells - abs(east) - abs(south)) * max_slot_cost(mission)
    return slots * (abs(east) * along_x + abs(south) * along_y + detour)


@inlined
def slots_of_round_trip(mission, u, chart, x, y):
    """The slots in which UAV ``u`` can fly to a cell, and from there to the nearest zone cell."""
    near = chart.parking[chart.nearest[y, x]]
    cells = distance(chart, u.x, u.y, x, y) + distance(chart, x, y, near[0], near[1])
    return cells * u.slots_per_cell
