"""The network in integers in plain numpy, layer by layer, with sums of 64 bits."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dess.base.vectors import MOST
from dess.model.state import HOVER
from dess.policies.dense import BLOCK, VALUES, filled_widths
from dess.policies.integers import ACTIONS, LAYERS, SCALES, SETS, SHIFTED, Integers


class Result(NamedTuple):
    """What the network computes of R observations.

    Attributes:
        values: (R, 5) the values of the actions.
        clipped: How many activations were clipped from above, by their names.
        activations: How many there were.
    """

    values: np.ndarray
    clipped: dict[str, int]
    activations: int


def _unpack(integers: Integers) -> dict[str, np.ndarray]:
    """The (inputs, outputs) weights of each layer, as ``LAYERS`` has them."""
    sizes = [inputs * outputs for inputs, outputs in LAYERS.values()]
    parts = np.split(integers.weights, np.cumsum(sizes)[:-1])
    return {
        name: part.reshape(-1, shape[1], 2).swapaxes(1, 2).reshape(shape)
        for part, (name, shape) in zip(parts, LAYERS.items(), strict=True)
    }


class PlainDense:
    """The dense network of ``Integers``, with these numbers of inputs and of hidden units."""

    def __init__(self, integers: Integers, inputs: int, hidden: Sequence[int]) -> None:
        self._integers = integers
        self._widths = [*filled_widths(inputs, hidden), VALUES]

    def __call__(self, vectors: np.ndarray) -> Result:
        """The values of (R, F) vectors."""
        weights, biases, shifts, scales = self._integers
        scaled = np.zeros((len(vectors), self._widths[0]), np.float32)
        scaled[:, : vectors.shape[1]] = vectors * scales[: vectors.shape[1]]
        values = np.floor(scaled + np.float32(0.5))
        clipped = {"inputs": int((np.abs(values) > MOST).sum())}
        activations = values.size
        values = values.clip(-MOST, MOST).astype(np.int64)
        for number, (before, width) in enumerate(pairwise(self._widths)):
            block = min(width, BLOCK)
            matrix, weights = np.split(weights, [before * width])
            bias, biases = np.split(biases, [width])
            blocks = matrix.astype(np.int64).reshape(width // block, before // 2, block, 2)
            sums = values @ blocks.transpose(1, 3, 0, 2).reshape(before, width) + bias
            assert np.abs(sums).max() < 2**31
            if number == len(shifts):
                return Result(sums[:, :ACTIONS], clipped, activations)
            values = sums >> shifts[number]
            clipped[f"{number}"] = int((values > MOST).sum())
            activations += values.size
            values = values.clip(0, MOST)
        raise AssertionError("no layer of values")


class PlainIntegers:
    """The network of ``Integers``."""

    def __init__(self, integers: Integers) -> None:
        self._weights = {name: w.astype(np.int64) for name, w in _unpack(integers).items()}
        sizes = [self._weights[name].shape[1] for name in SHIFTED]
        self._biases = self._parts(integers.biases, SHIFTED, sizes)
        self._shifts = dict(zip(SHIFTED, integers.shifts.tolist(), strict=True))
        self._scales = self._parts(integers.scales, [*SCALES], [*SCALES.values()])

    def _parts(self, values: np.ndarray, names, sizes) -> dict[str, np.ndarray]:
        return dict(zip(names, np.split(values, np.cumsum(sizes)[:-1]), strict=True))

    def __call__(self, own: np.ndarray, actions: np.ndarray, *sets: np.ndarray) -> Result:
        """The values from the arrays of ``Sets.encode``."""
        self._clipped: dict[str, int] = {}
        self._activations = 0
        own = self._enter("own", own)
        actions = self._enter("action", actions)
        pooled, moves = [own], [actions[:, :HOVER]]
        for number in range(len(SETS)):
            lines, factors = sets[2 * number : 2 * number + 2]
            exists = factors[:, -1, :, None] > 0
            lines = self._enter(f"lines{number}", lines)
            context = self._sums(f"context{number}", own)[:, None]
            products = lines @ self._weights[f"inputs{number}"][: lines.shape[2]]
            hidden = self._shift(f"context{number}", products + context, 0, exists)
            hidden = self._shift(f"layer{number}", self._sums(f"layer{number}", hidden), 0, exists)
            sums = self._sums(f"values{number}", hidden)
            values = self._shift(f"values{number}", sums, -MOST, exists)
            factors = np.floor(factors * np.float32(2**15) + np.float32(0.5)).clip(0, 32767)
            products = factors.astype(np.int64)[..., None] * values[:, None]
            best = ((products + 2**14) >> 15).max(2, initial=0)
            pooled.append(best[:, -1])
            moves.append(np.concatenate([best[:, :HOVER], best[:, HOVER:-1]], -1))
        state = self._shift("own", self._sums("own", np.concatenate(pooled, 1)), 0)
        matrix = self._weights["moves"]
        hover = actions[:, HOVER:] @ matrix[: actions.shape[2]]
        hidden = np.concatenate([np.concatenate(moves, 2) @ matrix, hover], 1)
        hidden = self._shift("state", hidden + self._sums("state", state)[:, None], 0)
        last = self._shift("hidden", self._sums("hidden", hidden), 0)
        return Result((last @ self._weights["advantage"])[..., 0], self._clipped, self._activations)

    def _enter(self, name: str, values: np.ndarray) -> np.ndarray:
        rounded = np.floor(values * self._scales[name][: values.shape[-1]] + np.float32(0.5))
        self._count(name, np.abs(rounded) > MOST)
        return rounded.clip(-MOST, MOST).astype(np.int64)

    def _sums(self, name: str, values: np.ndarray) -> np.ndarray:
        sums = values @ self._weights[name] + self._biases[name]
        assert np.abs(sums).max(initial=0) < 2**31
        return sums

    def _shift(self, name: str, sums: np.ndarray, least: int, exists=True) -> np.ndarray:
        values = sums >> self._shifts[name]
        self._count(name, (values > MOST) & exists)
        return values.clip(least, MOST)

    def _count(self, name: str, is_clipped: np.ndarray) -> None:
        self._clipped[name] = int(is_clipped.sum())
        self._activations += is_clipped.size
