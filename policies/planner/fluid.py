"""A fluid model of a mission: what a plan collects if rates are their means and data arrive evenly.

    begin_flight(mission, uavs, residual, flight)
    simulate_flight(mission, rates, plan, flight, 0, flight, 500, np.inf)   # the whole plan
    simulate_flight(mission, rates, other, flight, 5, ahead, 500, np.inf)   # from the sixth one

The model has the rules of ``dess.model.rules`` as far as they matter for a plan: a cell per move,
batteries, the charging latch, pads and quotas. In each slot a UAV serves the node with the highest
mean rate among those with data, and once it is empty, the next one. Flights are resumed from
snapshots, so a plan that differs in its last waypoints from one that was simulated is simulated
from there on.
"""

import math
from typing import NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.model.guard.battery import MARGIN_PER_TEAMMATE, SCARCE_SLOTS
from dess.model.guard.ways import battery_of_flight
from dess.model.state import HOVER, STEP_X, STEP_Y, fields
from dess.physics.charging import charge_limit, gain
from dess.physics.chart import distance, in_zone, is_open
from dess.physics.energy import (
    PERCENT,
    has_costs,
    max_slot_cost,
    slot_cost_at,
    thousandths_left,
    waiting_slot,
)
from dess.physics.failures import working_pads
from dess.physics.fleet import move_phase
from dess.physics.landing import has_finished, lands, next_latch
from dess.physics.radio import has_limit
from dess.physics.section import for_sections
from dess.policies.planner.waypoints import CHARGE, NEVER, last_charge

# The data of a flight are records: the compiled code passes them on without counting references,
# which would take longer than the model itself.
# A UAV in the model.
CRAFT = np.dtype(
    [
        # Its state: ``battery`` in the unit of the guard, ``counted`` the communication slots
        # counted toward the quota, ``next`` its waypoint, ``stayed`` the slots that it has hovered
        # there.
        *fields(
            np.int64, "x y battery counted active latch charging next stayed action slots_left"
        ),
        ("charge_slots", np.int64),  # of the present charge
        # Of the plan: its waypoints, and the last one to charge at, -1 without one.
        *fields(np.int64, "waypoints last_charge"),
        # Constants.
        *fields(np.int64, "quota slots_per_cell charge_complete charge_rate rate_slots"),
        ("rate", np.float64),
    ]
)
# A node: in slot t it holds ``base + arrival_rate * t`` data units, if t is not before ``since``.
NODE = np.dtype([("base", np.float64), ("since", np.int64)])

# The slots between two snapshots, and the most slots that are planned; fewer if missions end on the
# ground, as there is no quota or it is filled long before the last slot.
STRIDE, MOST_SLOTS, MOST_SLOTS_LANDING = 8, 2048, 240

# An emptied node has data again when so much is expected to have arrived [data units]. If it had
# some at once, UAVs would serve tiny amounts instead of the data of other nodes.
_HALF_A_PACKET = 0.5
# A communication slot in which no node has data counts toward the quota if at least so many data
# units arrive per slot: then some node far away is likely to have got some.
_SOME_ARRIVE = 0.1
_NOTHING = 1e-6  # [data units]
# Penalties [data units]: a depleted battery, and each slot that then lacks for the quota; each
# percent of battery below the guard's reserve at the charging zone; a slot in which the guard would
# send the UAV home; a move that a teammate blocks.
_DEPLETED, _SLOT_MISSED, _LATE, _UNPLANNED, _BLOCKED = 100.0, 5.0, 4.0, 0.5, 0.2


class Flight(NamedTuple):
    """A plan as simulated by the model: its state every ``STRIDE`` slots, and at the end.

    Slots are counted from the present one. The last of the S snapshots is working memory.

    Attributes:
        team: (S, I) ``CRAFT`` records.
        sea: (S, K) ``NODE`` records.
        sums: (S, 2) data collected, and penalties [data units].
        last: (2,) the number of the snapshot of the end, and the slots until then.
    """

    team: np.ndarray
    sea: np.ndarray
    sums: np.ndarray
    last: np.ndarray


def empty_flight(slots: int, uavs: int, nodes: int) -> Flight:
    """A flight of at most that many slots, UAVs and nodes."""
    snapshots = slots // STRIDE + 3
    return Flight(
        np.zeros((snapshots, uavs), CRAFT),
        np.zeros((snapshots, nodes), NODE),
        np.zeros((snapshots, 2)),
        np.zeros(2, np.int64),
    )


@kernel
def begin_flight(mission, uavs, residual, flight):
    """Make the present state the first snapshot of a flight."""
    for i in range(mission.uavs):
        u = uavs[i]
        v = flight.team[0, i]
        v.x, v.y, v.counted = u.x, u.y, u.communications
        v.battery = thousandths_left(u)
        v.charging = u.charging
        v.latch = u.latch
        v.active = u.active and not u.grounded
        v.next = 0
        v.stayed = 0
        v.slots_left = u.slots_left
        v.action = u.executed
        v.quota, v.slots_per_cell, v.rate = u.quota, u.slots_per_cell, u.rate
        v.charge_slots = u.charge_slots
        v.charge_complete = u.charge_complete
        v.charge_rate = u.charge_rate
        v.rate_slots = u.rate_slots
    wait = _slots_until_data(mission)
    for k in range(mission.nodes):
        node = flight.sea[0, k]
        node.base = residual[k]
        node.since = 0 if residual[k] > 0.0 else wait
    flight.sums[0, 0] = flight.sums[0, 1] = 0.0


@inlined
def planned_slots(mission):
    """The slots that are planned, counted from the present one."""
    most = MOST_SLOTS_LANDING if lands(mission) else MOST_SLOTS
    return min(mission.max_slots - mission.slot, most)


@inlined
def _slots_until_data(mission):
    """The slots after which an emptied node has data again."""
    slots = _HALF_A_PACKET / mission.arrival_rate  # infinite at a rate of 0
    if slots < NEVER:
        return int(math.ceil(slots))
    return NEVER


@inlined
def copy_snapshot(mission, source, first, target, second):
    """Make the second snapshot equal to the first, but for the sums."""
    for i in range(mission.uavs):
        target.team[second, i] = source.team[first, i]
    for k in range(mission.nodes):
        target.sea[second, k] = source.sea[first, k]


@kernel
def simulate_flight(mission, rates, plan, source, first, flight, slots, lag):
    """Fly a plan from a snapshot on, and return its value.

    Args:
        mission: ``MISSION`` record.
        rates: ``Rates``.
        plan: ``Plan``, the same as that of ``source`` until the snapshot. The slots in which its
            legs begin are written.
        source: The flight with the snapshot.
        first: The number of the snapshot.
        flight: The flight that is written, from that snapshot on; it may be ``source``.
        slots: The most slots to fly, counted from the present one.
        lag: The flight is given up once it is that far behind ``source`` [data units].

    Returns:
        The data collected in the whole mission if its arrivals were those until now, less penalties
        [data units]. Data that arrive because the mission lasts longer lower it. It is minus
        infinity if the flight was given up.
    """
    waypoints = plan.waypoints
    team = flight.team[-1]
    sea = flight.sea[-1]
    copy_snapshot(mission, source, first, flight, -1)
    collected, penalty = source.sums[first, 0], source.sums[first, 1]
    active = 0
    for i in range(mission.uavs):
        _assign_plan(plan, i, team[i], first)
        active += team[i].active
    total = mission.initial + mission.arrived
    rate = mission.arrival_rate
    present = total - mission.collected - mission.lost
    arriving = rate * mission.nodes
    wait = _slots_until_data(mission)
    t = first * STRIDE
    while t < slots:
        if t % STRIDE == 0:
            s = t // STRIDE
            if first < s < source.last[0]:
                behind = source.sums[s, 0] - source.sums[s, 1] - collected + penalty
                if behind > lag:
                    return -math.inf
            copy_snapshot(mission, flight, -1, flight, s)
            flight.sums[s, 0] = collected
            flight.sums[s, 1] = penalty
        if active == 0:
            break
        data_left = present + arriving * t - collected
        for i in range(mission.uavs):
            v = team[i]
            if v.active == 0:
                continue
            if v.charging != 0:
                _charge_for_slot(mission, v)
                continue
            if v.next > v.last_charge and not lands(mission):
                penalty += _penalty_for_unplanned_charge(mission, v, active, data_left)
            penalty += _act_for_slot(mission, rates, waypoints, team, i, t, active)
            asks = v.latch != 0 and v.action == HOVER and in_zone(rates.chart, v.x, v.y)
            if asks and _has_pad(mission, rates.chart, team, v):
                penalty += _begin_to_charge(mission, v, active)
            elif _stands_on_ground(mission, rates.chart, v):
                v.battery += mission.flight_cost * _cost_of_slot(mission, v)
        active = 0
        for i in range(mission.uavs):
            v = team[i]
            if v.active == 0:
                continue
            if v.charging == 0 and not _stands_on_ground(mission, rates.chart, v):
                left = present + arriving * t - collected
                collected += _collect_data(mission, rates, sea, v, t, wait, left)
            penalty += _end_slot(mission, rates.chart, v, t)
            if v.charging != 0 and v.latch == 0:
                v.charging = 0
                if v.next < v.waypoints and waypoints[i, v.next].stay == CHARGE:
                    _begin_next_leg(waypoints, i, v, t + 1)
            active += v.active
        t += 1
    if t == mission.max_slots - mission.slot:
        penalty += _penalty_for_not_landing(mission, rates.chart, team)
    s = (t + STRIDE - 1) // STRIDE
    copy_snapshot(mission, flight, -1, flight, s)
    flight.last[0] = s
    flight.last[1] = t
    share = (mission.collected + collected) / max(total + arriving * t, 1e-9)
    return share * total - penalty


@inlined
def _assign_plan(plan, i, v, first):
    """Let a UAV follow a plan from a snapshot on."""
    v.waypoints = plan.lengths[i]
    v.last_charge = last_charge(plan, i)
    for number in range(v.waypoints + 1):
        w = plan.waypoints[i, number]
        if number > v.next:
            w.begun = NEVER
        elif first == 0:
            w.begun = 0


@inlined
def _begin_next_leg(waypoints, i, v, t):
    """Let a UAV begin the leg to its next waypoint."""
    v.next += 1
    v.stayed = 0
    waypoints[i, v.next].begun = t


@inlined
def _act_for_slot(mission, rates, waypoints, team, i, t, active):
    """Let UAV ``i`` fly or hover for a slot, and return the penalty for teammates in its way."""
    v = team[i]
    if v.slots_left > 0:
        v.slots_left -= 1
        v.battery -= mission.flight_cost * _cost_of_slot(mission, v)
        return 0.0
    v.action = HOVER
    flies_on = False
    penalty = 0.0
    turned = 0
    x, y = v.x, v.y
    while v.next < v.waypoints:
        w = waypoints[i, v.next]
        x, y, turned = w.x, w.y, w.turned
        flies_on = v.x != x or v.y != y
        if flies_on or w.stay == CHARGE:
            break
        v.stayed += 1
        if v.stayed <= w.stay:
            break
        _begin_next_leg(waypoints, i, v, t)
    if lands(mission) and (v.next == v.waypoints or _must_return(mission, rates, v, t, active)):
        x, y = _free_cell(mission, rates.chart, team, i)
        flies_on = v.x != x or v.y != y
    # a teammate in the way costs something, and the UAV tries the other direction
    is_blocked = False
    for attempt in range(2):
        if flies_on:
            v.action = _action_towards(rates.chart, v, x, y, turned != attempt)
        is_blocked = False
        for j in range(mission.uavs):
            is_blocked = is_blocked or (j != i and _blocks_way(rates.chart, v, team[j], j < i))
        if not is_blocked:
            break
        penalty += _BLOCKED
    if is_blocked:
        v.action = HOVER
    if v.action != HOVER:
        v.x += STEP_X[v.action]
        v.y += STEP_Y[v.action]
        v.slots_left = v.slots_per_cell - 1
    v.battery -= mission.flight_cost * _cost_of_slot(mission, v)
    return penalty


@inlined
def _cost_of_slot(mission, v):
    """The battery that a slot in the air takes."""
    return slot_cost_at(mission, v.slots_per_cell, v.action, v.x, v.y)


@inlined
def _percent_left(mission, v):
    """The battery in whole percent, as the rules have it."""
    return (v.battery + PERCENT - 1) // PERCENT


@inlined
def _collect_data(mission, rates, sea, v, t, wait, data_left):
    """Let a UAV serve one node after another for a slot, and return what it collects."""
    candidates = rates.candidates
    rows, columns = rates.chart.zones.shape
    row = ((move_phase(v) * 5 + v.action) * rows + v.y) * columns + v.x
    rate = mission.arrival_rate
    left = mission.communication_slots
    collected = 0.0
    rank = 0
    v.counted += left
    while left > 0 and rank < candidates.shape[1]:
        c = candidates[row, rank]
        node = sea[c.node]
        rank += 1
        if has_limit(mission) and c.rate == 0.0:
            break
        if t < node.since:
            continue
        data = node.base + rate * t
        amount = c.rate * v.rate
        if left * amount < data:
            node.base -= left * amount
            collected += left * amount
            return collected
        # the communication slot in which a node is emptied has no time for another one
        left -= int(math.ceil(data / amount))
        collected += data
        node.base = -rate * t
        node.since = t + wait
    is_empty = rate * mission.nodes < _SOME_ARRIVE and data_left - collected < _NOTHING
    if is_empty or (has_limit(mission) and left > 0):
        v.counted -= left
    return collected


@inlined
def _penalty_for_unplanned_charge(mission, v, active, data_left):
    """The penalty if the guard would send a UAV home for a charge that is not in its plan."""
    m = mission.communication_slots
    lacking = v.quota - v.counted
    spare = v.battery
    if data_left * m < 0.2 * lacking * active:
        spare -= SCARCE_SLOTS * mission.flight_cost * waiting_slot(mission)
    needed = lacking * mission.flight_cost * waiting_slot(mission)
    return _UNPLANNED if spare * m < needed else 0.0


@inlined
def _action_towards(chart, v, x, y, turned):
    """The action of a shortest way to a cell, along y first if ``turned``; or Hover."""
    first = _action_along_x(v, x)
    second = _action_along_y(v, y)
    if turned:
        first, second = second, first
    if first == HOVER:
        first = second
    if chart.ways.size == 0 or first == HOVER or _is_nearer(chart, v, x, y, first):
        return first
    if _is_nearer(chart, v, x, y, second):
        return second
    for action in range(HOVER):
        if _is_nearer(chart, v, x, y, action):
            return action
    return HOVER


@inlined
def _action_along_x(v, x):
    """The action towards a column; Hover in it."""
    if x > v.x:
        return 1
    if x < v.x:
        return 3
    return HOVER


@inlined
def _action_along_y(v, y):
    """The action towards a row; Hover in it."""
    if y > v.y:
        return 2
    if y < v.y:
        return 0
    return HOVER


@inlined
def _is_nearer(chart, v, x, y, action):
    """Whether an action leads to an open cell that is nearer to a cell."""
    after_x = v.x + STEP_X[action]
    after_y = v.y + STEP_Y[action]
    before = distance(chart, v.x, v.y, x, y)
    if not is_open(chart.zones, after_x, after_y):
        return False
    return distance(chart, after_x, after_y, x, y) < before


@inlined
def _blocks_way(chart, v, other, has_moved):
    """Whether a teammate, which will move away unless it charges, is where an action leads."""
    x = v.x + STEP_X[v.action]
    y = v.y + STEP_Y[v.action]
    if other.x != x or other.y != y or other.active == 0:
        return False
    return has_moved or other.charging != 0 or (other.latch != 0 and in_zone(chart, x, y))


@inlined
def _has_pad(mission, chart, team, v):
    """Whether the zone in which a UAV is has a free pad."""
    zone = chart.zones[v.y, v.x]
    taken = 0
    for i in range(mission.uavs):
        taken += team[i].charging != 0 and chart.zones[team[i].y, team[i].x] == zone
    return taken < working_pads(mission, zone)


@inlined
def _charge_for_slot(mission, v):
    """Let a UAV charge for a slot."""
    v.charge_slots += 1
    before = _percent_left(mission, v)
    after = min(before + gain(mission, v, v.charge_slots), charge_limit(mission, v))
    v.battery += PERCENT * (after - before)


@inlined
def _begin_to_charge(mission, v, active):
    """Let a UAV charge, and return the penalty if its battery is below the guard's reserve."""
    before = v.battery + mission.flight_cost * _cost_of_slot(mission, v)
    v.charging = 1
    v.charge_slots = 0
    v.battery = before
    _charge_for_slot(mission, v)
    kept = waiting_slot(mission) * (1 + _slots_for_detours(mission, v, active))
    lacking = max(kept - before, 0)
    return _LATE * lacking / PERCENT


@inlined
def _end_slot(mission, chart, v, t):
    """End slot ``t`` of a UAV, and return the penalty if its battery is depleted."""
    penalty = 0.0
    is_on_ground = v.charging != 0 or _stands_on_ground(mission, chart, v)
    if has_finished(mission, mission.slot + t + 1, is_on_ground, v.quota, v.counted):
        v.active = v.charging = 0
    elif v.battery <= 0:
        lacking = max(v.quota - v.counted, 0) / mission.communication_slots
        penalty = _DEPLETED + _SLOT_MISSED * lacking
        v.active = v.charging = 0
    complete = charge_limit(mission, v)
    v.latch = next_latch(mission, v.latch, complete, _percent_left(mission, v), v.quota, v.counted)
    return penalty


@inlined
def _stands_on_ground(mission, chart, v):
    """Whether a UAV stands on the ground (``dess.physics.landing``)."""
    return lands(mission) and v.charging == 0 and v.action == HOVER and in_zone(chart, v.x, v.y)


@inlined
def _must_return(mission, rates, v, t, active):
    """Whether the return guard would send a UAV home, after its action of slot ``t``."""
    home = rates.chart.parking[rates.chart.nearest[v.y, v.x]]
    way = distance(rates.chart, v.x, v.y, home[0], home[1]) * v.slots_per_cell
    left = mission.max_slots - mission.slot - t
    kept = v.slots_per_cell + 2 + _slots_for_detours(mission, v, active)
    if has_costs(mission):
        spent = _battery_to_cell(mission, rates.chart, v, home[0], home[1])
        spent += mission.flight_cost * kept * max_slot_cost(mission)
        return way + kept > left or spent > v.battery
    if mission.flight_cost > 0:
        left = min(left, _percent_left(mission, v))
    return way + kept > left


@inlined
def _battery_to_cell(mission, chart, v, x, y):
    """The battery for the shortest way of a UAV to a cell, where slots have costs of their own."""
    cells = distance(chart, v.x, v.y, x, y)
    slots = v.slots_per_cell
    return mission.flight_cost * battery_of_flight(mission, slots, x - v.x, y - v.y, cells)


@inlined
def _slots_for_detours(mission, v, active):
    """The slots that the return guard keeps for the detours around teammates."""
    return (active - 1) * MARGIN_PER_TEAMMATE * v.slots_per_cell


@inlined
def _free_cell(mission, chart, team, i):
    """The nearest zone cell that no teammate is on; its own cell if there is none."""
    v = team[i]
    least = NEVER
    best_x, best_y = v.x, v.y
    for cell in range(len(chart.parking)):
        x = np.int64(chart.parking[cell, 0])
        y = np.int64(chart.parking[cell, 1])
        way = distance(chart, v.x, v.y, x, y)
        is_taken = way >= least
        for j in range(mission.uavs):
            o = team[j]
            is_taken = is_taken or (j != i and o.active != 0 and o.x == x and o.y == y)
        if not is_taken:
            best_x = x
            best_y = y
            least = way
    return best_x, best_y


@for_sections
def _penalty_for_not_landing(mission, chart, team):
    """The penalty for UAVs in the air in the last slot, if missions end on the ground."""
    penalty = 0.0
    if mission.landing:
        for i in range(mission.uavs):
            v = team[i]
            if v.active != 0 and v.charging == 0 and not _stands_on_ground(mission, chart, v):
                penalty += _DEPLETED
    return penalty
