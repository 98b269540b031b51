"""A dense network in integers: from vectors to actions in one compiled function.

    choose(vectors, masks, widths, integers, actions)

Its weights, activations and sums have the bits of ``dess.policies.integers``.
"""

from collections.abc import Sequence

import numpy as np

from dess.base.kernels import kernel
from dess.base.vectors import layer
from dess.policies.integers import ACTIONS, Integers, list_pairs, round_inputs

BLOCK = 128  # outputs of a layer that are computed together
VALUES = 8  # outputs of the last layer, of which the first are the values of actions
_to_block = layer(1, BLOCK)
_to_values = layer(1, VALUES)


def filled_widths(inputs: int, hidden: Sequence[int]) -> tuple[int, ...]:
    """The numbers of inputs and of hidden units, filled up to whole pairs and blocks."""
    return inputs + inputs % 2, *(-(-width // BLOCK) * BLOCK for width in hidden)


def dense_forms(inputs: int, hidden: Sequence[int]) -> dict[str, np.ndarray]:
    """Arrays of the forms of ``Integers``, by name.

    The weights of a layer are those of its blocks, one after the other.
    """
    widths = filled_widths(inputs, hidden)
    count = widths[-1] * VALUES
    for before, width in zip(widths, widths[1:], strict=False):
        count += before * width
    units = 0
    for width in widths[1:]:
        units += width
    return Integers(
        np.empty(count, np.int16),
        np.empty(units + VALUES, np.int32),
        np.empty(len(hidden), np.int32),
        np.empty(widths[0], np.float32),
    )._asdict()


@kernel
def choose(vectors, masks, widths, integers, actions):
    """Write the actions for vectors, each the best of those that its mask allows.

    Of equal values, the first action is taken.

    Args:
        vectors: (R, F) float32 inputs.
        masks: (R,) whose bits are the allowed actions.
        widths: ``filled_widths``.
        integers: The ``Integers``.
        actions: (R,) where the actions are written.
    """
    weights, biases, shifts, scales = integers
    widest = widths.max()
    values = np.zeros(widest, np.int16)
    following = np.zeros(widest, np.int16)
    sums = np.zeros(VALUES, np.int32)
    listed = np.zeros(widest // 2 + 1, np.int32)
    for row in range(len(vectors)):
        values[:] = 0
        round_inputs(vectors[row], scales, values)
        weights_at = 0
        biases_at = 0
        for number in range(len(shifts)):
            pairs = values[: widths[number]].view(np.int32)
            count = list_pairs(pairs, pairs, listed)
            for first in range(0, widths[number + 1], BLOCK):
                _to_block(
                    following[first:], values, weights[weights_at:], biases[biases_at:], listed,
                    count, shifts[number], 0,
                )  # fmt: skip
                weights_at += widths[number] * BLOCK
                biases_at += BLOCK
            values, following = following, values
        pairs = values[: widths[-1]].view(np.int32)
        count = list_pairs(pairs, pairs, listed)
        _to_values(sums, values, weights[weights_at:], biases[biases_at:], listed, count, 0, 0)
        best = -1
        for action in range(ACTIONS):
            is_allowed = masks[row] >> action & 1
            if is_allowed and (best < 0 or sums[action] > sums[best]):
                best = action
        actions[row] = best
