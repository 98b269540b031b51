"""The network of sets in integers: from compact states to actions in one compiled function.

    decide(states, missions, uavs, sea, tables, integers, actions)

Weights have 16 bits, activations 14, and sums 32, which no sum can exceed
(``dess.policies.quantization``). So a decision is the same on every machine, whatever instructions
compute it, and however many UAVs decide together. Of equal values the first action is taken.
"""

from collections import namedtuple
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dess.base.errors import InputError
from dess.base.kernels import inlined, kernel
from dess.base.vectors import MOST, layer, pool
from dess.envs.observations import sets
from dess.envs.observations.sets import MOVES, Parts, memory_of, observe
from dess.envs.observations.states import MASK
from dess.model.state import HOVER

HIDDEN = (32, 16, 128)  # the widths that are compiled: of nodes, of teammates and zones, joint
ACTIONS = HOVER + 1
_JOINT = HIDDEN[2]
OWN, ACTION = sets.OWN, sets.ACTION
# Columns of nodes, teammates and zones, filled up to an even number, and the widths of their
# layers.
SETS = ((sets.NODE, 32), (sets.MATE + 1, 16), (sets.ZONE + 1, 16))
_POOLED = [2 * width for _, width in SETS]
# Inputs and outputs of the layers. Only one of the last has weights.
LAYERS = {
    **{
        f"{name}{number}": shape
        for number, (columns, width) in enumerate(SETS)
        for name, shape in (
            ("context", (OWN, width)),
            ("inputs", (columns, width)),
            ("layer", (width, width)),
            ("values", (width, 2 * width)),
        )
    },
    "own": (OWN + sum(_POOLED), _JOINT),
    "moves": (ACTION + 2 * sum(_POOLED), _JOINT),
    "state": (_JOINT, _JOINT),
    "hidden": (_JOINT, _JOINT // 2),
    "advantage": (_JOINT // 2, 8),
}
# Those whose sums begin with a bias and are shifted. ``inputs`` and ``moves`` go on with sums that
# ``context`` and ``state`` have begun.
SHIFTED = tuple(n for n in LAYERS if not n.startswith(("inputs", "moves", "advantage")))
# The scales of inputs, with their numbers of columns.
SCALES = {"own": OWN, "action": ACTION} | {f"lines{n}": SETS[n][0] for n in range(len(SETS))}


def _starts(sizes: dict[str, int]) -> Any:
    """Where arrays of these sizes begin that lie one after the other, by name."""
    *starts, _ = accumulate(sizes.values(), initial=0)
    return namedtuple("_starts", sizes)(*starts)  # type: ignore[arg-type]


WEIGHTS_AT = _starts({name: inputs * outputs for name, (inputs, outputs) in LAYERS.items()})
BIASES_AT = _starts({name: LAYERS[name][1] for name in SHIFTED})
SHIFTS_AT = _starts(dict.fromkeys(SHIFTED, 1))
SCALES_AT = _starts(SCALES)
_W, _B, _S, _C = WEIGHTS_AT, BIASES_AT, SHIFTS_AT, SCALES_AT
ROWS = 4  # members of a set that are computed together
(_NODE, _WIDE), (_MATE, _NARROW), (_ZONE, _) = SETS
(_STATE, _), (_MOVE, _), (_LAST, _) = LAYERS["own"], LAYERS["moves"], LAYERS["advantage"]
_LONGEST = _MOVE // 2
# The actions whose only bit is in a mask.
_SINGLE = np.array([max(mask.bit_length() - 1, 0) for mask in range(1 << ACTIONS)])


class Integers(NamedTuple):
    """The weights of a network in integers, which lie one after the other.

    Attributes:
        weights: (W,) those of ``LAYERS``, as int16; each as ``dess.base.vectors`` has them.
        biases: (B,) those of ``SHIFTED``, with a half of what the shift takes, as int32.
        shifts: (12,) the shifts of ``SHIFTED``, as int32.
        scales: (S,) those of ``SCALES``, as float32.
    """

    weights: np.ndarray
    biases: np.ndarray
    shifts: np.ndarray
    scales: np.ndarray


def integer_forms() -> dict[str, np.ndarray]:
    """Arrays of the forms of ``Integers``, by name."""
    return Integers(
        np.empty(sum(inputs * outputs for inputs, outputs in LAYERS.values()), np.int16),
        np.empty(sum(LAYERS[name][1] for name in SHIFTED), np.int32),
        np.empty(len(SHIFTED), np.int32),
        np.empty(sum(SCALES.values()), np.float32),
    )._asdict()


def check_integers(integers: Integers, path: Path) -> None:
    """Refuse integers of a file with which a shift could be impossible, or a sum too large.

    Raises:
        InputError: If there is one.
    """
    if not ((integers.shifts >= 1) & (integers.shifts <= 31)).all():
        raise InputError(path, "shifts has impossible values", "1 to 31")
    if not ((integers.scales >= 0) & (integers.scales <= 2**20)).all():
        raise InputError(path, "scales has impossible values", "0 to 2**20")


class SetMemory(NamedTuple):
    """What is computed of the members of a set.

    Attributes:
        lines: (N, columns) the inputs.
        first, second: (rows, width) the hidden layers of as many members as are computed together.
        values: (N, 2 * width) the values to be pooled.
        factors: (9, N) by which they are multiplied.
    """

    lines: np.ndarray
    first: np.ndarray
    second: np.ndarray
    values: np.ndarray
    factors: np.ndarray


class Memory(NamedTuple):
    """What a decision computes on the way.

    Attributes:
        own, actions: (30,) and (5, 14) inputs.
        nodes, mates, zones: The sets.
        state, joint: (158,) what the state is computed from, and (128,) the state.
        moves: (4, 270) what the moves are computed from.
        hidden, last: (2, 128) and (64,) the hidden layers of actions.
        sums: (128,) the sums with which other sums begin.
        value: (8,) the value of an action, and nothing else.
        every: (N,) the numbers from 0 on.
        listed: (N,) some of these.
    """

    own: np.ndarray
    actions: np.ndarray
    nodes: SetMemory
    mates: SetMemory
    zones: SetMemory
    state: np.ndarray
    joint: np.ndarray
    moves: np.ndarray
    hidden: np.ndarray
    last: np.ndarray
    sums: np.ndarray
    value: np.ndarray
    every: np.ndarray
    listed: np.ndarray


@kernel
def _set_memory(members, columns, width):
    room = (members + ROWS - 1) // ROWS * ROWS
    return SetMemory(
        np.zeros((room, columns), np.int16),
        np.zeros((ROWS, width), np.int16),
        np.zeros((ROWS, width), np.int16),
        np.zeros((room, 2 * width), np.int16),
        np.zeros((MOVES, members), np.int16),
    )


@kernel
def _memory(nodes, mates, zones):
    i2, i4 = np.int16, np.int32
    most = max(_LONGEST, nodes, mates, zones)
    return Memory(
        np.zeros(OWN, i2),
        np.zeros((ACTIONS, ACTION), i2),
        _set_memory(nodes, _NODE, _WIDE),
        _set_memory(mates, _MATE, _NARROW),
        _set_memory(zones, _ZONE, _NARROW),
        np.zeros(_STATE, i2),
        np.zeros(_JOINT, i2),
        np.zeros((HOVER, _MOVE), i2),
        np.zeros((2, _JOINT), i2),
        np.zeros(_LAST, i2),
        np.zeros(_JOINT, i4),
        np.zeros(8, i4),
        np.arange(most).astype(i4),
        np.zeros(most, i4),
    )


@kernel
def _empty_parts(nodes, mates, zones):
    f4 = np.float32
    return Parts(
        np.empty(OWN, f4),
        np.empty((ACTIONS, ACTION), f4),
        np.empty((nodes, sets.NODE), f4),
        np.empty((MOVES, nodes), f4),
        np.empty((mates, sets.MATE), f4),
        np.empty((MOVES, mates), f4),
        np.empty((zones, sets.ZONE), f4),
        np.empty((MOVES, zones), f4),
    )


@inlined
def round_inputs(values, scales, out):
    """Write float32 inputs as integers."""
    most = np.float32(MOST)
    for c in range(len(values)):
        rounded = np.floor(values[c] * scales[c] + np.float32(0.5))
        out[c] = min(max(rounded, -most), most)


@inlined
def _round_factors(values, out):
    """Write factors from -1 to 1 as integers, of which 32767 is one."""
    for c in range(len(values)):
        rounded = np.floor(values[c] * np.float32(32768.0) + np.float32(0.5))
        out[c] = min(max(rounded, np.float32(-32767.0)), np.float32(32767.0))


@inlined
def list_pairs(a, b, listed):
    """List the pairs that are not zero in one of two rows; return how many."""
    count = 0
    for number in range(len(a)):
        listed[count] = number
        count += (a[number] | b[number]) != 0
    return count


def _set_function(number: int) -> Any:
    """The function that pools a set for the state and for the moves."""
    columns, width = SETS[number]
    pooled = 2 * width
    base = layer(1, width)
    first, second, third = layer(ROWS, width), layer(ROWS, width), layer(ROWS, pooled)
    take_best = pool(pooled)
    context, inputs, hidden, values = (
        getattr(WEIGHTS_AT, f"{name}{number}") for name in ("context", "inputs", "layer", "values")
    )
    biases = [getattr(BIASES_AT, f"{name}{number}") for name in ("context", "layer", "values")]
    context_bias, hidden_bias, values_bias = biases
    shift = getattr(SHIFTS_AT, f"context{number}")
    scales_at = getattr(SCALES_AT, f"lines{number}")
    state_at = OWN + sum(_POOLED[:number])
    moves_at = ACTION + 2 * sum(_POOLED[:number])

    def pool_set(lines, moves, integers, of_set, memory):
        weights, biases, shifts, scales = integers
        listed = memory.listed
        every = memory.every
        members = len(lines)
        sums = memory.sums
        base(sums, memory.own, weights[context:], biases[context_bias:], every, OWN // 2, 0, 0)
        for n in range(members):
            round_inputs(lines[n], scales[scales_at:], of_set.lines[n])
        for n in range(0, members, ROWS):
            first(
                of_set.first, of_set.lines[n:], weights[inputs:], sums, every, columns // 2,
                shifts[shift], 0,
            )  # fmt: skip
            second(
                of_set.second, of_set.first, weights[hidden:], biases[hidden_bias:], every,
                width // 2, shifts[shift + 1], 0,
            )  # fmt: skip
            third(
                of_set.values[n:], of_set.second, weights[values:], biases[values_bias:], every,
                width // 2, shifts[shift + 2], -MOST,
            )  # fmt: skip
        for part in range(MOVES):
            factors = of_set.factors[part]
            _round_factors(moves[part], factors)
            count = 0
            for n in range(members):
                listed[count] = n
                count += factors[n] > 0
            if part == MOVES - 1:
                take_best(memory.state[state_at:], of_set.values, factors, listed, count)
            else:
                out = memory.moves[part % HOVER, moves_at + part // HOVER * pooled :]
                take_best(out, of_set.values, factors, listed, count)

    return inlined(pool_set)


_pool_nodes, _pool_mates, _pool_zones = map(_set_function, range(len(SETS)))
_to_joint = layer(1, _JOINT)
_to_joint_of_two = layer(2, _JOINT)
_to_last = layer(1, _LAST)
_to_value = layer(1, 8)


@inlined
def _value(row, integers, memory):
    """The value of an action, of which the first hidden layer is in a row of the memory."""
    weights, biases, shifts, _ = integers
    numbers = memory.hidden[row].view(np.int32)
    count = list_pairs(numbers, numbers, memory.listed)
    _to_last(
        memory.last, memory.hidden[row], weights[_W.hidden :], biases[_B.hidden :], memory.listed,
        count, shifts[_S.hidden], 0,
    )  # fmt: skip
    memory.value[:] = 0
    _to_value(
        memory.value, memory.last, weights[_W.advantage :], memory.value, memory.every, _LAST // 2,
        0, 0,
    )  # fmt: skip
    return memory.value[0]


@inlined
def _best_action(parts, mask, integers, memory):
    """The action of the highest value that a mask allows, the first of those that are equal.

    Moves are computed two at a time, which read the same weights.
    """
    weights, biases, shifts, scales = integers
    listed = memory.listed
    round_inputs(parts.own, scales[_C.own :], memory.own)
    for action in range(ACTIONS):
        round_inputs(parts.actions[action], scales[_C.action :], memory.actions[action])
    for c in range(OWN):
        memory.state[c] = memory.own[c]
    for move in range(HOVER):
        for c in range(ACTION):
            memory.moves[move, c] = memory.actions[move, c]
    _pool_nodes(parts.nodes, parts.node_moves, integers, memory.nodes, memory)
    _pool_mates(parts.mates, parts.mate_moves, integers, memory.mates, memory)
    _pool_zones(parts.zones, parts.zone_moves, integers, memory.zones, memory)
    numbers = memory.state.view(np.int32)
    count = list_pairs(numbers, numbers, listed)
    _to_joint(
        memory.joint, memory.state, weights[_W.own :], biases[_B.own :], listed, count,
        shifts[_S.own], 0,
    )  # fmt: skip
    numbers = memory.joint.view(np.int32)
    count = list_pairs(numbers, numbers, listed)
    _to_joint(
        memory.sums, memory.joint, weights[_W.state :], biases[_B.state :], listed, count, 0, 0
    )
    shift = shifts[_S.state]
    best = -1
    highest = 0
    for first in range(0, HOVER, 2):
        second = first + 1
        if mask >> first & 3 == 0:
            continue
        moves = memory.moves[first:]
        count = list_pairs(moves[0].view(np.int32), moves[1].view(np.int32), listed)
        _to_joint_of_two(
            memory.hidden, moves, weights[_W.moves :], memory.sums, listed, count, shift, 0
        )
        for action in range(first, second + 1):
            if mask >> action & 1:
                value = _value(action - first, integers, memory)
                if best < 0 or value > highest:
                    best = action
                    highest = value
    if mask >> HOVER & 1:
        _to_joint(
            memory.hidden, memory.actions[HOVER], weights[_W.moves :], memory.sums, memory.every,
            ACTION // 2, shift, 0,
        )  # fmt: skip
        value = _value(0, integers, memory)
        if best < 0 or value > highest:
            best = HOVER
    return best


@kernel
def decide(states, missions, uavs, sea, tables, integers, actions):
    """Write the actions of UAVs on a sea, each the best of those that its mask allows.

    Args:
        states: ``CompactStates``.
        missions, uavs: (R,) the state and the index of each UAV.
        sea, tables: The ``Sea`` and its ``Tables``.
        integers: The ``Integers``.
        actions: (R,) where the actions are written.
    """
    nodes = len(sea.nodes)
    mates = states.uavs.shape[1] - 1
    zones = len(sea.pads)
    observed = memory_of(sea)
    parts = _empty_parts(nodes, mates, zones)
    memory = _memory(nodes, mates, zones)
    for row in range(len(missions)):
        b = missions[row]
        i = uavs[row]
        mask = np.int64(states.uavs[b, i, MASK])
        if mask & (mask - 1) == 0:  # one action alone
            actions[row] = _SINGLE[mask]
            continue
        observe(states, b, i, sea, tables, observed, parts)
        actions[row] = _best_action(parts, mask, integers, memory)
