"""The fluid model: what a plan collects if every rate is its mean and data arrive evenly.

    value = fly(mission, rates, plan, flight, 0, flight)     # the whole plan
    value = fly(mission, rates, other, flight, 5, trial)     # again, from the sixth snapshot on

The model has the rules of ``dess.rules`` as far as they matter for a plan: a cell per move,
batteries, the charging latch, pads, quotas, and communication slots in which each UAV serves the
node with the highest mean SNR among those with data. Flights are resumed from snapshots, so a plan
that differs in its last waypoints from one that was flown is flown from there on.
"""

import math
from typing import NamedTuple

import numpy as np

from dess.code.kernels import inlined, kernel
from dess.observations.guard import SCARCE_SLOTS
from dess.rules import in_zone
from dess.sections.failures import working_pads
from dess.state import HOVER, STEP_X, STEP_Y

# Columns of a waypoint: its cell, the slots to stay there, and 1 if the leg to it begins along y.
# A stay of ``CHARGE`` means: hover until charged.
CELL_X, CELL_Y, STAY, ORDER = range(4)
CHARGE = -1
# The most waypoints of a UAV.
MOST_WAYPOINTS = 48
# Columns of a UAV in the fluid model.
(X, Y, BATTERY, COUNTED, CHARGING, LATCH, NEXT, STAYED, LEFT, ACTION, ACTIVE) = range(11)
# The slots between two snapshots, and the most slots that are planned.
STRIDE = 8
MOST_SLOTS = 2048
NEVER = 1 << 40

# An emptied node has data again when so much is expected to have arrived [data units]. If it had
# some at once, UAVs would serve crumbs instead of the data of other nodes.
_HALF_A_PACKET = 0.5
# Penalties [data units]: a depleted battery, and each slot that then lacks for the quota; each
# percent of battery below the guard's reserve at the charging zone; a slot in which the guard would
# send the UAV home; a move that a teammate blocks.
_DEPLETED, _SLOT_MISSED, _LATE, _UNPLANNED, _BLOCKED = 100.0, 5.0, 4.0, 0.5, 0.2


class Plan(NamedTuple):
    """Waypoints of I UAVs.

    Attributes:
        waypoints: (I, ``MOST_WAYPOINTS``, 4) the columns are named above.
        lengths: (I,) how many of them there are.
    """

    waypoints: np.ndarray
    lengths: np.ndarray


class Flight(NamedTuple):
    """A plan as flown by the model: its state every ``STRIDE`` slots, and at the end.

    Slots are counted from the present one. The residual data of a node with data are
    ``data + arrival_rate * slot``; it has data from the slot ``since`` on.

    Attributes:
        team: (S, I, 11) the UAVs; the columns are named above.
        data: (S, K) residual data of the nodes [data units].
        since: (S, K) from which slot on the nodes have data.
        sums: (S, 2) data collected, and penalties [data units].
        begun: (I, W + 1) the slot in which the leg to each waypoint begins, or ``NEVER``.
        last: (2,) the snapshot of the end, and the slots flown until then.
    """

    team: np.ndarray
    data: np.ndarray
    since: np.ndarray
    sums: np.ndarray
    begun: np.ndarray
    last: np.ndarray


@kernel
def empty_flight(slots, uavs, nodes):
    """A flight of at most that many slots, UAVs and nodes."""
    snapshots = slots // STRIDE + 3
    return Flight(
        np.zeros((snapshots, uavs, 11), np.int64),
        np.zeros((snapshots, nodes)),
        np.zeros((snapshots, nodes), np.int64),
        np.zeros((snapshots, 2)),
        np.zeros((uavs, MOST_WAYPOINTS + 1), np.int64),
        np.zeros(2, np.int64),
    )


@kernel
def begin(mission, uavs, residual, flight):
    """Make the present state the first snapshot of a flight."""
    for i in range(mission.uavs):
        u, v = uavs[i], flight.team[0, i]
        v[X], v[Y], v[BATTERY], v[COUNTED] = u.x, u.y, u.battery, u.communications
        v[CHARGING], v[LATCH], v[ACTIVE] = u.charging, u.latch, u.active and not u.grounded
        v[NEXT], v[STAYED], v[LEFT], v[ACTION] = 0, 0, u.slots_left, u.executed
        for w in range(MOST_WAYPOINTS + 1):
            flight.begun[i, w] = 0 if w == 0 else NEVER
    wait = _revival(mission)
    for k in range(mission.nodes):
        flight.data[0, k] = residual[k]
        flight.since[0, k] = 0 if residual[k] > 0.0 else wait
    flight.sums[0, 0] = flight.sums[0, 1] = 0.0


@inlined
def copy_snapshot(source, first, target, second):
    """Make the second snapshot equal to the first, but for the sums."""
    for i in range(source.team.shape[1]):
        for column in range(source.team.shape[2]):
            target.team[second, i, column] = source.team[first, i, column]
    for k in range(source.data.shape[1]):
        target.data[second, k] = source.data[first, k]
        target.since[second, k] = source.since[first, k]


@inlined
def _revival(mission):
    """The slots after which an emptied node has data again."""
    if mission.arrival_rate == 0.0:
        return NEVER
    return int(math.ceil(_HALF_A_PACKET / mission.arrival_rate))


@kernel
def fly(mission, uavs, rates, plan, source, first, flight, slots):
    """Fly a plan from a snapshot on, and return its value.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records, of which the constants are read.
        rates: ``Rates``.
        plan: ``Plan``, the same as that of ``source`` until the snapshot.
        source: The flight with the snapshot.
        first: The number of the snapshot.
        flight: The flight that is written, from that snapshot on; it may be ``source``.
        slots: The most slots to fly, counted from the present one.

    Returns:
        The data collected in the whole mission if its arrivals were those until now, less penalties
        [data units]. Data that arrive because the mission lasts longer lower it.
    """
    ranks, means, extra = rates
    count, m, nodes = mission.uavs, mission.communication_slots, mission.nodes
    team = flight.team[-1]
    data, since = flight.data[-1], flight.since[-1]
    copy_snapshot(source, first, flight, -1)
    collected, penalty = source.sums[first, 0], source.sums[first, 1]
    for i in range(count):
        for w in range(MOST_WAYPOINTS + 1):
            flight.begun[i, w] = source.begun[i, w] if w <= team[i, NEXT] else NEVER
    total = mission.initial + mission.arrived
    present = total - mission.collected - mission.lost
    wait, rate, grid = _revival(mission), mission.arrival_rate, mission.grid
    parts = ranks.shape[0] // (2 * grid) // max(grid - 1, 1)  # places per cell
    line = parts * (grid - 1) + 1
    spot = np.empty(count, np.int64)  # place at the end of the slot
    back = np.empty(count, np.int64)  # places per communication slot
    t = first * STRIDE
    while t < slots:
        if t % STRIDE == 0:
            s = t // STRIDE
            copy_snapshot(flight, -1, flight, s)
            flight.sums[s, 0] = collected
            flight.sums[s, 1] = penalty
        active = 0
        for i in range(count):
            active += team[i, ACTIVE]
        if active == 0:
            break
        data_left = present + rate * nodes * t - collected
        for i in range(count):
            if team[i, ACTIVE]:
                penalty += _act(
                    mission, uavs, extra, plan, flight.begun, team, i, t, active, data_left
                )
                v = team[i]
                part = parts // (m * uavs[i].slots_per_cell)
                if STEP_Y[v[ACTION]] == 0:
                    spot[i] = v[Y] * line + v[X] * parts
                else:
                    spot[i] = (grid + v[X]) * line + v[Y] * parts
                back[i] = part * (STEP_X[v[ACTION]] + STEP_Y[v[ACTION]])
                spot[i] -= back[i] * (v[LEFT] * m + m)
        for _ in range(m):
            for i in range(count):
                v = team[i]
                spot[i] += back[i]
                if not v[ACTIVE] or v[CHARGING]:
                    continue
                place = spot[i]
                for rank in range(ranks.shape[1]):
                    k = ranks[place, rank]
                    if t < since[k]:
                        continue
                    held = data[k] + rate * t
                    amount = means[place, rank] * uavs[i].rate
                    if amount < held:
                        data[k] -= amount
                    else:
                        amount = held
                        data[k] = -rate * t
                        since[k] = t + wait
                    collected += amount
                    v[COUNTED] += 1
                    break
                else:
                    # where data arrive, some node far away has got some
                    v[COUNTED] += rate > 0.0
        for i in range(count):
            if team[i, ACTIVE]:
                penalty += _settle(mission, uavs[i], plan, flight.begun, team[i], i, t)
        t += 1
    s = (t + STRIDE - 1) // STRIDE
    copy_snapshot(flight, -1, flight, s)
    flight.last[0], flight.last[1] = s, t
    share = (mission.collected + collected) / max(total + rate * nodes * t, 1e-9)
    return share * total - penalty


@inlined
def _act(mission, uavs, extra, plan, begun, team, i, t, active, data_left):
    """Move UAV ``i`` or let it hover or charge, take its battery, and return the penalty."""
    v, u = team[i], uavs[i]
    if v[CHARGING]:
        v[BATTERY] = min(v[BATTERY] + mission.charge_rate, mission.charge_complete)
        return 0.0
    v[BATTERY] -= mission.flight_cost
    penalty, ahead = _unplanned(mission, u, plan, v, i, active, data_left), False
    if v[LEFT] > 0:
        v[LEFT] -= 1
        return penalty
    v[ACTION] = HOVER
    while v[NEXT] < plan.lengths[i] and not ahead:
        w = plan.waypoints[i, v[NEXT]]
        if v[X] != w[CELL_X] or v[Y] != w[CELL_Y]:
            penalty += _move(mission, u, extra, team, i, w)
            ahead = True
        elif w[STAY] == CHARGE:
            ahead = True
        elif v[STAYED] < w[STAY]:
            v[STAYED] += 1
            ahead = True
        else:
            v[NEXT] += 1
            v[STAYED] = 0
            begun[i, v[NEXT]] = t
    if v[ACTION] == HOVER and _is_blocked(mission, team, i, v[X], v[Y]):
        penalty += _BLOCKED  # the teammate would have been overruled
    if v[ACTION] == HOVER and v[LATCH] and in_zone(mission, v[X], v[Y]):
        taken = 0
        for j in range(mission.uavs):
            taken += team[j, CHARGING]
        if taken < working_pads(mission):
            before = v[BATTERY] + mission.flight_cost
            reserve = (active - 1) * (2 * u.slots_per_cell + mission.wind_most)
            penalty += _LATE * max(1 + reserve - before, 0)
            v[CHARGING] = 1
            v[BATTERY] = min(before + mission.charge_rate, mission.charge_complete)
    return penalty


@inlined
def _unplanned(mission, u, plan, v, i, active, data_left):
    """The penalty if the guard would send a UAV home for a charge that is not in its plan."""
    for w in range(v[NEXT], plan.lengths[i]):
        if plan.waypoints[i, w, STAY] == CHARGE:
            return 0.0
    m, lacking = mission.communication_slots, u.quota - v[COUNTED]
    spare = v[BATTERY] + mission.flight_cost
    if data_left * m < 0.2 * lacking * active:
        spare -= SCARCE_SLOTS * mission.flight_cost
    return _UNPLANNED if spare * m < lacking * mission.flight_cost else 0.0


@inlined
def _move(mission, u, extra, team, i, w):
    """Let UAV ``i`` begin the next move to a waypoint, and return the penalty if it is blocked."""
    v = team[i]
    dx, dy = w[CELL_X] - v[X], w[CELL_Y] - v[Y]
    east_or_west, north_or_south = (1 if dx > 0 else 3), (2 if dy > 0 else 0)
    along_y = dx == 0 or (dy != 0 and w[ORDER] == 1)
    action = north_or_south if along_y else east_or_west
    penalty = 0.0
    if _is_blocked(mission, team, i, v[X] + STEP_X[action], v[Y] + STEP_Y[action]):
        penalty = _BLOCKED
        if dx == 0 or dy == 0:
            return penalty
        action = east_or_west if along_y else north_or_south
        if _is_blocked(mission, team, i, v[X] + STEP_X[action], v[Y] + STEP_Y[action]):
            return penalty
    v[X] += STEP_X[action]
    v[Y] += STEP_Y[action]
    v[ACTION] = action
    v[LEFT] = u.slots_per_cell - 1
    if extra.size > 0:
        v[BATTERY] -= mission.flight_cost * extra[action, v[Y], v[X]]
    return penalty


@inlined
def _is_blocked(mission, team, i, x, y):
    """Whether a teammate keeps UAV ``i`` out of a cell.

    Those of a lower index have moved; the others will move away, unless they charge.
    """
    for j in range(mission.uavs):
        o = team[j]
        stays = j < i or o[CHARGING] or (o[LATCH] and in_zone(mission, x, y))
        if j != i and o[ACTIVE] and stays and o[X] == x and o[Y] == y:
            return True
    return False


@inlined
def _settle(mission, u, plan, begun, v, i, t):
    """End the slot of a UAV, and return the penalty if its battery is depleted."""
    penalty = 0.0
    if v[COUNTED] >= u.quota:
        v[ACTIVE] = v[CHARGING] = 0
    elif v[BATTERY] <= 0:
        lacking = (u.quota - v[COUNTED]) / mission.communication_slots
        penalty = _DEPLETED + _SLOT_MISSED * lacking
        v[ACTIVE] = v[CHARGING] = 0
    if v[BATTERY] >= mission.charge_complete:
        v[LATCH] = 0
        if v[CHARGING]:
            v[CHARGING] = 0
            if v[NEXT] < plan.lengths[i] and plan.waypoints[i, v[NEXT], STAY] == CHARGE:
                v[NEXT] += 1
                v[STAYED] = 0
                begun[i, v[NEXT]] = t + 1
    elif v[BATTERY] <= mission.charge_start:
        v[LATCH] = 1
    return penalty
