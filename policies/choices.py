"""The rules by which heuristics choose an action: a goal first, then a step towards it.

Each heuristic has its own rule for choosing a goal (``_choose_goal``). All share the rule for the
next action (``step_towards``): the safe action that brings the UAV nearest to its goal and avoids
teammates. These functions are compiled and work on the arrays of one mission.
"""

import math
from functools import lru_cache

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.model.guard.battery import late_slots, margin, margin_slots, slots_needed, usable_battery
from dess.model.guard.moves import contest, contests, guide_uav
from dess.model.guard.parking import stays
from dess.model.guard.ways import (
    is_beyond_battery,
    path_length,
    round_trip,
    slots_of_round_trip,
)
from dess.model.rules import legal_moves
from dess.model.state import HOVER, STEP_X, STEP_Y
from dess.physics import streams
from dess.physics.chart import Chart, distance, spread
from dess.physics.energy import has_costs, waiting_slot
from dess.physics.landing import flies
from dess.physics.radio import has_limit

# The numbers of the policies in compiled code; the last is a network (``dess.policies.flight``).
RANDOM, UNGUARDED, NEAREST, GREEDY, TOUR, AGE, NETWORK = range(7)

# A node is worth a visit if it has at least this share of the mean initial data. Without such a
# threshold, UAVs would fly to and fro for single new data units.
_WORTH = 0.25
# Weight of a node to which a teammate is nearer (greedy, age), and slots added to every distance.
_SHARED = 0.3
_SLOTS_AT_NODE = 1.0
# Weight of the nodes that a UAV can visit after the next one (age).
_BEYOND = 0.1
# By how many standard deviations a node has less data than came in if it was served (tour).
_SPREADS = 3.0
_FINE = 2.0**24  # parts of a slot of age per slot of distance
# Cost [slots] of a step into a cell, by the guard's contest for that cell.
_CONTEST_COST = np.array([0.0, 0.5, 2.5, 50.0])


@inlined
def _choose_at_random(mission, team, i, allowed, sizes):
    """A random one of the allowed moves into uncontested cells; Hover where there is none.

    ``allowed`` has a bit for each action.
    """
    levels = contests(mission, team, i, sizes, None)
    moves = count = 0
    for action in range(4):
        if allowed >> action & 1 and contest(levels, action) == 0:
            moves |= 1 << action
            count += 1
    if count == 0:
        return HOVER
    place = (streams.POLICY, 0, mission.slot, i)
    words = streams.block(mission.seed, mission.replication, *place)
    pick = streams.integer(words[0], 0, count - 1)
    for action in range(4):
        if moves >> action & 1:
            if pick == 0:
                return action
            pick -= 1
    return HOVER


@inlined
def choose_action(
    kind, mission, team, i, data, left, sensors, nodes, circuit, chart, reach, memory
):
    """The action of UAV ``i``; ``left`` are all data, ``memory`` is that of its parking cell."""
    if kind == UNGUARDED:
        charge, home, safe = False, stays(team[i]), legal_moves(chart.zones, team[i])
    else:
        charge, home, safe = guide_uav(mission, team, i, left, chart, memory, reach, False)
    if kind in (RANDOM, UNGUARDED):
        return _choose_at_random(mission, team, i, safe, chart.sizes)
    goal_x, goal_y = _choose_goal(
        kind, mission, team, i, data, sensors, nodes, circuit, chart, charge, home, reach
    )
    return step_towards(mission, team, i, chart, safe, goal_x, goal_y)


@inlined
def step_towards(mission, team, i, chart, safe, goal_x, goal_y):
    """The safe action that brings UAV ``i`` nearest to its goal; contested cells cost more."""
    u = team[i]
    levels = contests(mission, team, i, chart.sizes, None)
    best = HOVER
    least = 1e18
    for action in range(5):
        if not safe >> action & 1:
            continue
        x = u.x + STEP_X[action]
        y = u.y + STEP_Y[action]
        cost = path_length(mission, team, i, chart, None, x, y, goal_x, goal_y)
        cost += _CONTEST_COST[contest(levels, action)]
        if cost < least:
            best = action
            least = cost
    return best


@inlined
def _choose_goal(
    kind, mission, team, i, data, sensors, nodes, circuit, chart, charge, home, reach
):  # fmt: skip
    """The cell that UAV ``i`` flies to: that of the best node within its reach, or else its zone.

    It flies as near as it can to a node whose cell is beyond its full battery.
    """
    u = team[i]
    spare = slots_needed(mission, u)
    if charge:
        spare = usable_battery(mission, u) - margin(mission, u)
        spare -= waiting_slot(mission) * (1 + home.wait)
    worth = _WORTH * 0.5 * (mission.initial_low + mission.initial_high)
    best = 0.0
    goal_x, goal_y = home.x, home.y
    for k in range(mission.nodes):
        if data[k] <= 0.0:
            continue
        x, y = nodes[k, 0], nodes[k, 1]
        slots = _slots_to_cell(u, chart, x, y)
        if kind == NEAREST:
            score = 1.0 / (slots + _SLOTS_AT_NODE)
        elif kind == GREEDY:
            score = data[k] / (slots + _SLOTS_AT_NODE)
        elif kind == AGE:
            score = math.inf  # it takes long, so it is found only for nodes within reach
        elif u.quota == 0:
            score = _score_by_turn(mission, i, data[k], sensors[k], circuit[k])
        else:
            score = 1.0 / (1.0 + _circuit_position(mission, i, circuit[k]))
        if score <= best:  # the weights below are at most 1
            continue
        if not charge and slots > spare:
            continue
        if charge and not _is_within_reach(mission, u, chart, x, y, home, reach, spare):
            if not has_limit(mission) or not is_beyond_battery(mission, u, chart, x, y, reach):
                continue
            x, y = _place_of_service(mission, chart, x, y)
            if not _is_within_reach(mission, u, chart, x, y, home, reach, spare):
                continue
        if kind == AGE:
            score = _score_by_age(mission, data, sensors, nodes, chart, k, slots)
        if kind in (GREEDY, AGE) and _teammate_is_nearer(mission, team, i, chart, x, y, slots):
            score *= _SHARED
        if kind != AGE and data[k] < worth and not (kind == TOUR and u.quota == 0):
            score *= 1e-3
        if score > best:
            best = score
            goal_x, goal_y = x, y
    return goal_x, goal_y


@inlined
def _is_within_reach(mission, u, chart, x, y, home, reach, spare):
    """Whether UAV ``u`` comes home from a cell in time, and with the battery that it may spend."""
    if round_trip(mission, u, chart, x, y, home, reach) > spare:
        return False
    return not _is_too_late(mission, u, chart, x, y)


@inlined
def _place_of_service(mission, chart, x, y):
    """The cell towards the nearest zone at which a node at a cell is still served."""
    near = chart.parking[chart.nearest[y, x]]
    east, south = near[0] - x, near[1] - y
    length = math.sqrt(np.float64(east * east + south * south))
    share = min(mission.service_cells / length, 1.0)
    return x + np.int64(share * east), y + np.int64(share * south)


@inlined
def _is_too_late(mission, u, chart, x, y):
    """Whether UAV ``u`` would not come home from a cell before the mission ends on the ground."""
    if not has_costs(mission):  # the battery says so as well
        return False
    slots = slots_of_round_trip(mission, u, chart, x, y)
    return late_slots(mission, slots + 1 + margin_slots(mission, u)) > 0


@inlined
def _score_by_age(mission, data, sensors, nodes, chart, k, slots):
    """The age per slot of distance of node ``k``, and a share of that of all nodes beyond it."""
    score_of_node = 0.0
    beyond = 0  # an integer, since a sum of floats depends on the order of the nodes
    for other in range(len(nodes)):
        if data[other] > 0.0:
            age = mission.slot + 1 - sensors[other].newest  # at the end of this slot
            further = distance(chart, nodes[other, 0], nodes[other, 1], nodes[k, 0], nodes[k, 1])
            score = age / (slots + further + _SLOTS_AT_NODE)
            if other == k:
                score_of_node = score
            else:
                beyond += np.int64(score * _FINE)
    return score_of_node + _BEYOND * (beyond / _FINE)


@inlined
def _slots_to_cell(u, chart, x, y):
    """The slots that UAV ``u`` takes to a cell."""
    return distance(chart, u.x, u.y, x, y) * u.slots_per_cell


@inlined
def _teammate_is_nearer(mission, team, i, chart, x, y, slots):
    for j in range(mission.uavs):
        o = team[j]
        if j != i and flies(o):
            other = _slots_to_cell(o, chart, x, y)
            if other < slots or (other == slots and j < i):
                return True
    return False


@inlined
def _score_by_turn(mission, i, data, sensor, position):
    """How many slots a node has waited for its turn; on a tie the first of the circuit is ahead.

    Of a node that is served and cannot be emptied, the data that are left say how long it has
    waited. A node of the part of another UAV counts for less than any of the own part.
    """
    waited = mission.slot + 1 - sensor.newest
    expected = waited * sensor.rate
    message = mission.message
    if message == 0.0:
        message = 1.0
    spread_of_data = math.sqrt(expected * message)
    if data + _SPREADS * spread_of_data < expected:
        waited = data / sensor.rate
    place = _circuit_position(mission, i, position)
    score = waited + 0.1 / (1.0 + place)
    end = (i + 1) * mission.nodes // mission.uavs
    if place >= end - i * mission.nodes // mission.uavs:
        score *= 1e-9
    return score


@inlined
def _circuit_position(mission, i, position):
    """The position on the circuit, counted from the beginning of the part of UAV ``i``."""
    begin = i * mission.nodes // mission.uavs
    return (position - begin) % mission.nodes


NO_CIRCUIT = np.zeros(0, np.int64)  # of all but tour


def plan_circuit(nodes: np.ndarray, chart: Chart) -> np.ndarray:
    """The (K,) position of each node on a short round trip (nearest neighbour, then 2-opt)."""
    return _plan_circuit(nodes.tobytes(), chart.zones.tobytes(), chart.zones.shape)


@lru_cache(maxsize=64)
def _plan_circuit(nodes: bytes, zones: bytes, shape: tuple[int, int]) -> np.ndarray:
    cells = np.frombuffer(nodes, np.int64).reshape(-1, 2)
    chart = np.frombuffer(zones, np.int8)
    places = cells @ [1, shape[1]]
    ways = [spread(chart.reshape(shape), cell[None])[0][places] for cell in cells]
    return _find_round_trip(np.stack(ways).astype(np.int64))


@kernel
def _find_round_trip(slots):
    count = len(slots)
    order = np.arange(count)
    for step in range(1, count):
        nearest = step
        for other in range(step, count):
            if slots[order[step - 1], order[other]] < slots[order[step - 1], order[nearest]]:
                nearest = other
        order[step], order[nearest] = order[nearest], order[step]
    shorter = True
    while shorter:
        shorter = False
        for a in range(1, count - 1):
            for b in range(a + 1, count):
                before, after = order[a - 1], order[(b + 1) % count]
                gain = slots[before, order[a]] + slots[order[b], after]
                gain -= slots[before, order[b]] + slots[order[a], after]
                if gain > 0:
                    _reverse(order, a, b)
                    shorter = True
    position = np.empty(count, np.int64)
    for step in range(count):
        position[order[step]] = step
    return position


@inlined
def _reverse(order, first, last):
    """Reverse a part of an order."""
    while first < last:
        order[first], order[last] = order[last], order[first]
        first += 1
        last -= 1
