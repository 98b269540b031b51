"""How the bound of one UAV changes with the worth of data: its derivatives, for better prices.

No bound depends on what is computed here.
"""

import numpy as np

from dess.analysis.bound import paths
from dess.analysis.bound.service import step_takings
from dess.code.kernels import inlined, kernel
from dess.state import STEP_X, STEP_Y


@inlined
def _stay(local, now, ahead, had, then_had, home, q):
    """The ceiling of local price ``q`` by a step within the block, and the local price after."""
    least, best = np.inf, q
    for line in range(local.shape[1]):
        value = now[line] + ahead[line] + local[home, line] * (then_had[home] - had[home])
        value += max(local[home, line] - local[home, q], 0.0) * had[home]
        if value < least:
            least, best = value, line
    return least, best


@inlined
def _leave(blocks, local, now, ahead, had, then_had, home, there, level, q):
    """The same by a step into another block, and the level at which ``home`` is remembered."""
    least, best, chosen = np.inf, 0, 0
    for later in range(len(blocks.levels)):
        value, line = paths.beginning(
            blocks, local, now, ahead, had, then_had, home, there, level, later, local[home, q]
        )
        if value < least:
            least, best, chosen = value, line, later
    return least, best, chosen


@kernel
def _choose(
    to_zone, phases, data, period, blocks, local, values, waiting, ceilings,
    f, phase, x, y, memory, q,
):  # fmt: skip
    """What determines the ceiling of a state: the choice, its local price, the level kept."""
    home = blocks.home[x, y]
    node, level = paths.remembered(blocks, home, memory)
    had = paths.data_had(data, phases, phase, f)
    then_had = paths.data_had(data, phases, phase, f + 1)
    most = -waiting[paths.last_slot(phases, phase, f, len(waiting) - 1)]
    choice, line, later = paths.STOP, q, 0
    if paths.may_charge(to_zone, phases, phase, f, x, y):
        new = paths.data_had(data, phases, phases.after[f], f) - had
        value = ceilings[f, phases.after[f], x, y, memory, q] + local[home, q] * new[home]
        if memory > 0:
            value += local[node, blocks.levels[level]] * new[node]
        if value > most:
            most, choice = value, paths.CHARGE
    if f >= phases.deadline[phase]:
        return choice, line, later
    s = period[phases.clock[phase, f]]
    for action in range(5):
        x2, y2 = x + STEP_X[action], y + STEP_Y[action]
        if not paths.is_reached(to_zone, phases, phase, f + 1, x2, y2):
            continue
        there, now, ahead = blocks.home[x2, y2], values[s, action, x2, y2], ceilings[f + 1, phase]
        if there == home:
            value, best = _stay(local, now, ahead[x2, y2, memory], had, then_had, home, q)
            if memory > 0:
                value += local[node, blocks.levels[level]] * (then_had[node] - had[node])
            kept = 0
        else:
            known = level if node == there else 0
            value, best, kept = _leave(
                blocks, local, now, ahead[x2, y2], had, then_had, home, there, known, q
            )
        if value > most:
            most, choice, line, later = value, action, best, kept
    return choice, line, later


@kernel
def add_slopes(
    to_zone, phases, data, period, blocks, local, parts, values, waiting, ceilings,
    x, y, worth, nodes, rates, below, slopes,
):  # fmt: skip
    """Add the derivatives of the bound of a UAV that starts at ``x, y``.

    Args:
        to_zone, phases, data, period, blocks, local, values, waiting, ceilings: As in
            ``bound_paths``.
        parts: (Q,) the local prices as parts of the worth in the last period.
        x, y: Start cell.
        worth, nodes, rates, below: As in ``step_values``.
        slopes: (S, K) derivatives by ``worth``, increased.

    Returns:
        The bound of the UAV, and the earliest mission slot of its last flying slot.
    """
    phase, f, memory, home, last = 0, 0, 0, blocks.home[x, y], slopes[-1]
    had = paths.data_had(data, phases, phase, 0)
    start = ceilings[0, 0, x, y, 0] + local[home] * had[home]
    q = np.argmin(start)
    least = start[q]
    last[home] += parts[q] * had[home]
    takings = np.empty(len(nodes))
    while f < len(ceilings) - 1:
        choice, line, later = _choose(
            to_zone, phases, data, period, blocks, local, values, waiting, ceilings,
            f, phase, x, y, memory, q,
        )  # fmt: skip
        if choice == paths.STOP:
            break
        node, level = paths.remembered(blocks, home, memory)
        price = parts[blocks.levels[level]]
        had = paths.data_had(data, phases, phase, f)
        then_had = paths.data_had(data, phases, phase, f + 1)
        if choice == paths.CHARGE:
            then_had = paths.data_had(data, phases, phases.after[f], f)
            phase = phases.after[f]
        new = then_had - had
        s = period[phases.clock[phase, f]]
        x, y = x + STEP_X[choice % 5] * (choice < 5), y + STEP_Y[choice % 5] * (choice < 5)
        there = blocks.home[x, y]
        if there == home:
            last[home] += parts[line] * new[home] + max(parts[line] - parts[q], 0.0) * had[home]
            if memory > 0:
                last[node] += price * new[node]
        else:
            known = level if node == there else 0
            memory = paths.memory_of(blocks, there, home, later)
            left = parts[blocks.levels[later]] if memory > 0 else 0.0
            last[home] += left * new[home] + max(left - parts[q], 0.0) * had[home]
            last[there] += parts[line] * new[there]
            known_price = parts[blocks.levels[known]]
            last[there] += max(parts[line] - known_price, 0.0) * had[there]
        home, q = there, line
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
