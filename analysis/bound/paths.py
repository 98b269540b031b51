"""What one UAV can earn at given prices: a dynamic program over flying slots, phase and cell.

The home node of a flying slot is that of the block in which the slot ends. A *visit* is a sequence
of flying slots with the same home node. In a visit the UAV takes at most what the node has had by
then; what is left of that is its *allowance* a. A UAV that returns from the next block finds the
allowance b that it left. The worth of the future is bounded by affine functions of both, one for
each pair of local prices p of the home node and r of the node remembered::

    worth <= ceilings[f, phase, x, y, memory, q] + p * a + r * b

The recursion needs no rounding of the allowances, and adapting to the shadowing is allowed for
(``proof.md``, step 4 of the proof).

The state of a UAV counts its flying slots f so far. A *phase* says what is known about its
battery: not charged yet; charged so early that it must charge again; or charged so late that its
battery suffices for the rest of the mission. Every phase has a *deadline*, the number of flying
slots at which its battery is empty at the latest, and a *clock*: the latest mission slot in which
flying slot f can take place (``proof.md``, relaxations 4 and 5).
"""

from typing import NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.model.state import STEP_X, STEP_Y
from dess.scenario.scenario import Scenario, ScenarioSpace

_WIDTH = 8  # flying slots whose first charges share a phase


class Phases(NamedTuple):
    """The phases of a mission's UAVs, in the order in which a UAV can pass through them.

    Attributes:
        clock: (P, F) latest mission slot of flying slot f in each phase.
        deadline: (P,) flying slots after which the phase's battery is empty at the latest.
        opens: (P,) flying slots from which on a UAV in this phase may charge.
        closes: (P,) flying slots up to which it may charge; less than ``opens`` if never.
        after: (F,) the phase after a charge that begins after f flying slots.
        charged: (P,) charging slots that a UAV in this phase has had at least.
        slots: The most mission slots that are over at the end of a mission.
    """

    clock: np.ndarray
    deadline: np.ndarray
    opens: np.ndarray
    closes: np.ndarray
    after: np.ndarray
    charged: np.ndarray
    slots: int


def most_flying(scenario: Scenario | ScenarioSpace) -> int:
    """The most slots that a UAV flies before the sea is empty or the mission ends."""
    return min(-(-scenario.quota // scenario.communication_slots), scenario.max_slots)


def early_charges(slots: int, start: int, low: int, full: int) -> np.ndarray:
    """The first flying slots of the phases of charges that do not suffice for the rest.

    Args:
        slots: The most flying slots.
        start, low, full: Battery at the start, and at which charging may begin and ends [%].
    """
    return np.arange(max(start - low, 0), max(slots - full, 0), min(full - low, _WIDTH))


def phases_of(scenario: Scenario) -> Phases:
    """The phases of the UAVs of one mission."""
    slots = most_flying(scenario)
    flying = np.arange(slots)
    if scenario.flight_cost == 0:
        return _without_battery(scenario, flying)
    start, low, full = scenario.flying_time, scenario.charge_start, scenario.charge_complete
    charging = most_charging(scenario, slots)
    # Charges before flying slot ``late`` do not suffice for the rest of the mission.
    first = max(start - low, 0)
    late = min(max(slots - full, 0), slots)
    width = min(full - low, _WIDTH)
    early = early_charges(slots, start, low, full)
    last = np.minimum(early + width, late) - 1
    free = 1 + len(early)
    after = np.full(slots, free)
    after[first:late] = 1 + (flying[first:late] - first) // width
    clock = np.tile(flying + charging, (free + 1, 1))
    clock[0] = flying
    return Phases(
        np.minimum(clock, scenario.max_slots - 1),
        np.array([start, *(last + full), slots]),
        np.array([first, *(early + full - low), slots]),
        np.array([start - 1, *(last + full - 1), 0]),
        after,
        np.array([0] + [-(-(full - low) // scenario.charge_rate)] * free),
        min(slots + int(charging[-1]), scenario.max_slots),
    )


def _without_battery(scenario: Scenario, flying: np.ndarray) -> Phases:
    """One phase without a deadline: flying takes no battery, so a UAV charges once at most."""
    needed = scenario.charge_complete - scenario.flying_time
    charging = int(-(-needed // scenario.charge_rate))
    if scenario.flying_time > scenario.charge_start:
        charging = 0
    slots = np.array([len(flying)])
    never = np.array([0])
    clock = np.minimum(flying + charging, scenario.max_slots - 1)[None, :]
    most = min(len(flying) + charging, scenario.max_slots)
    return Phases(clock, slots, slots, never, never.repeat(len(flying)), never, most)


def most_charging(scenario: Scenario, slots: int) -> np.ndarray:
    """(F,) the most charging slots of a UAV before its flying slot f = 0..F-1.

    A charge begins at a battery of 1 to C_S and ends at C_C, so between two charges a UAV flies
    C_C - C_S to C_C - 1 slots.
    """
    start, low, full = scenario.flying_time, scenario.charge_start, scenario.charge_complete
    most = np.full(slots, -np.inf)  # if the last charge begins after exactly f flying slots
    for f in range(slots):
        if start - low <= f <= start - 1:
            most[f] = -(-(full - start + f) // scenario.charge_rate)
        for flying in range(full - low, min(full - 1, f) + 1):
            most[f] = max(most[f], most[f - flying] - (-flying // scenario.charge_rate))
    return np.maximum(np.maximum.accumulate(most), 0).astype(np.int64)


CHARGE, STOP = 5, 6  # what a UAV can do besides the actions


class Blocks(NamedTuple):
    """The blocks of the nodes, and what a UAV remembers of the block before.

    Attributes:
        home: (W, H) home node of each cell ``x, y``.
        near: (K, N) nodes that a UAV in a node's block can remember; -1 for none.
        place: (K, K) place of a node in the row ``near`` of another one, -1 if it is not there.
        levels: (R,) indices of the local prices at which a node is remembered; the first is 0.
    """

    home: np.ndarray
    near: np.ndarray
    place: np.ndarray
    levels: np.ndarray


def blocks_of(nodes: np.ndarray, size: tuple[int, int], most: int, levels: np.ndarray) -> Blocks:
    """The cells that are nearest to each node, and up to ``most`` blocks beside each block."""
    cells = np.moveaxis(np.indices(size), 0, -1)
    home = np.argmin(((cells[:, :, None] - nodes) ** 2).sum(axis=-1), axis=-1)
    borders = np.zeros((len(nodes), len(nodes)), np.int64)
    for cell, neighbour in ((home[1:], home[:-1]), (home[:, 1:], home[:, :-1])):
        np.add.at(borders, (cell, neighbour), 1)
        np.add.at(borders, (neighbour, cell), 1)
    np.fill_diagonal(borders, 0)
    most = min(most, max(int((borders > 0).sum(axis=1).max()), 1))
    near = np.argsort(-borders, axis=1, kind="stable")[:, :most].copy()  # as all arrays, in C order
    near[np.take_along_axis(borders, near, axis=1) == 0] = -1
    place = np.full(borders.shape, -1)
    for node, row in enumerate(near):
        place[node, row[row >= 0]] = np.nonzero(row >= 0)[0]
    return Blocks(home, near, place, levels)


@kernel
def data_had(data, phases, phase, f):
    """(K,) the data [data units] that each node can have had by flying slot f."""
    return data[phases.clock[phase, min(f, phases.clock.shape[1] - 1)]]


@inlined
def may_charge(to_zone, phases, phase, f, x, y):
    """Whether a UAV may charge after f flying slots."""
    return phases.opens[phase] <= f <= phases.closes[phase] and to_zone[x, y] == 0


@inlined
def is_reached(to_zone, phases, phase, f, x, y):
    """Whether a UAV can be in a cell after f flying slots: it has left a zone before them."""
    width, height = to_zone.shape
    if phase == 0:
        radius = f
    else:
        radius = f - phases.opens[0]
    return 0 <= x < width and 0 <= y < height and to_zone[x, y] <= radius


@inlined
def last_slot(phases, phase, f, slots):
    """The earliest mission slot of the last of f flying slots."""
    return min(max(f - 1, 0) + phases.charged[phase], slots)


@inlined
def memory_of(blocks, home, node, level):
    """The memory of a UAV at ``home`` that remembers a node; 0 for none."""
    place = blocks.place[home, node]
    if level > 0 and place >= 0:
        return 1 + place * (len(blocks.levels) - 1) + level - 1
    return 0


@inlined
def decode_memory(blocks, home, memory):
    """The node and the level of a memory; -1 and 0 for none."""
    if memory == 0:
        return -1, 0
    others = len(blocks.levels) - 1
    return blocks.near[home, (memory - 1) // others], (memory - 1) % others + 1


@inlined
def bound_of_beginning(blocks, local, now, ahead, had, then_had, home, there, level, later, start):
    """The least bound of a step into another block: its value and the local price there.

    Args:
        blocks, local: As in ``bound_paths``.
        now, ahead: (Q,) worth of the slot; (J, Q) ceilings after it.
        had, then_had: (K,) what the nodes have had by this slot, and by the next one.
        home, there: The node left and the node entered.
        level: Level at which the node entered is remembered.
        later: Level at which the node left is going to be remembered.
        start: Index of a local price of ``home``: its allowance is priced at that.
    """
    memory = memory_of(blocks, there, home, later)
    left = 0.0
    if memory > 0:
        left = local[home, blocks.levels[later]]
    new = then_had[there] - (had[there] if level > 0 else 0.0)
    price_there = local[there, blocks.levels[level]]
    least = np.inf
    best = 0
    for q in range(local.shape[1]):
        price = local[there, q]
        value = now[q] + ahead[memory, q] + price * new
        if level > 0:
            value += max(price - price_there, 0.0) * had[there]
        if value < least:
            least = value
            best = q
    least += left * (then_had[home] - had[home])
    return least + max(left - start, 0.0) * had[home], best


class BoundProblem(NamedTuple):
    """What the bound of a mission is computed from, at given prices.

    Attributes:
        to_zone: (W, H) cells on the shortest way from each cell to the nearest charging zone.
        phases: The phases of the UAVs.
        data: (T + 1, K) data [data units] that each node has had by the start of slot t.
        period: (T + 1,) period between cuts of slot t.
        blocks: The blocks of the nodes.
        local: (K, Q) local prices, ascending; the first is 0.
    """

    to_zone: np.ndarray
    phases: Phases
    data: np.ndarray
    period: np.ndarray
    blocks: Blocks
    local: np.ndarray


def bound_paths(problem, values, waiting, ceilings):
    """Bound what a UAV can earn from every state.

    Args:
        problem: The ``BoundProblem``.
        values: From ``step_values``.
        waiting: (T + 1,) what it costs a UAV that its last flying slot is not before slot t.
        ceilings: (F + 1, P, W, H, J, Q) worth of the future per memory and local price,
            overwritten where a UAV can be.
    """
    for f in range(len(ceilings) - 1, -1, -1):  # between two, a signal can end it
        _bound_slot(f, problem, values, waiting, ceilings)


@kernel
def _bound_slot(f, problem, values, waiting, ceilings):
    """Bound what a UAV can earn after f flying slots, from what it can earn after f + 1."""
    to_zone, phases, data, period, blocks, local = problem
    slots = len(ceilings) - 1
    levels = len(blocks.levels)
    width, height = to_zone.shape
    begins = np.empty((5, width, height, levels, levels))
    scratch = np.empty(local.shape[1]), np.empty(local.shape[1])
    for phase in range(len(phases.deadline) - 1, -1, -1):
        if phase > 0 and f < min(phases.opens[0], slots):
            continue
        ceiling = ceilings[f, phase]
        ceiling[:] = -waiting[last_slot(phases, phase, f, len(waiting) - 1)]
        if f == slots:
            continue
        had = data_had(data, phases, phase, f)
        then_had = data_had(data, phases, phase, f + 1)
        if f < phases.deadline[phase]:
            gain = values[period[phases.clock[phase, f]]]
            then = ceilings[f + 1, phase]
            _bound_beginnings(
                to_zone, phases, f, phase, blocks, local, gain, then, had, then_had, begins
            )
            for x in range(width):
                for y in range(height):
                    if is_reached(to_zone, phases, phase, f, x, y):
                        _raise_by_acting(
                            to_zone, phases, f, phase, blocks, local, gain, then, had, then_had,
                            begins, x, y, scratch, ceiling[x, y],
                        )  # fmt: skip
        target = phases.after[f]
        for x in range(width):
            for y in range(height):
                if may_charge(to_zone, phases, phase, f, x, y):
                    new = data_had(data, phases, target, f) - had
                    _raise_by_charging(
                        blocks, local, new, ceilings[f, target, x, y], x, y, ceiling[x, y]
                    )


@inlined
def _raise_by_charging(blocks, local, new, charged, x, y, here):
    """Raise the ceilings of a state to what it is worth after a charge."""
    home = blocks.home[x, y]
    for memory in range(len(here)):
        node, level = decode_memory(blocks, home, memory)
        more = 0.0
        if memory > 0:
            more = local[node, blocks.levels[level]] * new[node]
        for q in range(local.shape[1]):
            value = charged[memory, q] + local[home, q] * new[home] + more
            here[memory, q] = max(here[memory, q], value)


@inlined
def _bound_beginnings(to_zone, phases, f, phase, blocks, local, gain, then, had, then_had, begins):
    """The least bounds of all steps into another block, per level of memory before and after."""
    levels = len(blocks.levels)
    width, height = to_zone.shape
    for action in range(4):
        for x in range(width):
            for y in range(height):
                x2 = x + STEP_X[action]
                y2 = y + STEP_Y[action]
                if not is_reached(to_zone, phases, phase, f + 1, x2, y2):
                    continue
                home, next_home = blocks.home[x, y], blocks.home[x2, y2]
                if next_home == home or not is_reached(to_zone, phases, phase, f, x, y):
                    continue
                for level in range(levels):
                    for later in range(levels):
                        begins[action, x2, y2, level, later], _ = bound_of_beginning(
                            blocks, local, gain[action, x2, y2], then[x2, y2], had, then_had,
                            home, next_home, level, later, np.inf,
                        )  # fmt: skip


@inlined
def _raise_by_acting(
    to_zone, phases, f, phase, blocks, local, gain, then, had, then_had, begins, x, y, scratch, here
):  # fmt: skip
    """Raise the ceilings of a state to what its actions can earn."""
    home = blocks.home[x, y]
    prices = local.shape[1]
    line, least = scratch
    for action in range(5):
        x2 = x + STEP_X[action]
        y2 = y + STEP_Y[action]
        if not is_reached(to_zone, phases, phase, f + 1, x2, y2):
            continue
        next_home = blocks.home[x2, y2]
        for memory in range(len(here)):
            node, level = decode_memory(blocks, home, memory)
            if node < 0 and memory > 0:  # this block has fewer neighbours
                break
            if next_home != home:
                begin = begins[action, x2, y2, level if node == next_home else 0]
                for q in range(prices):
                    value = np.inf
                    for later in range(len(begin)):
                        left = local[home, blocks.levels[later]]
                        rise = max(left - local[home, q], 0.0) * had[home]
                        value = min(value, begin[later] + rise)
                    here[memory, q] = max(here[memory, q], value)
                continue
            more = 0.0
            if memory > 0:
                more = local[node, blocks.levels[level]] * (then_had[node] - had[node])
            low = np.inf
            for q in range(prices):
                value = gain[action, x2, y2, q] + then[x2, y2, memory, q] + more
                line[q] = value + local[home, q] * (then_had[home] - had[home])
                low = min(low, line[q])
                least[q] = low
            low = np.inf
            for q in range(prices - 1, -1, -1):
                low = min(low, line[q] + local[home, q] * had[home])
                value = min(least[q], low - local[home, q] * had[home])
                here[memory, q] = max(here[memory, q], value)
