"""What a flying slot can be worth at given prices: the expected best of all nodes.

In a communication slot a UAV serves one node. If a data unit of node k is worth ``w_k >= 0``, the
slot is worth at most ``E[max_k w_k R_k]``. The rate R_k is a convex function of the shadowing of
node k, and so is the maximum. Therefore shadowing with a few values, whose distribution is a
mean-preserving spread of the normal one, gives an upper bound (``proof.md``,
inequality 5). The expectation over these few values is computed exactly.

How the bound of one UAV changes with the worth of data is here too, for better prices
(``add_slopes``); no bound depends on it.
"""

import math

import numpy as np

from dess.analysis.bound import paths
from dess.base.kernels import inlined, kernel
from dess.model.channel import rate
from dess.model.state import EAST, HOVER, NORTH, SOUTH, STEP_X, STEP_Y, WEST
from dess.physics.streams import MAX_NORMAL

_HALF = (0.6, 1.3, 2.2, 3.4, MAX_NORMAL)
_UNLIKELY = 1e-5
POINTS = np.array([*(-z for z in _HALF[::-1]), 0.0, *_HALF])  # standard normal deviates


def spread_normal(points: np.ndarray) -> np.ndarray:
    """(J + 1,) distribution on J points, a mean-preserving spread of the standard normal one.

    Entry j is the probability of the points before j.

    The part of the distribution between two neighbouring points moves to these two, without a
    change of its mean (Edmundson and Madansky). What is beyond the outer points moves to them; no
    deviate of the simulator is there.
    """
    below = np.array([0.5 * math.erfc(-z / math.sqrt(2.0)) for z in points])
    density = np.exp(-(points**2) / 2) / math.sqrt(2.0 * math.pi)
    mass = np.diff(below)
    moment = -np.diff(density)
    upper = (moment - points[:-1] * mass) / np.diff(points)
    probabilities = np.zeros(len(points))
    probabilities[1:] += upper
    probabilities[:-1] += mass - upper
    probabilities[0] += below[0]
    probabilities[-1] += 1 - below[-1]
    return np.concatenate([[0.0], np.cumsum(probabilities)])


@kernel
def rates_of(mission, mean_snr, points):
    """(M, F * (M - 1) + 1, J) rates [data units per communication slot] at the points.

    The first two axes are the relative positions of ``World.mean_snr``.
    """
    rates = np.empty((*mean_snr.shape, len(points)))
    for a in range(mean_snr.shape[0]):
        for b in range(mean_snr.shape[1]):
            for j in range(len(points)):
                snr = mean_snr[a, b] + mission.shadowing_deviation * points[j]
                rates[a, b, j] = rate(mission, snr)
    return rates


@inlined
def _levels_at(x, y, offset, along_x, nodes, rates, levels):
    """Set the rates of all nodes at a place: a cell, plus ``offset`` communication slots."""
    places = (rates.shape[1] - 1) // (rates.shape[0] - 1)  # per cell
    for k in range(len(nodes)):
        dx = x - nodes[k, 0]
        dy = y - nodes[k, 1]
        if along_x:
            fine, coarse = (places * dx, dy)
        else:
            fine, coarse = (places * dy, dx)
        row = rates[abs(coarse), abs(fine + offset)]
        for j in range(rates.shape[2]):
            levels[k, j] = row[j]


@inlined
def _best_of(levels, worth, without, below, values, chances, winners, rank, order):
    """The distribution of ``max_k w_k R_k``: its values downwards, their chances, who has them.

    Returns the number of values. Node ``without`` is left out. Without any worth there is the one
    value 0, of no node. The last value stands for all further ones, which are very unlikely.
    """
    top = levels.shape[1] - 1
    # the maximum is never below the floor
    floor = 0.0
    lowest = -1
    for k in range(len(worth)):
        if k != without and worth[k] * levels[k, 0] > floor:
            floor = worth[k] * levels[k, 0]
            lowest = k
    able = 0  # nodes that can be above the floor, in descending order of their highest value
    for k in range(len(worth)):
        value = worth[k] * levels[k, top]
        if k != without and value > floor:
            place = able
            while place > 0 and worth[order[place - 1]] * levels[order[place - 1], top] < value:
                order[place] = order[place - 1]
                place -= 1
            order[place] = k
            able += 1
    begun, count = 0, 0  # nodes whose highest value has been reached, and those of the result
    left = 1.0  # chance that the maximum is smaller than the values so far
    while left > _UNLIKELY:
        best = floor
        chosen = -1
        for i in range(begun):
            value = worth[order[i]] * levels[order[i], rank[i]]
            if value > best:
                best = value
                chosen = i
        if begun < able and worth[order[begun]] * levels[order[begun], top] > best:
            best = worth[order[begun]] * levels[order[begun], top]
            chosen = begun
            rank[begun] = top
            begun += 1
        values[count] = best
        if chosen >= 0:
            winners[count] = order[chosen]
        else:
            winners[count] = lowest
        smaller = 0.0
        if chosen >= 0:
            smaller = left * below[rank[chosen]] / below[rank[chosen] + 1]
            rank[chosen] -= 1
        chances[count] = left - smaller
        left = smaller
        count += 1
    chances[count - 1] += left
    return count


@inlined
def _place_values(x, y, offset, along_x, home, worth, local, nodes, rates, below, scratch,
                  result):  # fmt: skip
    """Add to ``result`` (Q,) the worth of a communication slot, for each local price."""
    levels, values, chances, winners, rank, order = scratch
    _levels_at(x, y, offset, along_x, nodes, rates, levels)
    count = _best_of(levels, worth, home, below, values, chances, winners, rank, order)
    for q in range(local.shape[1]):
        home_value = max(worth[home] - local[home, q], 0.0)
        above, mass, i, total = 0.0, 0.0, 0, 0.0
        for j in range(levels.shape[1] - 1, -1, -1):
            value = home_value * levels[home, j]
            while i < count and values[i] > value:
                above += values[i] * chances[i]
                mass += chances[i]
                i += 1
            total += (below[j + 1] - below[j]) * (above + value * (1.0 - mass))
        result[q] += total


def step_values(worth, local, nodes, block, rates, below, values):
    """What each step is worth in a flying slot at given prices.

    Args:
        worth: (S, K) worth of a data unit of each node, per period between cuts.
        local: (K, Q) local prices of a node while it is the home node.
        nodes: (K, 2) cells of the nodes.
        block: (W, H) home node of each cell ``x, y``.
        rates: From ``rates_of``.
        below: (J + 1,) From ``spread_normal``.
        values: (S, 5, W, H, Q) worth of the step with an action to a cell ``x, y``, overwritten.
    """
    values[:] = 0.0
    for of_period, values_of_period in zip(worth, values, strict=True):
        for x in range(len(block)):  # between two, a signal can end it
            _row_values(x, of_period, local, nodes, block, rates, below, values_of_period)


@kernel
def _row_values(x, worth, local, nodes, block, rates, below, values):
    """Add to ``values`` what hovering in the cells of row ``x`` and flying from there is worth."""
    width, height = block.shape
    count = len(nodes)
    levels = rates.shape[2]
    m = (rates.shape[1] - 1) // (rates.shape[0] - 1)
    scratch = (
        np.empty((count, levels)), np.empty(count * levels + 1), np.empty(count * levels + 1),
        np.empty(count * levels + 1, np.int64), np.empty(count, np.int64),
        np.empty(count, np.int64),
    )  # fmt: skip
    for y in range(height):
        cell = values[HOVER, x, y]
        _place_values(x, y, 0, True, block[x, y], worth, local, nodes, rates,
                      below, scratch, cell)  # fmt: skip
        for action in range(4):
            values[action, x, y] += cell
        cell *= m
    for y in range(height):
        for along_x in (True, False):
            x2 = x + along_x
            y2 = y + (not along_x)
            if x2 == width or y2 == height:
                continue
            if along_x:
                forward, backward = (EAST, WEST)
            else:
                forward, backward = (SOUTH, NORTH)
            between = np.zeros((2, local.shape[1]))
            homes = block[x2, y2], block[x, y]
            for way in range(2 if homes[0] != homes[1] else 1):
                for n in range(1, m):
                    _place_values(x, y, n, along_x, homes[way], worth, local, nodes,
                                  rates, below, scratch, between[way])  # fmt: skip
            values[forward, x2, y2] += between[0]
            values[backward, x, y] += between[1 if homes[0] != homes[1] else 0]


@kernel
def step_takings(x, y, action, worth, nodes, rates, below, takings):
    """Add to ``takings`` (K,) what the step to cell ``x, y`` takes of each node at its best."""
    count = len(nodes)
    levels = rates.shape[2]
    m = (rates.shape[1] - 1) // (rates.shape[0] - 1)
    rows = np.empty((count, levels))
    values, chances = np.empty(count * levels + 1), np.empty(count * levels + 1)
    winners = np.empty(count * levels + 1, np.int64)
    rank, order = np.empty(count, np.int64), np.empty(count, np.int64)
    for n in range(1, m + 1):
        offset = (n - m) * (STEP_X[action] + STEP_Y[action])
        _levels_at(x, y, offset, action in (EAST, WEST), nodes, rates, rows)
        winner_count = _best_of(rows, worth, -1, below, values, chances, winners, rank, order)
        for i in range(winner_count):
            if winners[i] >= 0:
                takings[winners[i]] += values[i] * chances[i] / worth[winners[i]]


@inlined
def _ceiling_of_staying(local, now, ahead, had, then_had, home, q):
    """The ceiling of local price ``q`` by a step within the block, and the local price after."""
    least = np.inf
    best = q
    for line in range(local.shape[1]):
        value = now[line] + ahead[line] + local[home, line] * (then_had[home] - had[home])
        value += max(local[home, line] - local[home, q], 0.0) * had[home]
        if value < least:
            least = value
            best = line
    return least, best


@inlined
def _ceiling_of_leaving(blocks, local, now, ahead, had, then_had, home, there, level, q):
    """The same by a step into another block, and the level at which ``home`` is remembered."""
    least = np.inf
    best = 0
    chosen = 0
    for later in range(len(blocks.levels)):
        value, line = paths.bound_of_beginning(
            blocks, local, now, ahead, had, then_had, home, there, level, later, local[home, q]
        )
        if value < least:
            least = value
            best = line
            chosen = later
    return least, best, chosen


@kernel
def _choose_service(problem, values, waiting, ceilings, f, phase, x, y, memory, q):
    """What determines the ceiling of a state: the choice, its local price, the level kept."""
    to_zone, phases, data, period, blocks, local = problem
    home = blocks.home[x, y]
    node, level = paths.decode_memory(blocks, home, memory)
    had = paths.data_had(data, phases, phase, f)
    then_had = paths.data_had(data, phases, phase, f + 1)
    most = -waiting[paths.last_slot(phases, phase, f, len(waiting) - 1)]
    choice = paths.STOP
    line = q
    later = 0
    if paths.may_charge(to_zone, phases, phase, f, x, y):
        new = paths.data_had(data, phases, phases.after[f], f) - had
        value = ceilings[f, phases.after[f], x, y, memory, q] + local[home, q] * new[home]
        if memory > 0:
            value += local[node, blocks.levels[level]] * new[node]
        if value > most:
            most = value
            choice = paths.CHARGE
    if f >= phases.deadline[phase]:
        return choice, line, later
    s = period[phases.clock[phase, f]]
    for action in range(5):
        x2 = x + STEP_X[action]
        y2 = y + STEP_Y[action]
        if not paths.is_reached(to_zone, phases, phase, f + 1, x2, y2):
            continue
        next_home = blocks.home[x2, y2]
        now = values[s, action, x2, y2]
        ahead = ceilings[f + 1, phase]
        if next_home == home:
            value, best = _ceiling_of_staying(
                local, now, ahead[x2, y2, memory], had, then_had, home, q
            )
            if memory > 0:
                value += local[node, blocks.levels[level]] * (then_had[node] - had[node])
            kept = 0
        else:
            known_level = level if node == next_home else 0
            value, best, kept = _ceiling_of_leaving(
                blocks, local, now, ahead[x2, y2], had, then_had, home, next_home, known_level, q
            )
        if value > most:
            most = value
            choice = action
            line = best
            later = kept
    return choice, line, later


@kernel
def add_slopes(problem, parts, values, waiting, ceilings, x, y, worth, nodes, rates, below, slopes):
    """Add the derivatives of the bound of a UAV that starts at ``x, y``.

    Args:
        problem, values, waiting, ceilings: As in ``bound_paths``.
        parts: (Q,) the local prices as parts of the worth in the last period.
        x, y: Start cell.
        worth, nodes, rates, below: As in ``step_values``.
        slopes: (S, K) derivatives by ``worth``, increased.

    Returns:
        The bound of the UAV, and the earliest mission slot of its last flying slot.
    """
    _, phases, data, period, blocks, local = problem
    phase = 0
    f = 0
    memory = 0
    home = blocks.home[x, y]
    last = slopes[-1]
    had = paths.data_had(data, phases, phase, 0)
    start = ceilings[0, 0, x, y, 0] + local[home] * had[home]
    q = np.argmin(start)
    least = start[q]
    last[home] += parts[q] * had[home]
    takings = np.empty(len(nodes))
    while f < len(ceilings) - 1:
        choice, line, later = _choose_service(
            problem, values, waiting, ceilings, f, phase, x, y, memory, q
        )
        if choice == paths.STOP:
            break
        node, level = paths.decode_memory(blocks, home, memory)
        price = parts[blocks.levels[level]]
        had = paths.data_had(data, phases, phase, f)
        then_had = paths.data_had(data, phases, phase, f + 1)
        if choice == paths.CHARGE:
            then_had = paths.data_had(data, phases, phases.after[f], f)
            phase = phases.after[f]
        new = then_had - had
        s = period[phases.clock[phase, f]]
        x = x + STEP_X[choice % 5] * (choice < 5)
        y = y + STEP_Y[choice % 5] * (choice < 5)
        next_home = blocks.home[x, y]
        if next_home == home:
            last[home] += parts[line] * new[home] + max(parts[line] - parts[q], 0.0) * had[home]
            if memory > 0:
                last[node] += price * new[node]
        else:
            known_level = level if node == next_home else 0
            memory = paths.memory_of(blocks, next_home, home, later)
            left = 0.0
            if memory > 0:
                left = parts[blocks.levels[later]]
            last[home] += left * new[home] + max(left - parts[q], 0.0) * had[home]
            last[next_home] += parts[line] * new[next_home]
            known_price = parts[blocks.levels[known_level]]
            last[next_home] += max(parts[line] - known_price, 0.0) * had[next_home]
        home = next_home
        q = line
        if choice == paths.CHARGE:
            continue
        priced = worth[s].copy()
        priced[home] = max(priced[home] - local[home, q], 0.0)
        takings[:] = 0.0
        step_takings(x, y, choice, priced, nodes, rates, below, takings)
        slopes[s] += takings
        last[home] -= parts[q] * takings[home]
        f += 1
    return least, paths.last_slot(phases, phase, f, len(waiting) - 1)
