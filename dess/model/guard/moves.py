"""The safe moves: those after which a UAV still reaches the charging zone in time.

A UAV is in time if some legal action leaves it the battery for the way to its parking cell, for its
margin and its wait for a pad; else it is late. Moves off the grid, into a no-fly cell and into the
cell of a parked teammate are not legal. ``Moves`` has the legal actions in sets: the *nearest* lead
best to the parking cell (all of them if the UAV need not charge), no teammate with the right of way
contests the *clear*, none at all the *empty*, and those *in time* lead there if the margin is
spent. The first case that applies tells the safe actions:

| the UAV | safe |
| --- | --- |
| 1. must charge, and has asked for a pad or stands on the ground | hovering |
| 2. has just overruled a teammate that must charge, and is not parked | ``_leaving_moves`` |
| 2a. has a nearest move that is empty, or else clear | it |
| 2b. has none, in every second slot | the nearest moves that hinder none that comes to charge |
| 2c. was overruled itself in a small zone | one move after another |
| 3. is in time, was overruled, and has nearest that are empty | these |
| 4. is late, and has nearest that are clear | these; nearer to a zone in wind or to small zones |
| 5. was overruled, and has nearest that are clear | these |
| 6. is late, and has others that are clear and in time | ``aside``: they let the teammate pass |
| 7. was overruled, and is late or may hover | hovering, as two that insist block each other |
| 8. is in time where teammates are near | the nearest, without those that hinder who must charge |
| 9. any other | the nearest |

What leaves no action is left out, and a UAV without any hovers. In missions that end on the ground,
who must charge and is in time does not take cells that teammates count on (3 to 9), and who makes
way may hinder others if no move is left in 2b.
"""

from typing import NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.model.guard.battery import (
    late_slots,
    margin,
    margin_slots,
    must_charge,
    usable_battery,
    will_charge,
)
from dess.model.guard.parking import HOME, parking_cell, parking_memory, stays, write_home
from dess.model.guard.queues import forget_plan, waits_in_zone
from dess.model.guard.ways import (
    battery_around,
    battery_of_way,
    cells_home,
    is_late,
    is_parked,
    is_tight,
    may_stand,
)
from dess.model.rules import data_left
from dess.model.state import HOVER, STEP_X, STEP_Y
from dess.model.view import View
from dess.model.ways import is_calm
from dess.physics.charging import longest_charge
from dess.physics.chart import distance, in_zone, is_open
from dess.physics.energy import (
    PERCENT,
    has_costs,
    max_slot_cost,
    move_cost,
    slot_cost,
    waiting_slot,
)
from dess.physics.landing import lands

_MOST_BATTERY = 2**40  # more than any way costs
_FARTHEST = 2**40  # more than any way is long [cells]


@inlined
def _stands(mission, uavs, j, sizes, turns):
    """Whether UAV ``j`` keeps teammates out of its cell.

    Where there is a plan, it tells who is about to leave its cell. A teammate flies into the cell
    that is left: around it, both might come to each other's way again and again.
    """
    if turns is None or not is_tight(mission, sizes):
        return is_parked(mission, uavs[j], sizes)
    return may_stand(mission, uavs[j]) and not turns[j].leaves


@inlined
def contests(mission, uavs, i, sizes, turns):
    """Whether teammates of UAV ``i`` may occupy the cells that its actions lead to.

    ``turns`` are those of ``parking_memory``, or None.

    Returns:
        Two bits for each action, as ``contest`` reads them: 0 if the cell is free; 1 if a teammate
        that gives way is on it; 2 if a teammate with the right of way (less battery; on a tie,
        lower index) may come or stay there; 3 if a parked teammate is on it, or near small zones
        one that waits in its cell and has just overruled the UAV.
    """
    u = uavs[i]
    levels = 0
    for j in range(mission.uavs):
        o = uavs[j]
        east, south = o.x - u.x, o.y - u.y
        if j == i or not o.active or abs(east) + abs(south) > 2:
            continue
        parked = _stands(mission, uavs, j, sizes, turns)
        if turns is not None and u.overruled and u.overruled_by == j and waits_in_zone(mission, o):
            parked = parked or is_tight(mission, sizes)  # or it would overrule it again and again
        goes_first = o.battery < u.battery or (o.battery == u.battery and j < i)
        for action in range(5):
            slots = abs(east - STEP_X[action]) + abs(south - STEP_Y[action])
            level = 0
            if slots == 0:
                level = 3 if parked else 2 if goes_first else 1
            elif slots == 1 and goes_first and not parked and not waits_in_zone(mission, o):
                level = 2
            levels += max(level - contest(levels, action), 0) << 2 * action
    return levels


@inlined
def contest(levels, action):
    """The two bits of ``contests`` for an action."""
    return levels >> 2 * action & 3


@inlined
def _ceded(mission, uavs, i, sizes, turns):
    """The actions of UAV ``i`` that may hinder teammates with less battery which come to charge.

    Returns:
        A bit for each action.
    """
    u = uavs[i]
    actions = 0
    for j in range(mission.uavs):
        o = uavs[j]
        east, south = o.x - u.x, o.y - u.y
        goes_first = o.battery < u.battery or (o.battery == u.battery and j < i)
        if j == i or not goes_first or abs(east) + abs(south) > 2:
            continue
        if not o.latch or not will_charge(mission, o):
            continue
        if _stands(mission, uavs, j, sizes, turns):
            continue
        for action in range(5):
            slots = abs(east - STEP_X[action]) + abs(south - STEP_Y[action])
            if slots <= 1:
                actions |= 1 << action
    return actions


@inlined
def _into_cells_of_others(mission, uavs, i, chart, memory):
    """The moves of UAV ``i`` into zone cells that teammates count on.

    Those are teammates that choose before it or have less battery. If such a cell was taken shortly
    before the teammate comes, it would have to fly on to another.

    Returns:
        A bit for each action.
    """
    u, moves = uavs[i], 0
    for j in range(mission.uavs):
        cell = memory.planned[j]
        if cell < 0 and uavs[j].battery < u.battery:
            cell = memory.plan.turns[j].cell
        if j == i or cell < 0:
            continue
        x, y = chart.parking[cell, 0], chart.parking[cell, 1]
        for action in range(4):
            if u.x + STEP_X[action] == x and u.y + STEP_Y[action] == y:
                moves |= 1 << action
    return moves


@inlined
def _is_in_the_way(mission, uavs, i):
    """Whether UAV ``i`` has just overruled a teammate that must charge and has less battery.

    Or it has overruled one that could not leave its cell for such a teammate, and so on.
    """
    for j in range(mission.uavs):
        if uavs[j].battery >= uavs[i].battery or not will_charge(mission, uavs[j]):
            continue
        blocked = j
        for _ in range(mission.uavs):
            if not uavs[blocked].active or not uavs[blocked].overruled:
                break
            blocked = uavs[blocked].overruled_by
            if blocked == i:
                return True
            if blocked < 0:
                break
    return False


class Moves(NamedTuple):
    """The legal actions of a UAV in sets, a bit for each action.

    Attributes:
        nearest: Those after which the least battery lacks on the way to the parking cell.
        in_time: Those after which it is reached if the margin and the slots for a pad are spent.
        clear: Those that no teammate with the right of way contests.
        empty: Those that no teammate contests.
        aside: Those that are clear and in time. Where missions end on the ground, those of them
            with the least delay: hovering takes one slot, a move to the side and back takes two.
        lacking: The battery that lacks after the nearest [% / 1000].
    """

    nearest: int
    in_time: int
    clear: int
    empty: int
    aside: int
    lacking: int


@inlined
def safe_moves(mission, uavs, i, chart, charge, home, memory, reach):
    """Find the safe actions, by the table of cases in the text of this module.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        chart: ``Chart``.
        charge: Whether the UAV must charge; if not, every legal action is safe.
        home: The result of ``parking_cell``.
        memory: ``parking_memory``, as ``parking_cell`` leaves it.
        reach: ``Ways.reach``.

    Returns:
        The safe actions, a bit for each.
    """
    u = uavs[i]
    turns = memory.plan.turns
    parked = _stands(mission, uavs, i, chart.sizes, turns)
    if charge and _keeps_its_place(mission, u, parked):
        return 1 << HOVER
    levels = contests(mission, uavs, i, chart.sizes, turns)
    # Teammates fly around a parked UAV, so it need not leave its cell for any.
    contested = levels & ~(3 << 2 * HOVER) if parked else levels
    moves = _sort_moves(mission, uavs, i, chart, charge, home, memory.planned, contested, reach)
    if not parked:
        leaving = _leaving_moves(mission, uavs, i, chart, turns, moves)
        if leaving:
            return leaving
    if charge and moves.lacking == 0 and lands(mission):
        nearest = moves.nearest & ~_into_cells_of_others(mission, uavs, i, chart, memory)
        nearest = nearest or moves.nearest
        in_time, clear, empty, aside = moves.in_time, moves.clear, moves.empty, moves.aside
        moves = Moves(nearest, in_time, clear, empty, aside, moves.lacking)
    return _choose_moves(mission, uavs, i, chart, home, turns, moves, levels)


@inlined
def _keeps_its_place(mission, u, parked):
    """Whether a UAV that must charge would lose its place in a queue, or on the ground."""
    return u.pad_request >= 0 or (lands(mission) and parked)


@inlined
def _sort_moves(mission, uavs, i, chart, charge, home, planned, contested, reach):
    """The ``Moves`` of UAV ``i``; ``contested`` are the levels of its actions."""
    u = uavs[i]
    nearest = in_time = clear = empty = aside = 0
    least = _MOST_BATTERY  # the battery that lacks on the way to the parking cell
    least_aside = _MOST_BATTERY
    fewest = _MOST_BATTERY  # the battery that a move and the way from there need
    reserve = margin(mission, u) + waiting_slot(mission) * home.wait if charge else 0
    searches = charge and not is_calm(reach)
    if searches:
        searches = is_late(mission, uavs, i, chart, planned, home, reserve, reach)
    for action in range(5):
        x, y = u.x + STEP_X[action], u.y + STEP_Y[action]
        level = contest(contested, action)
        if not _is_legal(chart, x, y, level):
            continue
        if charge and _asks_too_early(chart, u, home, action):
            continue
        late = 0
        if charge:
            cells = cells_home(mission, uavs, i, chart, planned, x, y, home)
            if searches:
                needed = battery_around(mission, uavs, i, chart, planned, x, y, home, reach)
            else:
                needed = battery_of_way(mission, u, chart, x, y, home.x, home.y, cells, reach)
            needed += PERCENT if is_calm(reach) else _cost(mission, u, chart, action, x, y)
            if action == HOVER and not is_calm(reach) and _must_move(mission, uavs, u, chart, home):
                needed = max(needed, fewest + _least_difference(mission))
            fewest = min(fewest, needed)
            kept = max(reserve, _wait(mission, u, chart, action, x, y, home, reach))
            # One slot is the charging slot itself; the battery must not be depleted before it.
            late = max(needed + waiting_slot(mission) + kept - usable_battery(mission, u), 0)
            late = max(late, _late_home(mission, u, action, cells))
        bit = 1 << action
        if level == 0:
            empty |= bit
        if level < 2:
            clear |= bit
        if late <= reserve:
            in_time |= bit
        if lands(mission) and late <= reserve and level < 2:
            if late < least_aside:
                least_aside, aside = late, 0
            if late == least_aside:
                aside |= bit
        if late < least:
            least, nearest = late, 0
        if late == least:
            nearest |= bit
    if not lands(mission):
        aside = clear & in_time
    return Moves(nearest, in_time, clear, empty, aside, least)


@inlined
def _is_legal(chart, x, y, level):
    """Whether a cell is open, and no teammate is parked on it."""
    return level != 3 and is_open(chart.zones, x, y)


@inlined
def _asks_too_early(chart, u, home, action):
    """Whether a UAV would ask for a pad, and it or a teammate would run empty.

    It would if it hovered in another zone than the one that the plan of pads tells.
    """
    asks_elsewhere = home.begins > 0 and u.latch and u.zone >= 0
    asks_elsewhere = asks_elsewhere and u.zone != chart.zones[home.y, home.x]
    return action == HOVER and (home.gives_way == 1 or asks_elsewhere)


@inlined
def _leaving_moves(mission, uavs, i, chart, turns, moves):
    """The actions by which UAV ``i`` leaves its cell if it stands in the way; 0 if it may stay."""
    elsewhere = moves.nearest & ~(1 << HOVER)
    if not elsewhere or not _is_in_the_way(mission, uavs, i):
        return 0
    u = uavs[i]
    leaving = elsewhere & moves.empty or elsewhere & moves.clear
    if not leaving and mission.slot % 2 == 1:  # in the other slots, it lets them go first
        leaving = elsewhere & ~_ceded(mission, uavs, i, chart.sizes, turns)
        if lands(mission):  # there all teammates may come to charge
            leaving = leaving or elsewhere
    if u.overruled and u.zone >= 0 and is_tight(mission, chart.sizes):
        # A teammate may want the same cell again and again, so it tries one after another, and
        # lets the teammate go first in some slots.
        aside = moves.clear & moves.in_time & ~(1 << HOVER)
        leaving = _one_of(leaving or aside or elsewhere | 1 << HOVER, mission.slot)
    return leaving


@inlined
def _choose_moves(mission, uavs, i, chart, home, turns, moves, levels):
    """The safe actions of UAV ``i`` that neither keeps its place nor leaves it for a teammate."""
    u = uavs[i]
    is_late = moves.lacking > 0
    uncontested = moves.nearest & moves.clear
    if u.overruled and not is_late and moves.nearest & moves.empty:
        return moves.nearest & moves.empty
    if uncontested and is_late and (has_costs(mission) or is_tight(mission, chart.sizes)):
        return _nearer_to_zone(chart, u, home, uncontested)
    if uncontested and (is_late or u.overruled):
        return uncontested
    if is_late and moves.aside:
        return moves.aside
    if u.overruled and (is_late or moves.nearest >> HOVER & 1):
        return 1 << HOVER
    if not is_late and levels > 0:
        yielding = moves.nearest & ~_ceded(mission, uavs, i, chart.sizes, turns)
        return yielding or moves.nearest or 1 << HOVER
    return moves.nearest or 1 << HOVER  # who gives way may have nowhere to go


@inlined
def _one_of(actions, number):
    """One of some actions, which differs from number to number."""
    while not actions >> number % 5 & 1:
        number += 1
    return 1 << number % 5


@inlined
def _late_home(mission, u, action, cells):
    """What lacks if an action brings a UAV home too late, as the battery of the slots that lack.

    ``cells`` are those of the way from the cell to which the action leads.
    """
    if not has_costs(mission):
        return 0
    slots = cells * u.slots_per_cell + (1 if action == HOVER else u.slots_per_cell)
    return waiting_slot(mission) * late_slots(mission, slots + 1 + margin_slots(mission, u))


@inlined
def _nearer_to_zone(chart, u, home, actions):
    """Those of some actions that lead UAV ``u`` nearer to its charging zone; all if none does.

    Two parking cells may be equally far, and a UAV that is late must not change between them.
    """
    nearer = 0
    cells = _cells_to_zone(chart, home, u.x, u.y)
    for action in range(5):
        x, y = u.x + STEP_X[action], u.y + STEP_Y[action]
        if actions >> action & 1 and _cells_to_zone(chart, home, x, y) < cells:
            nearer |= 1 << action
    return nearer or actions


@inlined
def _cells_to_zone(chart, home, x, y):
    """The cells on the way from a cell to the zone where a UAV will charge."""
    zone, least = chart.zones[home.y, home.x], _FARTHEST
    for cell in range(len(chart.parking)):
        to_x, to_y = chart.parking[cell, 0], chart.parking[cell, 1]
        if chart.zones[to_y, to_x] == zone:
            least = min(least, distance(chart, x, y, to_x, to_y))
    return least


@inlined
def _must_move(mission, uavs, u, chart, home):
    """Whether hovering counts as worse than the best move of UAV ``u`` to its parking cell.

    The cheapest way may lead through a parked teammate; then a move must do as well. Only a UAV
    that is shut out can but wait until a teammate has charged that is parked on its way.
    """
    if home.cells == 0:
        return False
    detour = home.cells - distance(chart, u.x, u.y, home.x, home.y)
    return detour < longest_charge(mission, uavs)


@inlined
def _wait(mission, u, chart, action, x, y, home, reach):
    """The battery that a UAV keeps in wind for its wait for a pad if it comes after an action.

    In still air, it may as well fly about until its turn comes. In wind, this costs more than the
    slots that it takes, and so does a detour of two cells around a parked teammate.
    """
    if is_calm(reach) or home.cells == 0:
        return 0
    slots = 1 if action == HOVER else u.slots_per_cell
    arrives = slots + distance(chart, x, y, home.x, home.y) * u.slots_per_cell
    if home.begins <= arrives:
        return 0
    battery = (home.begins - arrives) * waiting_slot(mission)
    if has_costs(mission):
        battery += 2 * max_slot_cost(mission)
    return battery


@inlined
def _cost(mission, u, chart, action, x, y):
    """The battery for an action of a UAV that leads to a cell [% / 1000]."""
    if action == HOVER:
        if in_zone(chart, x, y) and u.latch:
            return 0
        if not has_costs(mission):
            return PERCENT
        if in_zone(chart, x, y) and lands(mission):
            return 0
        return slot_cost(mission, u.slots_per_cell, HOVER)
    return move_cost(mission, u.slots_per_cell, action, x, y)


@inlined
def _least_difference(mission):
    """The least by which the battery for one way may exceed that for another [% / 1000]."""
    if has_costs(mission):
        return 1
    return PERCENT


class Guidance(NamedTuple):
    """What the guard tells UAVs, one row for each.

    Attributes:
        charge: (R,) whether the UAV must charge.
        home: (R,) ``HOME`` records: where it will charge.
        safe: (R,) its safe actions, a bit for each.
    """

    charge: np.ndarray
    home: np.ndarray
    safe: np.ndarray


@kernel
def guide(missions, uavs, residual, rows_mission, rows_uav, chart, reach, find_all):
    """The ``Guidance`` for UAVs.

    Call it from Python: a compiled function that called it would be compiled with the whole guard,
    which takes seconds.

    Args:
        missions: (B,) ``MISSION`` records.
        uavs: (B, I) ``UAV`` records.
        residual: (B, K) data of the nodes [data units].
        rows_mission: (R,) index of each row's mission, in ascending order.
        rows_uav: (R,) index of each row's UAV in its mission.
        chart: ``Chart``.
        reach: ``Ways.reach``.
        find_all: Whether to find the parking cells of UAVs that need not charge, too; without, such
            a UAV has its present cell.
    """
    charges = np.empty(len(rows_mission), np.bool_)
    homes = np.empty(len(rows_mission), HOME)
    safe = np.empty(len(rows_mission), np.int64)
    memory = parking_memory(chart, uavs.shape[1])
    last = -1
    data = 0.0
    for row in range(len(rows_mission)):
        b, i = rows_mission[row], rows_uav[row]
        mission, team = missions[b], uavs[b]
        if b != last:
            last = b
            data = data_left(mission, residual[b])
        charges[row], home, safe[row] = guide_uav(
            mission, team, i, data, chart, memory, reach, find_all
        )
        write_home(homes[row], home)
    return Guidance(charges, homes, safe)


@inlined
def guide_uav(mission, uavs, i, data, chart, memory, reach, find_home):
    """What the guard tells UAV ``i``: whether it must charge, where, and its safe actions.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        data: Residual data of all nodes together [data units].
        chart: ``Chart``.
        memory: ``parking_memory``.
        reach: ``Ways.reach``.
        find_home: Whether to find its parking cell if it need not charge, too; without, this is its
            present cell.
    """
    charge = must_charge(mission, uavs[i], data)
    home = stays(uavs[i])
    if charge or find_home:
        home = parking_cell(mission, uavs, i, data, chart, memory, reach)
    if not charge and is_tight(mission, chart.sizes):  # its moves do not depend on ``find_home``
        forget_plan(mission, memory.plan)
    return charge, home, safe_moves(mission, uavs, i, chart, charge, home, memory, reach)


def guard(view: View) -> np.ndarray:
    """The (R, 5) mask of the actions after which the charging zone is still reached in time.

    Every row allows at least one action. Any policy can restrict its choice to the mask.
    """
    state, chart, reach = view.state, view.world.chart, view.ways.reach
    guidance = guide(
        state.missions, state.uavs, state.residual, view.mission, view.uav, chart, reach, False
    )
    return (guidance.safe[:, None] >> np.arange(5) & 1).astype(bool)
