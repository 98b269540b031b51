"""The search for a plan: simulated annealing over the waypoints of the whole team.

    value = improve(mission, uavs, residual, nodes, rates, plan, 20_000, 2.0)

Each step edits the plan, flies it in the fluid model from the first slot that the edit can change,
and keeps the edit or takes it back (S. Kirkpatrick, C. Gelatt, M. Vecchi, *Optimization by
simulated annealing*, 1983). All random numbers are functions of the mission, the slot and the step.
"""

import math

import numpy as np

from dess import streams
from dess.code.kernels import inlined, kernel
from dess.rules import in_zone, on_grid, zone_cell
from dess.state import STEP_X, STEP_Y
from policies.planner.fluid import (
    CELL_X,
    CELL_Y,
    CHARGE,
    MOST_SLOTS,
    MOST_WAYPOINTS,
    NEXT,
    ORDER,
    STAY,
    STRIDE,
    Plan,
    begin,
    copy_snapshot,
    empty_flight,
    fly,
)

# The temperature [data units] falls to this in the last step.
_COLDEST = 0.03
# How often each edit is tried, in percent.
_INSERT, _REMOVE, _MOVE, _SWAP, _STAY, _TURN, _NUDGE, _REVERSE, _CHARGE = range(9)
_KINDS = np.repeat(np.arange(9), [30, 10, 14, 8, 12, 6, 12, 4, 4])
# How often a waypoint is inserted where its detour is the shortest, in 1/65536.
_SHORTEST = 45_000
_NO_EDIT = -1
_LOW = np.uint64(0xFFFF)
_HIGH = np.uint64(16)


@kernel
def empty_plan(uavs):
    """A plan of that many UAVs without waypoints."""
    return Plan(np.zeros((uavs, MOST_WAYPOINTS, 4), np.int16), np.zeros(uavs, np.int64))


@kernel
def copy_plan(source, target):
    """Make one plan equal to another."""
    for i in range(len(source.lengths)):
        target.lengths[i] = source.lengths[i]
        for w in range(source.lengths[i]):
            for column in range(4):
                target.waypoints[i, w, column] = source.waypoints[i, w, column]


@kernel
def improve(mission, uavs, residual, nodes, rates, plan, steps, hottest):
    """Improve a plan in place, and return its value in the fluid model; it is never worse.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        residual: (K,) residual data [data units].
        nodes: (K, 2) cells of the nodes.
        rates: ``Rates``.
        plan: ``Plan``, changed.
        steps: Number of edits to try.
        hottest: The temperature of the first step [data units].
    """
    slots = min(mission.max_slots - mission.slot, MOST_SLOTS)
    flight = empty_flight(slots, mission.uavs, mission.nodes)
    trial_flight = empty_flight(slots, mission.uavs, mission.nodes)
    begin(mission, uavs, residual, flight)
    value = fly(mission, uavs, rates, plan, flight, 0, flight, slots)
    best, present, trial = value, empty_plan(len(plan.lengths)), empty_plan(len(plan.lengths))
    copy_plan(plan, present)
    copy_plan(plan, trial)
    words = np.empty(4, np.uint64)
    heat, cooling = hottest, (_COLDEST / hottest) ** (1.0 / max(steps, 1))
    for step in range(steps):
        heat *= cooling
        words[0], words[1], words[2], words[3] = streams.block(
            mission.seed, mission.replication, streams.PLAN, 0, mission.slot, step
        )
        slot = _edit(mission, uavs, nodes, flight, trial, words)
        if slot == _NO_EDIT:
            continue
        if slot >= flight.last[1]:
            copy_plan(present, trial)
            continue
        new = fly(mission, uavs, rates, trial, flight, slot // STRIDE, trial_flight, slots)
        luck = streams.uniform(words[0] >> _HIGH << _HIGH | words[3] & _LOW)
        if new >= value or new - value > heat * math.log(luck):
            value = new
            _keep(mission, trial_flight, flight, slot // STRIDE)
            for i in range(mission.uavs):  # waypoints that are not reached are of no use
                trial.lengths[i] = min(trial.lengths[i], flight.team[flight.last[0], i, NEXT] + 1)
            copy_plan(trial, present)
            if value > best:
                best = value
                copy_plan(present, plan)
        else:
            copy_plan(present, trial)
    return best


@kernel
def _keep(mission, trial, flight, first):
    """Make a flight that of a trial, which was flown from a snapshot on."""
    for s in range(first, trial.last[0] + 1):
        copy_snapshot(trial, s, flight, s)
        flight.sums[s, 0], flight.sums[s, 1] = trial.sums[s, 0], trial.sums[s, 1]
    flight.last[0], flight.last[1] = trial.last[0], trial.last[1]
    for i in range(mission.uavs):
        for w in range(flight.begun.shape[1]):
            flight.begun[i, w] = trial.begun[i, w]


@inlined
def _pick(word, count):
    """A number below ``count``, of the upper half of a random word."""
    return np.int64((word >> _HIGH) * np.uint64(count) >> _HIGH)


@inlined
def _pick_low(word, count):
    """A number below ``count``, of the lower half of a random word."""
    return np.int64((word & _LOW) * np.uint64(count) >> _HIGH)


@kernel
def _edit(mission, uavs, nodes, flight, plan, words):
    """Edit a plan at random; return the first slot that this may change, ``NEVER`` if no edit."""
    kind, i = _KINDS[_pick(words[0], len(_KINDS))], _pick(words[1], mission.uavs)
    if not uavs[i].active:
        return _NO_EDIT
    p = _pick_low(words[1], plan.lengths[i] + (kind in (_INSERT, _CHARGE)))
    if kind == _INSERT:
        return _insert_node(mission, uavs, nodes, flight, plan, i, p, words)
    if kind == _CHARGE:
        return _edit_charge(mission, flight, plan, i, p, words)
    if plan.lengths[i] == 0:
        return _NO_EDIT
    slot = flight.begun[i, p]
    way = plan.waypoints[i]
    if kind == _REMOVE:
        remove(plan, i, p)
    elif kind == _TURN:
        way[p, ORDER] = 1 - way[p, ORDER]
    elif kind == _STAY:
        if way[p, STAY] == CHARGE:
            return _NO_EDIT
        way[p, STAY] = max(way[p, STAY] + 1 - 2 * _pick(words[2], 2), 0)
    elif kind == _NUDGE:
        action = _pick(words[2], 4)
        x, y = way[p, CELL_X] + STEP_X[action], way[p, CELL_Y] + STEP_Y[action]
        if not on_grid(mission, x, y) or (way[p, STAY] == CHARGE and not in_zone(mission, x, y)):
            return _NO_EDIT
        way[p, CELL_X], way[p, CELL_Y] = x, y
    elif kind == _REVERSE:
        q = min(p + 1 + _pick(words[2], 5), plan.lengths[i] - 1)
        while p < q:
            _swap(way, p, way, q)
            p, q = p + 1, q - 1
    else:
        j = _pick(words[2], mission.uavs)
        if not uavs[j].active:
            return _NO_EDIT
        return _exchange(mission, flight, plan, kind, i, p, j, words)
    return slot


@kernel
def _exchange(mission, flight, plan, kind, i, p, j, words):
    """Move waypoint ``p`` of UAV ``i`` to UAV ``j``, or swap it with one of its."""
    slot = flight.begun[i, p]
    x, y, stay, order = plan.waypoints[i, p]
    if kind == _MOVE:
        if j != i and (stay == CHARGE or plan.lengths[j] == MOST_WAYPOINTS):
            return _NO_EDIT
        remove(plan, i, p)
        q = _pick(words[3], plan.lengths[j] + 1)
        if stay != CHARGE and _pick_low(words[2], 1 << 16) < _SHORTEST:
            q = _shortest_detour(mission, flight, plan, j, x, y)
        insert(plan, j, q, x, y, stay, order)
    else:
        if plan.lengths[j] == 0:
            return _NO_EDIT
        q = _pick(words[3], plan.lengths[j])
        if j != i and (stay == CHARGE or plan.waypoints[j, q, STAY] == CHARGE):
            return _NO_EDIT
        _swap(plan.waypoints[i], p, plan.waypoints[j], q)
    return min(slot, flight.begun[j, q])


@kernel
def _insert_node(mission, uavs, nodes, flight, plan, i, p, words):
    """Insert a node into the plan of UAV ``i``: of two random ones, that which keeps more data."""
    if plan.lengths[i] == MOST_WAYPOINTS:
        return _NO_EDIT
    data = flight.data[flight.last[0]]
    k, other = _pick(words[2], mission.nodes), _pick_low(words[2], mission.nodes)
    if data[other] > data[k]:
        k = other
    x, y = nodes[k]
    if _pick_low(words[0], 1 << 16) < _SHORTEST:
        p = _shortest_detour(mission, flight, plan, i, x, y)
    slot = flight.begun[i, p]
    insert(plan, i, p, x, y, _pick(words[3], 3), words[3] & np.uint64(1))
    return slot


@kernel
def _edit_charge(mission, flight, plan, i, p, words):
    """Let UAV ``i`` charge before waypoint ``p``, or charge in another cell if it charges there."""
    x, y = zone_cell(mission, _pick(words[2], mission.zone_width * mission.zone_height))
    slot = flight.begun[i, p]
    if p < plan.lengths[i] and plan.waypoints[i, p, STAY] == CHARGE:
        plan.waypoints[i, p, CELL_X], plan.waypoints[i, p, CELL_Y] = x, y
    elif plan.lengths[i] == MOST_WAYPOINTS or mission.flight_cost == 0:
        return _NO_EDIT
    else:
        insert(plan, i, p, x, y, CHARGE, words[3] & np.uint64(1))
    return slot


@kernel
def _shortest_detour(mission, flight, plan, i, x, y):
    """Where in the plan of UAV ``i`` a cell is the shortest detour."""
    way, least, place = plan.waypoints[i], 1 << 40, 0
    from_x, from_y = flight.team[0, i, 0], flight.team[0, i, 1]
    for p in range(plan.lengths[i] + 1):
        detour = abs(x - from_x) + abs(y - from_y)
        if p < plan.lengths[i]:
            to_x, to_y = way[p, CELL_X], way[p, CELL_Y]
            detour += abs(x - to_x) + abs(y - to_y) - abs(from_x - to_x) - abs(from_y - to_y)
            from_x, from_y = to_x, to_y
        if detour < least:
            least, place = detour, p
    return place


@kernel
def insert(plan, i, p, x, y, stay, order):
    """Insert a waypoint before number ``p`` of UAV ``i``."""
    way = plan.waypoints[i]
    for q in range(plan.lengths[i], p, -1):
        for column in range(4):
            way[q, column] = way[q - 1, column]
    way[p, CELL_X], way[p, CELL_Y], way[p, STAY], way[p, ORDER] = x, y, stay, order
    plan.lengths[i] += 1


@kernel
def remove(plan, i, p):
    """Take out waypoint ``p`` of UAV ``i``."""
    way = plan.waypoints[i]
    plan.lengths[i] -= 1
    for q in range(p, plan.lengths[i]):
        for column in range(4):
            way[q, column] = way[q + 1, column]


@inlined
def _swap(way, p, other, q):
    for column in range(4):
        way[p, column], other[q, column] = other[q, column], way[p, column]
