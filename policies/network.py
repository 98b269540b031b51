"""The networks with which learned policies act: matrix products and compiled loops, no PyTorch.

    network = DuelingNetwork(weights, np.float32)      # arrays by their names in a training
    values = network(vector)                           # (R, 5)

A training has a network of PyTorch for each of them, in ``dess.policies.learner.network``. Layers
with no ReLU between them are here one layer, which is computed in double precision and then rounded
to the type in which the network computes.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from dess.base.kernels import kernel
from dess.model.state import ACTION_NAMES, HOVER

ACTIONS = len(ACTION_NAMES)
KERNELS, KERNEL_SIZE = 16, 5
NARROWEST = 2 * (KERNEL_SIZE - 1) + 1  # smallest width of a map: two convolutions leave one cell
DENSE = (256, 256, 256)
SETS = range(3)  # nodes, teammates and zones

# Layers without a bias, by the last part of their names.
UNBIASED = {"action", "inputs", "of_all", "nearer", "along"}

Weights = Mapping[str, np.ndarray]
Shapes = Sequence[Sequence[int]]
Sizes = dict[str, tuple[int, ...]]  # of layers by name: the outputs and the inputs
Layer = tuple[np.ndarray, np.ndarray]  # the matrix (inputs, outputs) and the bias (outputs,)


class PaperNetwork:
    """The paper's network: two convolutions on each map, then dense layers (Section VI-A).

    Attributes:
        rows: How many rows it evaluates together, so that what it computes stays in the cache.
    """

    rows = 32

    @staticmethod
    def layer_sizes(shapes: Shapes, hidden: Sequence[int] = ()) -> Sizes:
        """The sizes of the layers.

        Args:
            shapes: Shapes of one row of each input.
            hidden: Widths of the hidden layers of the other networks; not used.
        """
        width = sum(shapes[2])
        size = (KERNEL_SIZE, KERNEL_SIZE)
        sizes: Sizes = {}
        for name, (layers, rows, columns) in zip(("local", "far"), shapes[:2], strict=True):
            sizes |= {f"{name}.0": (KERNELS, layers, *size), f"{name}.2": (KERNELS, KERNELS, *size)}
            width += KERNELS * (rows - NARROWEST + 1) * (columns - NARROWEST + 1)
        return sizes | _dense_layer_sizes([width, *DENSE]) | {"values": (ACTIONS, DENSE[-1])}

    def __init__(self, weights: Weights, dtype: Any) -> None:
        """Make it of weights for computing in ``dtype``, float32 or float64."""
        self._maps = [
            [_read_convolution(weights, f"{name}.{number}", dtype) for number in (0, 2)]
            for name in ("local", "far")
        ]
        self._hidden = [_cast_layer(dtype, *layer) for layer in read_hidden_layers(weights)]
        self._values = _cast_layer(dtype, *read_layer(weights, "values"))

    def __call__(self, local: np.ndarray, far: np.ndarray, own: np.ndarray) -> np.ndarray:
        """The values (R, 5) of the actions, from the arrays of ``Maps.encode``."""
        maps = zip((local, far), self._maps, strict=True)
        seen = [_apply_convolutions(inputs, *layers) for inputs, layers in maps]
        matrix, bias = self._values
        return _apply_layers(self._hidden, np.concatenate([*seen, own], 1)) @ matrix + bias


class DuelingNetwork:
    """A dueling network on vectors: dense layers, then ``Q = V + A - mean A``."""

    rows = 1024

    @staticmethod
    def layer_sizes(shapes: Shapes, hidden: Sequence[int]) -> Sizes:
        """The inputs and outputs of each layer, by its name."""
        widths = [*shapes[0], *hidden]
        ends = {"value": (1, widths[-1]), "advantage": (ACTIONS, widths[-1])}
        return _dense_layer_sizes(widths) | ends

    def __init__(self, weights: Weights, dtype: Any) -> None:
        """Make it of weights for computing in ``dtype``, float32 or float64."""
        self._hidden = [_cast_layer(dtype, *layer) for layer in read_hidden_layers(weights)]
        ends = zip(read_layer(weights, "value"), read_layer(weights, "advantage"), strict=True)
        self._values = _cast_layer(dtype, *(v + a - a.mean(-1, keepdims=True) for v, a in ends))

    def __call__(self, vector: np.ndarray) -> np.ndarray:
        """The values (R, 5) of the actions, from vectors (R, inputs)."""
        matrix, bias = self._values
        return _apply_layers(self._hidden, vector) @ matrix + bias


class SetNetwork:
    """A dueling network for the sets of any sea: it takes the best of what is in them."""

    rows = 64

    @staticmethod
    def layer_sizes(shapes: Shapes, hidden: Sequence[int]) -> Sizes:
        """The inputs and outputs of each layer, by its name."""
        (own_inputs,), (_, action), *sets = shapes
        nodes, others, joint = hidden
        sizes: Sizes = {
            "own": (joint, own_inputs),
            "action": (joint, action),
            "state": (joint, joint),
        }
        sizes |= {"hidden": (joint // 2, joint), "value": (1, joint), "advantage": (1, joint // 2)}
        for number, width in enumerate((nodes, others, others)):
            of_set = {"context": (width, own_inputs), "inputs": (width, sets[2 * number][-1])}
            of_set |= {"layer": (width, width), "values": (2 * width, width)}
            of_set |= dict.fromkeys(("of_all", "nearer", "along"), (joint, 2 * width))
            sizes |= {f"sets.{number}.{name}": size for name, size in of_set.items()}
        return sizes

    def __init__(self, weights: Weights, dtype: Any) -> None:
        """Make it of weights for computing in ``dtype``, float32 or float64."""

        def layer(name: str) -> Layer:
            return _cast_layer(dtype, *read_layer(weights, name))

        def of_sets(*names: str) -> list[np.ndarray]:
            return [layer(f"sets.{number}.{name}")[0] for number in SETS for name in names]

        names = ("context", "inputs", "layer", "values")
        self._sets = [[layer(f"sets.{number}.{name}") for name in names] for number in SETS]
        own_matrix, bias = layer("own")
        self._own = np.concatenate([own_matrix, *of_sets("of_all")]), bias
        self._action, _ = layer("action")
        self._moves = np.concatenate([self._action, *of_sets("nearer", "along")])
        self._state, self._hidden, self._value = map(layer, ("state", "hidden", "value"))
        self._advantage, _ = layer("advantage")  # what all advantages share changes nothing
        self._centred = (np.eye(ACTIONS) - 1 / ACTIONS).astype(dtype)

    def __call__(self, own: np.ndarray, actions: np.ndarray, *sets: np.ndarray) -> np.ndarray:
        """The values (R, 5) of the actions, from the arrays of ``Sets.encode``."""
        matrix, bias = self._own
        rows = len(own)
        state = np.empty((rows, len(matrix)), own.dtype)
        moves = np.empty((HOVER, rows, len(self._moves)), own.dtype)
        at = own.shape[1], actions.shape[2]
        state[:, : at[0]] = own
        moves[..., : at[1]] = actions[:, :HOVER].swapaxes(0, 1)
        for layers, lines, factors in zip(self._sets, sets[::2], sets[1::2], strict=True):
            context, (inputs, _), layer, (values, shift) = layers
            of_rows = lines.reshape(-1, lines.shape[2]) @ inputs
            _add_and_rectify(of_rows, own @ context[0] + context[1], lines.shape[1])
            products = _apply_layers([layer], of_rows) @ values
            products = products.reshape(*lines.shape[:2], len(shift))
            _pool_products(products, shift, factors, state, moves, at)
            at = at[0] + len(shift), at[1] + 2 * len(shift)
        state = _apply_layers([self._own], state)
        hidden = np.empty((ACTIONS, *state.shape), own.dtype)
        np.matmul(moves, self._moves, out=hidden[:HOVER])
        np.matmul(actions[:, HOVER], self._action, out=hidden[HOVER])
        hidden = hidden.reshape(-1, len(bias))
        _add_and_rectify(hidden, state @ self._state[0] + self._state[1], 1)
        advantage = (_apply_layers([self._hidden], hidden) @ self._advantage).reshape(ACTIONS, rows)
        return state @ self._value[0] + self._value[1] + (self._centred @ advantage).T


def weight_shapes(layers: Sizes) -> dict[str, tuple[int, ...]]:
    """The shapes of the weights of layers, by name."""
    biased = {name: size for name, size in layers.items() if name.split(".")[-1] not in UNBIASED}
    forms = {f"{name}.weight": size for name, size in layers.items()}
    return forms | {f"{name}.bias": size[:1] for name, size in biased.items()}


def _dense_layer_sizes(widths: Sequence[int]) -> Sizes:
    """The sizes of dense layers of the given widths, inputs first."""
    pairs = enumerate(pairwise(widths))
    return {f"hidden.{2 * number}": (outputs, inputs) for number, (inputs, outputs) in pairs}


def read_layer(weights: Weights, name: str) -> Layer:
    """A linear layer in double precision; one without a bias has zeros."""
    matrix = weights[f"{name}.weight"].T.astype(np.float64)
    bias = weights.get(f"{name}.bias", np.zeros(matrix.shape[1]))
    return matrix, bias.astype(np.float64)


def read_hidden_layers(weights: Weights) -> list[Layer]:
    """The dense layers in double precision, each of which is followed by a ReLU."""
    count = sum(name.startswith("hidden.") for name in weights) // 2
    return [read_layer(weights, f"hidden.{2 * number}") for number in range(count)]


def _read_convolution(weights: Weights, name: str, dtype: Any) -> Layer:
    """A convolution as the layer of a window: rows, columns and layers are its inputs."""
    matrix = weights[f"{name}.weight"].transpose(2, 3, 1, 0).reshape(-1, KERNELS)
    return _cast_layer(dtype, matrix, weights[f"{name}.bias"])


def _cast_layer(dtype: Any, matrix: np.ndarray, bias: np.ndarray) -> Layer:
    return np.ascontiguousarray(matrix, dtype), bias.astype(dtype)


def _apply_layers(layers: Sequence[Layer], values: np.ndarray) -> np.ndarray:
    """What (R, inputs) become in layers that are followed by a ReLU."""
    for matrix, bias in layers:
        values = values @ matrix
        _add_and_rectify(values, bias[None], 1)
    return values


def _apply_convolutions(maps: np.ndarray, first: Layer, second: Layer) -> np.ndarray:
    """What (R, layers, rows, columns) become in two convolutions: (R, layers * rows * columns)."""
    rows, columns = (width - KERNEL_SIZE + 1 for width in maps.shape[2:])
    seen = np.empty((len(maps), rows, columns * KERNELS), maps.dtype)
    _convolve_maps(maps, *first, seen.reshape(len(maps), rows, columns, KERNELS))
    matrix, bias = second
    windows = sliding_window_view(seen, KERNEL_SIZE * KERNELS, axis=2)[:, :, ::KERNELS]
    height = rows - KERNEL_SIZE + 1
    width = windows.shape[2]
    windows = windows.reshape(len(maps), rows * width, -1)
    # Of a window only a row is copied; the five products are added.
    out = np.zeros((len(maps) * height * width, KERNELS), maps.dtype)
    for row, part in enumerate(np.split(matrix, KERNEL_SIZE)):
        out += (windows[:, row * width : (row + height) * width] @ part).reshape(out.shape)
    _add_and_rectify(out, bias[None], 1)
    return out.reshape(len(maps), -1, KERNELS).swapaxes(1, 2).reshape(len(maps), -1)


@kernel
def _convolve_maps(maps, matrix, bias, out):
    """Convolve (R, layers, rows, columns), most of which are 0; make sums 0 or more."""
    zero = bias.dtype.type(0)
    layers, height, width = maps.shape[1:]
    for r in range(len(maps)):
        out[r] = zero
        for layer in range(layers):
            for y in range(height):
                for x in range(width):
                    value = maps[r, layer, y, x]
                    if value == zero:
                        continue
                    for row in range(max(y - height + out.shape[1], 0), min(y + 1, out.shape[1])):
                        for column in range(
                            max(x - width + out.shape[2], 0), min(x + 1, out.shape[2])
                        ):
                            entry = ((y - row) * KERNEL_SIZE + x - column) * layers + layer
                            for c in range(len(bias)):
                                out[r, row, column, c] += value * matrix[entry, c]
        for row in range(out.shape[1]):
            for column in range(out.shape[2]):
                for c in range(len(bias)):
                    out[r, row, column, c] = max(out[r, row, column, c] + bias[c], zero)


@kernel
def _add_and_rectify(values, shifts, each):
    """Add (S, C) shifts, each to so many rows in turn, to (R, C) values; make them 0 or more."""
    zero = values.dtype.type(0)
    count = len(shifts)
    for row in range(len(values)):
        shift = row // each % count
        for c in range(values.shape[1]):
            values[row, c] = max(values[row, c] + shifts[shift, c], zero)


@kernel
def _pool_products(values, bias, factors, state, moves, at):
    """Write the highest products, or 0, of values (R, N, C) and factors (R, 9, N).

    Those of the last factors are columns of the state (R, :) from ``at[0]`` on. Those of the eight
    before, in which a move has two, are columns of the moves (4, R, :) from ``at[1]`` on.
    """
    zero = values.dtype.type(0)
    width = len(bias)
    count = values.shape[1]
    best = np.empty(width, values.dtype)
    chosen = np.empty(count, np.int64)
    for row in range(len(values)):
        for part in range(9):
            count_chosen = 0
            for number in range(count):
                chosen[count_chosen] = number
                count_chosen += factors[row, part, number] > zero
            best[:] = zero
            for place in range(count_chosen):
                number = chosen[place]
                factor = factors[row, part, number]
                for c in range(width):
                    best[c] = max(best[c], factor * (values[row, number, c] + bias[c]))
            for c in range(width):
                if part == 8:
                    state[row, at[0] + c] = best[c]
                else:
                    moves[part % 4, row, at[1] + part // 4 * width + c] = best[c]
