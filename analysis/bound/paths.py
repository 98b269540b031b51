"""What one UAV can earn at given prices: a dynamic program over flying slots, phase and cell.

The home node of a flying slot is that of the block in which the slot ends. A *visit* is a sequence
of flying slots with the same home node. In a visit the UAV takes at most what the node has had by
then; what is left of that is its *allowance*. The worth of the future is bounded by affine
functions of the allowance a, one per local price p::

    worth <= ceilings[f, phase, x, y, q] + p[q] * a        for every q

The recursion needs no rounding of the allowance, and adapting to the shadowing is allowed for
(docs/concepts/bound.md, step 4 of the proof).
"""

import numpy as np

from analysis.bound.service import step_takings
from dess.code.kernels import inlined, kernel
from dess.rules import in_zone
from dess.state import STEP_X, STEP_Y

CHARGE, STOP = 5, 6  # what a UAV can do besides the actions


@inlined
def _had(data, phases, phase, f, home):
    """The data [data units] that a node can have had by flying slot f; 0 before the first one."""
    return data[phases.clock[phase, min(f, phases.clock.shape[1] - 1)], home] if f >= 0 else 0.0


@inlined
def _may_charge(mission, phases, phase, f, x, y):
    """Whether a UAV may charge after f flying slots."""
    return phases.opens[phase] <= f <= phases.closes[phase] and in_zone(mission, x, y)


@inlined
def _stop(phases, phase, f, waiting):
    """The worth of a mission that ends after f flying slots."""
    return -waiting[min(f + phases.charged[phase], len(waiting) - 1)]


@inlined
def _meeting(gain, ahead, local, allowance):
    """The least of the bounds for an action at an allowance, and its local price."""
    least, best = np.inf, 0
    for q in range(len(local)):
        value = gain[q] + ahead[q] + local[q] * allowance
        if value < least:
            least, best = value, q
    return least, best


@kernel
def bound_paths(mission, phases, data, period, block, local, values, waiting, ceilings):
    """Bound what a UAV can earn from every state.

    Args:
        mission: ``MISSION`` record with the constants of the scenario.
        phases: ``Phases``.
        data: (T + 1, K) data [data units] that each node has had by the start of slot t.
        period: (T + 1,) period between cuts of slot t.
        block: (M, M) home node of each cell ``x, y``.
        local: (K, Q) local prices, ascending.
        values: From ``step_values``.
        waiting: (T + 1,) what it costs a UAV that the mission ends after t slots.
        ceilings: (F + 1, P, M, M, Q) worth of the future at each local price, overwritten.
    """
    slots, grid, prices = len(ceilings) - 1, len(block), local.shape[1]
    begins = np.empty((5, grid, grid))
    for phase in range(len(phases.deadline)):
        ceilings[slots, phase] = _stop(phases, phase, slots, waiting)
    for f in range(slots - 1, -1, -1):
        for phase in range(len(phases.deadline) - 1, -1, -1):
            here, then = ceilings[f, phase], ceilings[f + 1, phase]
            here[:] = _stop(phases, phase, f, waiting)
            if f < phases.deadline[phase]:
                gain = values[period[phases.clock[phase, f]]]
                for action in range(5):
                    for x in range(grid):
                        for y in range(grid):
                            home = block[x, y]
                            allowance = _had(data, phases, phase, f + 1, home)
                            begins[action, x, y], _ = _meeting(
                                gain[action, x, y], then[x, y], local[home], allowance
                            )
                for x in range(grid):
                    for y in range(grid):
                        _act(phases, data, block, local, gain, then, f, phase, begins, x, y,
                             here[x, y])  # fmt: skip
            target = phases.after[f]
            for x in range(grid):
                for y in range(grid):
                    if _may_charge(mission, phases, phase, f, x, y):
                        home = block[x, y]
                        new = _had(data, phases, target, f, home)
                        new -= _had(data, phases, phase, f, home)
                        for q in range(prices):
                            value = ceilings[f, target, x, y, q] + local[home, q] * new
                            here[x, y, q] = max(here[x, y, q], value)


@inlined
def _act(phases, data, block, local, gain, then, f, phase, begins, x, y, here):
    """Raise the ceilings of a state to what its actions can earn."""
    grid, home = len(block), block[x, y]
    prices, last = local[home], local.shape[1] - 1
    allowance = _had(data, phases, phase, f, home)
    new = _had(data, phases, phase, f + 1, home) - allowance
    for action in range(5):
        x2, y2 = x + STEP_X[action], y + STEP_Y[action]
        if not (0 <= x2 < grid and 0 <= y2 < grid):
            continue
        if block[x2, y2] != home:
            for q in range(last + 1):
                here[q] = max(here[q], begins[action, x2, y2])
            continue
        now, ahead = gain[action, x2, y2], then[x2, y2]
        at_all, full = _meeting(now, ahead, prices, allowance + new)
        at_none, empty = _meeting(now, ahead, prices, new)
        for q in range(last + 1):
            value = now[q] + ahead[q] + prices[q] * new
            if q < full:
                value = at_all - prices[q] * allowance
            elif q > empty:
                value = at_none
            here[q] = max(here[q], value)


@kernel
def add_takings(
    mission, phases, data, period, block, local, values, waiting, ceilings,
    x, y, worth, nodes, rates, below, takings,
):  # fmt: skip
    """Follow a best path from a cell and add what it takes to ``takings`` (S, K), per period.

    The path takes the mean rates. It serves to improve the prices; no bound depends on it.
    Returns the worth of the state at the start.
    """
    grid, phase, f = len(block), 0, 0
    allowance = _had(data, phases, phase, 0, block[x, y])
    start, _ = _meeting(
        ceilings[0, 0, x, y], np.zeros(local.shape[1]), local[block[x, y]], allowance
    )
    slot_takings = np.zeros(len(nodes))
    while f < len(ceilings) - 1:
        home = block[x, y]
        best, choice, price = _stop(phases, phase, f, waiting), STOP, 0
        if _may_charge(mission, phases, phase, f, x, y):
            target = phases.after[f]
            new = _had(data, phases, target, f, home) - _had(data, phases, phase, f, home)
            value, _ = _meeting(
                ceilings[f, target, x, y], np.zeros(local.shape[1]), local[home], allowance + new
            )
            if value > best:
                best, choice = value, CHARGE
        s = period[phases.clock[phase, f]]
        if f < phases.deadline[phase]:
            for action in range(5):
                x2, y2 = x + STEP_X[action], y + STEP_Y[action]
                if not (0 <= x2 < grid and 0 <= y2 < grid):
                    continue
                there = block[x2, y2]
                left = _had(data, phases, phase, f + 1, there)
                if there == home:
                    left += allowance - _had(data, phases, phase, f, home)
                value, q = _meeting(
                    values[s, action, x2, y2], ceilings[f + 1, phase, x2, y2], local[there], left
                )
                if value > best:
                    best, choice, price = value, action, q
        if choice == STOP:
            break
        if choice == CHARGE:
            target = phases.after[f]
            allowance += _had(data, phases, target, f, home) - _had(data, phases, phase, f, home)
            phase = target
            continue
        x, y = x + STEP_X[choice], y + STEP_Y[choice]
        if block[x, y] != home:
            home = block[x, y]
            allowance = _had(data, phases, phase, f, home)
        priced = worth[s].copy()
        priced[home] = max(priced[home] - local[home, price], 0.0)
        slot_takings[:] = 0.0
        step_takings(x, y, choice, priced, nodes, rates, below, slot_takings)
        slot_takings[home] = min(slot_takings[home], allowance)
        takings[s] += slot_takings
        allowance -= slot_takings[home]
        allowance += _had(data, phases, phase, f + 1, home) - _had(data, phases, phase, f, home)
        f += 1
    return start
