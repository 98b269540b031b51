"""The search for a plan: simulated annealing over the waypoints of the whole team.

    improve_plan(mission, uavs, residual, nodes, rates, plan, workspace, 20_000, 2.0, 20_000)
    value = workspace.course[BEST]

Each step edits the plan, flies it in the fluid model from the first slot that the edit can change,
and keeps the edit or takes it back (S. Kirkpatrick, C. Gelatt, M. Vecchi, *Optimization by
simulated annealing*, 1983). All random numbers are functions of the mission, the slot and the step.
"""

import math
from typing import NamedTuple

import numpy as np

from dess.base.elementary import exp, log
from dess.base.kernels import inlined, kernel
from dess.model.state import STEP_X, STEP_Y
from dess.physics import streams
from dess.physics.chart import distance, in_zone, is_open
from dess.policies.planner import fluid
from dess.policies.planner.fluid import Flight
from dess.policies.planner.waypoints import (
    CHARGE,
    MOST_WAYPOINTS,
    NEVER,
    Plan,
    copy_plan,
    empty_plan,
    insert_waypoint,
    last_charge,
    remove_waypoint,
    set_waypoint,
)

# The temperature [data units] falls to this in the last step.
_COLDEST = 0.05
# How often each edit is tried, in percent.
_INSERT, _REMOVE, _REPLACE, _MOVE, _SWAP, _STAY = range(6)
_TURN, _NUDGE, _REVERSE, _CHARGE, _CROSS = range(6, 11)
_KINDS = np.repeat(np.arange(11), [12, 10, 8, 22, 10, 12, 6, 12, 4, 2, 2])
# How often a waypoint is inserted where its detour is the shortest, in 1/65536.
_SHORTEST = 30_000
# The most waypoints that are moved together.
_MOST_MOVED = 3
_NO_EDIT = -1
# The flight of a team is given up if it is so far behind that of the present plan [data units]: it
# would hardly ever catch up. A lone UAV is let fly on, since what it gains by another order of its
# nodes may come late.
_LAG = 6.0
# Workspace.course: the edits tried so far, the values of the present and the best plan, and the
# temperature. The first is 0 between two searches.
TRIED, VALUE, BEST, HEAT = range(4)
_LOW = np.uint64(0xFFFF)
_HIGH = np.uint64(16)


class Workspace(NamedTuple):
    """Working memory of the search.

    Attributes:
        present, trial: The plan that the search has come to, and an edit of it.
        flight, ahead: Their flights; ``ahead`` is written from the first slot that differs on.
        course: How far the search has come.
    """

    present: Plan
    trial: Plan
    flight: Flight
    ahead: Flight
    course: np.ndarray


def empty_workspace(slots: int, uavs: int, nodes: int) -> Workspace:
    """Working memory for missions of at most that many slots, UAVs and nodes."""
    slots = min(slots, fluid.MOST_SLOTS)
    flight, ahead = (fluid.empty_flight(slots, uavs, nodes) for _ in range(2))
    return Workspace(empty_plan(uavs), empty_plan(uavs), flight, ahead, np.zeros(4))


@kernel
def improve_plan(mission, uavs, residual, nodes, rates, plan, workspace, steps, hottest, most):
    """Improve a plan in place; its value in the fluid model is never worse.

    A long search takes several calls, so that a signal can end it in between.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        residual: (K,) residual data [data units].
        nodes: (K, 2) cells of the nodes.
        rates: ``Rates``.
        plan: ``Plan``, changed.
        workspace: ``Workspace``, overwritten.
        steps: Number of edits to try in the whole search.
        hottest: The temperature of the first step [data units].
        most: The largest number of edits to try in this call.

    Returns:
        The number of edits that were tried in this call. ``workspace.course[TRIED]`` is 0 if the
        search has ended.
    """
    present, trial, flight, ahead, course = workspace
    slots = fluid.planned_slots(mission)
    first = int(course[TRIED])
    if first == 0:
        fluid.begin_flight(mission, uavs, residual, flight)
        course[VALUE] = course[BEST] = fluid.simulate_flight(
            mission, rates, plan, flight, 0, flight, slots, np.inf
        )
        course[HEAT] = hottest
        copy_plan(mission, plan, present)
        copy_plan(mission, plan, trial)
    value, best, heat = course[VALUE], course[BEST], course[HEAT]
    lag = _LAG if mission.uavs > 1 else math.inf
    words = np.empty(4, np.uint64)
    cooling = exp(log(_COLDEST / hottest) / max(steps, 1))
    last = min(first + most, steps)
    for step in range(first, last):
        heat *= cooling
        words[0], words[1], words[2], words[3] = streams.block(
            mission.seed, mission.replication, streams.PLAN, 0, mission.slot, step
        )
        slot = _edit_plan(mission, uavs, nodes, rates.chart, flight, trial, words)
        if slot == _NO_EDIT:
            continue
        if slot != NEVER:
            slot = min(slot, _first_unplanned(mission, present, trial))
        if slot >= flight.last[1]:
            copy_plan(mission, present, trial)
            continue
        luck = streams.uniform(words[0] >> _HIGH << _HIGH | words[3] & _LOW)
        least = heat * log(luck)
        snapshot = slot // fluid.STRIDE
        behind = lag - least
        new = fluid.simulate_flight(mission, rates, trial, flight, snapshot, ahead, slots, behind)
        if new >= value or new - value > least:
            value = new
            _keep_flight(mission, ahead, flight, slot // fluid.STRIDE)
            for i in range(mission.uavs):  # waypoints that are not reached are of no use
                v = flight.team[flight.last[0], i]  # but for charges, which count as planned
                trial.lengths[i] = min(trial.lengths[i], max(v.next, v.last_charge) + 1)
            copy_plan(mission, trial, present)
            if value > best:
                best = value
                copy_plan(mission, present, plan)
        else:
            copy_plan(mission, present, trial)
    course[TRIED] = last if last < steps else 0
    course[VALUE] = value
    course[BEST] = best
    course[HEAT] = heat
    return last - first


@kernel
def _first_unplanned(mission, present, trial):
    """The first slot after the last charge of a UAV in one plan, if it is another in the other."""
    slot = NEVER
    for i in range(mission.uavs):
        charge = last_charge(present, i)
        other_charge = last_charge(trial, i)
        if charge != other_charge:
            slot = min(slot, present.waypoints[i, min(charge, other_charge) + 1].begun)
    return slot


@kernel
def _keep_flight(mission, ahead, flight, first):
    """Make a flight that of a trial, which was simulated from a snapshot on."""
    for s in range(first, ahead.last[0] + 1):
        fluid.copy_snapshot(mission, ahead, s, flight, s)
        flight.sums[s, 0], flight.sums[s, 1] = ahead.sums[s, 0], ahead.sums[s, 1]
    flight.last[0], flight.last[1] = ahead.last[0], ahead.last[1]


@inlined
def _pick_number(word, count):
    """A number below ``count``, of the upper half of a random word."""
    return np.int64((word >> _HIGH) * np.uint64(count) >> _HIGH)


@inlined
def _pick_other_number(word, count):
    """A number below ``count``, of the lower half of a random word."""
    return np.int64((word & _LOW) * np.uint64(count) >> _HIGH)


@kernel
def _edit_plan(mission, uavs, nodes, chart, flight, plan, words):
    """Edit a plan at random; return the first slot that this may change, or ``_NO_EDIT``."""
    kind = _KINDS[_pick_number(words[0], len(_KINDS))]
    i = _pick_number(words[1], mission.uavs)
    if not uavs[i].active:
        return _NO_EDIT
    length = plan.lengths[i]
    p = _pick_other_number(words[1], length + (kind in (_INSERT, _CHARGE, _CROSS)))
    if kind == _INSERT:
        return _insert_node(mission, nodes, chart, flight, plan, i, p, words)
    if kind == _CHARGE:
        return _edit_charge(mission, chart, plan, i, p, words)
    if length == 0 and kind != _CROSS:
        return _NO_EDIT
    w = plan.waypoints[i, p]
    slot = w.begun
    if kind == _REMOVE:
        remove_waypoint(plan, i, p)
    elif kind == _TURN:
        w.turned = 1 - w.turned
    elif kind == _STAY:
        if w.stay == CHARGE:
            return _NO_EDIT
        w.stay += 1 if w.stay == 0 or _pick_number(words[2], 2) == 0 else -1
    elif kind == _NUDGE:
        action = _pick_number(words[2], 4)
        x = w.x + STEP_X[action]
        y = w.y + STEP_Y[action]
        if not is_open(chart.zones, x, y) or (w.stay == CHARGE and not in_zone(chart, x, y)):
            return _NO_EDIT
        w.x = x
        w.y = y
    elif kind == _REPLACE:
        if w.stay == CHARGE:
            return _NO_EDIT
        k = _pick_number(words[2], mission.nodes)
        other = _pick_other_number(words[2], mission.nodes)
        w.x, w.y = _nearer_cell(w, nodes[k], nodes[other])
    elif kind == _REVERSE:
        q = min(p + 1 + _pick_number(words[2], 5), length - 1)
        while p < q:
            _swap_waypoints(plan.waypoints[i, p], plan.waypoints[i, q])
            p += 1
            q -= 1
    else:
        j = _pick_number(words[2], mission.uavs)
        if not uavs[j].active:
            slot = _NO_EDIT
        elif kind == _MOVE:
            slot = _move_waypoints(chart, flight, plan, i, p, j, words)
        elif kind == _SWAP:
            slot = _swap_between_uavs(plan, i, p, j, _pick_number(words[3], plan.lengths[j]))
        else:
            slot = _swap_tails(plan, i, p, j, _pick_number(words[3], plan.lengths[j] + 1))
    return slot


@inlined
def _nearer_cell(w, one, other):
    """The nearer one of two cells to a waypoint."""
    is_first = abs(one[0] - w.x) + abs(one[1] - w.y) <= abs(other[0] - w.x) + abs(other[1] - w.y)
    if is_first:
        return one[0], one[1]
    return other[0], other[1]


@kernel
def _move_waypoints(chart, flight, plan, i, p, j, words):
    """Move some waypoints of UAV ``i``, from ``p`` on, to UAV ``j``, in this order or reversed."""
    count = min(1 + _pick_other_number(words[3], _MOST_MOVED), plan.lengths[i] - p)
    if plan.lengths[j] + count > MOST_WAYPOINTS:
        return _NO_EDIT
    moved = np.empty((_MOST_MOVED, 4), np.int64)
    has_charge = False
    slot = plan.waypoints[i, p].begun
    for number in range(count):
        w = plan.waypoints[i, p + number]
        moved[number, 0], moved[number, 1] = w.x, w.y
        moved[number, 2], moved[number, 3] = w.stay, w.turned
        has_charge = has_charge or w.stay == CHARGE
    if has_charge and j != i:
        return _NO_EDIT
    for _ in range(count):
        remove_waypoint(plan, i, p)
    q = _pick_number(words[3], plan.lengths[j] + 1)
    if not has_charge and _pick_other_number(words[2], 1 << 16) < _SHORTEST:
        q = _shortest_detour(chart, flight, plan, j, moved[0, 0], moved[0, 1])
    if j == i and q == p:
        return NEVER
    slot = min(slot, plan.waypoints[j, q].begun)
    is_reversed = words[0] & np.uint64(1) == np.uint64(1)
    for number in range(count):
        x, y, stay, turned = moved[number]
        insert_waypoint(plan, j, q, x, y, stay, turned)
        if not is_reversed:
            q += 1
    return slot


@kernel
def _swap_between_uavs(plan, i, p, j, q):
    """Swap waypoint ``p`` of UAV ``i`` with ``q`` of UAV ``j``."""
    if q == plan.lengths[j] or (i == j and p == q):
        return _NO_EDIT
    w, other = plan.waypoints[i, p], plan.waypoints[j, q]
    if j != i and (w.stay == CHARGE or other.stay == CHARGE):
        return _NO_EDIT
    slot = min(w.begun, other.begun)
    _swap_waypoints(w, other)
    return slot


@kernel
def _swap_tails(plan, i, p, j, q):
    """Swap all waypoints of UAV ``i`` from ``p`` on with those of UAV ``j`` from ``q`` on."""
    slot = min(plan.waypoints[i, p].begun, plan.waypoints[j, q].begun)
    tail = plan.lengths[i] - p
    other_tail = plan.lengths[j] - q
    count = max(tail, other_tail)
    charges = 0
    if j == i or max(p, q) + count > MOST_WAYPOINTS:
        return _NO_EDIT
    for number in range(tail):
        charges += plan.waypoints[i, p + number].stay == CHARGE
    for number in range(other_tail):
        charges -= plan.waypoints[j, q + number].stay == CHARGE
    if charges != 0:
        return _NO_EDIT
    for number in range(count):
        _swap_waypoints(plan.waypoints[i, p + number], plan.waypoints[j, q + number])
    plan.lengths[i] = p + other_tail
    plan.lengths[j] = q + tail
    return slot


@kernel
def _insert_node(mission, nodes, chart, flight, plan, i, p, words):
    """Insert a node into the plan of UAV ``i``: of two random ones, that which keeps more data."""
    if plan.lengths[i] == MOST_WAYPOINTS:
        return _NO_EDIT
    k = _pick_number(words[2], mission.nodes)
    other = _pick_other_number(words[2], mission.nodes)
    end = flight.last[0]
    if flight.sea[end, other].base > flight.sea[end, k].base:
        k = other
    x, y = nodes[k, 0], nodes[k, 1]
    if _pick_other_number(words[0], 1 << 16) < _SHORTEST:
        p = _shortest_detour(chart, flight, plan, i, x, y)
    slot = plan.waypoints[i, p].begun
    insert_waypoint(plan, i, p, x, y, _pick_number(words[3], 3), np.int64(words[3] & np.uint64(1)))
    return slot


@kernel
def _edit_charge(mission, chart, plan, i, p, words):
    """Let UAV ``i`` charge before waypoint ``p``, or in another cell if it charges there."""
    cell = _pick_number(words[2], len(chart.parking))
    x, y = chart.parking[cell, 0], chart.parking[cell, 1]
    w = plan.waypoints[i, p]
    slot = w.begun
    if p < plan.lengths[i] and w.stay == CHARGE:
        w.x = x
        w.y = y
    elif plan.lengths[i] == MOST_WAYPOINTS or mission.flight_cost == 0:
        slot = _NO_EDIT
    else:
        insert_waypoint(plan, i, p, x, y, CHARGE, np.int64(words[3] & np.uint64(1)))
    return slot


@kernel
def _shortest_detour(chart, flight, plan, i, x, y):
    """Where in the plan of UAV ``i`` a cell is the shortest detour."""
    least = NEVER
    place = 0
    from_x, from_y = flight.team[0, i].x, flight.team[0, i].y
    for p in range(plan.lengths[i] + 1):
        detour = distance(chart, from_x, from_y, x, y)
        if p < plan.lengths[i]:
            w = plan.waypoints[i, p]
            detour += distance(chart, w.x, w.y, x, y) - distance(chart, w.x, w.y, from_x, from_y)
            from_x, from_y = w.x, w.y
        if detour < least:
            least = detour
            place = p
    return place


@inlined
def _swap_waypoints(one, other):
    """Swap two waypoints, but for when their legs begin."""
    x, y, stay, turned = one.x, one.y, one.stay, one.turned
    set_waypoint(one, other.x, other.y, other.stay, other.turned)
    set_waypoint(other, x, y, stay, turned)
