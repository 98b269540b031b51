"""The return guard: which moves keep the charger reachable in time, crowding included.

Compiled functions on one mission's arrays. A UAV that cannot fill its quota on the battery it has
must be able to reach a free zone cell of its own, a few slots early if teammates may be in its way.
"""

import numpy as np

from dess.compiled import inlined, kernel
from dess.state import STEP_X, STEP_Y
from dess.view import View

# Slots in hand on the way home: per active teammate, since each may cost a detour.
MARGIN_PER_TEAMMATE = 2
# Slots in hand for the quota when the sea is nearly empty and communication slots may be lost.
SCARCE_SLOTS = 6


@inlined
def slots_needed(mission, u):
    """Flying slots until the quota of UAV ``u`` is filled if it communicates in all of them."""
    m = mission.communication_slots
    return (mission.quota - u.communications + m - 1) // m


@inlined
def must_charge(mission, u, data):
    """Whether UAV ``u`` cannot fill its quota on its battery; ``data`` is all residual data.

    With little data left a communication slot may find no node to serve: then some in hand. Where
    flying costs no battery, nobody must charge.
    """
    needed = slots_needed(mission, u)
    # What a UAV takes beside an average node; below it per needed slot the sea is nearly empty.
    if data < 0.2 * needed * mission.active:
        needed += SCARCE_SLOTS
    return u.battery < mission.flight_cost * needed


@inlined
def is_parked(mission, u):
    """Whether an active UAV in the zone is charging or about to: an obstacle to the others."""
    return (
        u.active
        and u.latch
        and mission.zone_x <= u.x < mission.zone_x + mission.zone_width
        and mission.zone_y <= u.y < mission.zone_y + mission.zone_height
    )


@inlined
def path_length(mission, uavs, i, x, y, to_x, to_y):
    """Slots of UAV ``i`` from cell to cell, with the detour around a teammate parked between."""
    length = abs(x - to_x) + abs(y - to_y)
    if x == to_x or y == to_y:
        for j in range(mission.uavs):
            o = uavs[j]
            if j != i and is_parked(mission, o):
                between = abs(x - o.x) + abs(y - o.y) + abs(to_x - o.x) + abs(to_y - o.y)
                if between == length:
                    return length + 2
    return length


@kernel
def parking_cell(mission, uavs, i, taken):
    """The zone cell where UAV ``i`` will charge: the nearest one that no teammate has or chooses.

    Teammates in the zone have their cells. The others choose one after another, the lowest battery
    first (ties in index order), so no two UAVs head for the same cell.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        taken: (zone cells,) working memory.

    Returns:
        x, y and the slots it takes to get there; its own cell if all are taken.
    """
    width, cells = mission.zone_width, mission.zone_width * mission.zone_height
    me = uavs[i]
    taken[:cells] = False
    for j in range(mission.uavs):
        if j != i and uavs[j].active:
            zone_x, zone_y = uavs[j].x - mission.zone_x, uavs[j].y - mission.zone_y
            if 0 <= zone_x < width and 0 <= zone_y < mission.zone_height:
                taken[zone_y * width + zone_x] = True
    last_battery, last = -1, -1
    while True:
        # the next one to choose
        chooser = -1
        for j in range(mission.uavs):
            o = uavs[j]
            if (
                not o.active
                or o.battery < last_battery
                or (o.battery == last_battery and j <= last)
            ):
                continue
            if chooser < 0 or o.battery < uavs[chooser].battery:
                chooser = j
        last_battery, last = uavs[chooser].battery, chooser
        if chooser != i and is_parked(mission, uavs[chooser]):
            continue
        x, y, slots = _nearest_free(mission, uavs, chooser, taken)
        if chooser == i:
            return (me.x, me.y, 0) if slots < 0 else (x, y, slots)
        if slots >= 0:
            taken[(y - mission.zone_y) * width + x - mission.zone_x] = True


@inlined
def _nearest_free(mission, uavs, i, taken):
    """The nearest zone cell that is not taken, and the slots to it (-1 without any)."""
    u = uavs[i]
    best_x, best_y, best = -1, -1, -1
    for cell in range(mission.zone_width * mission.zone_height):
        x = mission.zone_x + cell % mission.zone_width
        y = mission.zone_y + cell // mission.zone_width
        if taken[cell] and not (u.x == x and u.y == y):
            continue
        slots = path_length(mission, uavs, i, u.x, u.y, x, y)
        if best < 0 or slots < best:
            best_x, best_y, best = x, y, slots
    return best_x, best_y, best


@inlined
def margin(mission):
    """Slots to keep in hand on the way home for the teammates that may stand in it."""
    return MARGIN_PER_TEAMMATE * (mission.active - 1)


@inlined
def contest(mission, uavs, i, x, y):
    """How a cell is contested by teammates of UAV ``i`` in the next slot.

    Returns:
        0 free; 1 a teammate that gives way is on it; 2 a teammate with the right of way (less
        battery, ties: lower index) may come or stay there; 3 a parked teammate is on it.
    """
    u = uavs[i]
    level = 0
    for j in range(mission.uavs):
        o = uavs[j]
        if j == i or not o.active:
            continue
        slots = abs(o.x - x) + abs(o.y - y)
        if is_parked(mission, o):
            if slots == 0:
                return 3
        elif slots <= 1 and (o.battery < u.battery or (o.battery == u.battery and j < i)):
            level = 2
        elif slots == 0:
            level = max(level, 1)
    return level


@kernel
def safe_moves(mission, uavs, i, charge, home_x, home_y, safe):
    """Which actions keep the charger of UAV ``i`` reachable in time.

    Without any such action those are left that come nearest to the charger, but for cells that a
    teammate with the right of way may take: to let it pass, the margin may be used.
    Cells off the grid and cells of parked teammates are never safe. A UAV that has just been
    overruled leaves such contested cells to the teammates as well: two that both insist would
    block each other until one runs dry.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        charge: Whether it must charge; without, every legal action is safe.
        home_x, home_y: Its parking cell.
        safe: (5,) mask, overwritten.
    """
    u = uavs[i]
    late = np.zeros(5, np.int64)  # slots by which the charger would be reached too late
    contested = np.empty(5, np.int64)
    least = 1_000_000
    for action in range(5):
        x, y = u.x + STEP_X[action], u.y + STEP_Y[action]
        safe[action] = 0 <= x < mission.grid and 0 <= y < mission.grid
        contested[action] = contest(mission, uavs, i, x, y)
        safe[action] = safe[action] and contested[action] < 3
        if safe[action] and charge:
            home = path_length(mission, uavs, i, x, y, home_x, home_y)
            # One slot is for the charging slot itself: the battery must not be empty by then.
            late[action] = max(home + 1 + margin(mission) - (u.battery - 1), 0)
            least = min(least, late[action])
    clear = safe & (contested < 2)
    nearest = safe & (late == least) if charge else safe.copy()
    if (nearest & clear).any() and (late[nearest].any() or u.overruled):
        safe[:] = nearest & clear
    elif late[nearest].any() and clear.any():
        # to wait or step aside until the teammate has passed is what the margin is for
        wait = clear & (late <= margin(mission))
        safe[:] = wait if wait.any() else nearest
    else:
        safe[:] = nearest


@kernel
def _mask(missions, uavs, residual, rows_mission, rows_uav):
    masks = np.zeros((len(rows_mission), 5), np.bool_)
    taken = np.empty(missions[0].grid * missions[0].grid, np.bool_)
    for row in range(len(rows_mission)):
        b, i = rows_mission[row], rows_uav[row]
        mission, team = missions[b], uavs[b]
        charge = must_charge(mission, team[i], residual[b].sum())
        home_x, home_y = 0, 0
        if charge:
            home_x, home_y, _ = parking_cell(mission, team, i, taken)
        safe_moves(mission, team, i, charge, home_x, home_y, masks[row])
    return masks


def guard(view: View) -> np.ndarray:
    """(R, 5) mask of the actions from which the charger is still reached in time.

    Every row has at least one. Policies of any kind can restrict their choice to it.
    """
    state = view.state
    return _mask(state.missions, state.uavs, state.residual, view.mission, view.uav)
