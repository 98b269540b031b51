"""From the float weights of a network to integers, with scales from observations.

A ReLU and the highest of some products stay the same if a channel is multiplied by a positive
number. So each channel has a scale of its own, by which the weights that read it are divided; a
layer needs one shift for all of its channels, and no other product. The scales leave ``ROOM``
above the largest values of the observations, since a value that is clipped may change an action.

No sum can exceed 32 bits, whatever the inputs are: the scale of a channel is at most what the
largest possible sum allows. So the finer an input is, the coarser are its weights, and the error of
a weight is the same in all slots of a sea. Some inputs of a network of sets are large, and hence
coarse. The others of its inputs, and its state, need not be much finer: they leave their last bits
to their weights.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from dess.base.vectors import MOST
from dess.model.state import HOVER
from dess.policies.dense import BLOCK, VALUES, filled_widths
from dess.policies.integers import LAYERS, SCALES, SETS, SHIFTED, Integers
from dess.policies.network import ACTIONS, Layer, Weights, read_hidden_layers, read_layer

ROOM = 1.5  # by which values may exceed the largest observed ones
STATE_ROOM = 12.0  # the same of the state of a network of sets
FINEST = 2.0**10  # the largest scale of its inputs
ROWS = 64  # observations that are computed together
_MOST_WEIGHT = 2**15 - 1
_MOST_SUM = 2**31 - 2**24
_NUMBERS = range(len(SETS))
_HALF = 0.5

Observation = tuple[np.ndarray, ...]  # arrays of ``Sets.encode``


class Activations(NamedTuple):
    """What a network computes of some observations, by channels in the last axis.

    Attributes:
        peaks: The largest magnitudes.
        zeros: How often two channels are both zero, of those whose pairs are left out then.
    """

    peaks: dict[str, np.ndarray]
    zeros: dict[str, np.ndarray]


def quantize(weights: Weights, observations: Sequence[Observation]) -> Integers:
    """The integers of a network of sets.

    Args:
        weights: The weights of ``SetNetwork``, with the widths ``integers.HIDDEN``.
        observations: What UAVs observe in missions that the network flies.
    """
    ordered = order_channels(weights, trace(weights, observations).zeros)
    peaks = trace(ordered, observations).peaks
    return _quantize_sets(_Quantization(layers_of(ordered), peaks))


def quantize_dense(weights: Weights, observations: Sequence[Observation]) -> Integers:
    """The integers of a dense network.

    Args:
        weights: The weights of ``DuelingNetwork``.
        observations: As for ``quantize``.
    """
    hidden = read_hidden_layers(weights)
    matrix, bias = read_layer(weights, "advantage")
    # What all actions share decides nothing.
    values = matrix - matrix.mean(1, keepdims=True), bias - bias.mean()
    seen = np.concatenate([vectors for (vectors,) in observations]).astype(np.float64)
    # A column may be a cell or a case that no observation had: it is 1 there.
    peaks = {"inputs": np.abs(seen).max(0, initial=1)}
    for number, (matrix, bias) in enumerate(hidden):
        seen = np.maximum(seen @ matrix + bias, 0)
        peaks[f"{number}"] = seen.max(0)
    layers = {f"{number}": layer for number, layer in enumerate(hidden)}
    return _quantize_dense(_Quantization(layers | {"values": values}, peaks), [*layers])


def layers_of(weights: Weights) -> dict[str, Layer]:
    """The layers of a network of sets; those that act on the same sums are one."""
    layer = partial(read_layer, weights)

    def joined(*names: str) -> list[np.ndarray]:
        return [layer(f"sets.{number}.{name}")[0] for number in _NUMBERS for name in names]

    names = ("context", "inputs", "layer", "values")
    layers = {f"{name}{n}": layer(f"sets.{n}.{name}") for n in _NUMBERS for name in names}
    own, bias = layer("own")
    layers["own"] = np.concatenate([own, *joined("of_all")]), bias
    moves = np.concatenate([layer("action")[0], *joined("nearer", "along")])
    layers["moves"] = moves, np.zeros(moves.shape[1])
    layers["advantage"] = layer("advantage")[0], np.zeros(1)  # what all actions share
    return layers | {name: layer(name) for name in ("state", "hidden")}


def trace(weights: Weights, observations: Iterable[Observation]) -> Activations:
    """What a network computes of observations."""
    layers = layers_of(weights)
    peaks: dict[str, np.ndarray] = {}
    zeros: dict[str, np.ndarray] = {}
    for observation in observations:
        for first in range(0, len(observation[0]), ROWS):
            parts = [part[first : first + ROWS].astype(np.float64) for part in observation]
            for name, values in compute_activations(layers, *parts).items():
                by_channel = values.reshape(-1, values.shape[-1])
                most = np.abs(by_channel).max(0, initial=0)
                peaks[name] = np.maximum(peaks.get(name, 0), most)
                if name in ("moves", "own", "state"):
                    are_zero = (by_channel == 0).astype(np.float64)
                    zeros[name] = zeros.get(name, 0) + are_zero.T @ are_zero
    return Activations(peaks, zeros)


def compute_activations(
    layers: Mapping[str, Layer], own: np.ndarray, actions: np.ndarray, *sets: np.ndarray
) -> dict[str, np.ndarray]:
    """All that a network computes of an observation, in double precision.

    Returns:
        The inputs and the outputs of layers, by the names of ``integers``: with their ReLU, and
        without that of members that do not exist. ``moves`` has the inputs of the moves.
    """

    def apply(name: str, values: np.ndarray) -> np.ndarray:
        matrix, bias = layers[name]
        return values @ matrix + bias

    seen = {"own_inputs": own, "action": actions}
    pooled = [own]
    moves = [actions[:, :HOVER]]
    for number, (lines, factors) in enumerate(zip(sets[::2], sets[1::2], strict=True)):
        exists = factors[:, -1, :, None] > 0
        context = apply(f"context{number}", own)[:, None]
        first = np.maximum(apply(f"inputs{number}", lines) + context, 0) * exists
        second = np.maximum(apply(f"layer{number}", first), 0) * exists
        values = apply(f"values{number}", second) * exists
        best = (np.maximum(factors, 0)[..., None] * values[:, None]).max(2, initial=0)
        pooled.append(best[:, -1])
        moves.append(np.concatenate([best[:, :HOVER], best[:, HOVER:-1]], -1))
        seen |= {f"lines{number}": lines, f"context{number}": first}
        seen |= {f"layer{number}": second, f"values{number}": values}
    state = np.maximum(apply("own", np.concatenate(pooled, 1)), 0)
    of_moves = np.concatenate(moves, 2)
    matrix, _ = layers["moves"]
    hidden = np.empty((len(own), ACTIONS, matrix.shape[1]))
    hidden[:, :HOVER] = of_moves @ matrix
    hidden[:, HOVER] = actions[:, HOVER] @ matrix[: actions.shape[2]]
    hidden = np.maximum(hidden + apply("state", state)[:, None], 0)
    last = np.maximum(apply("hidden", hidden), 0)
    seen |= {"moves": of_moves, "own": state, "state": hidden, "hidden": last}
    return seen | {"advantage": apply("advantage", last)}


def order_channels(weights: Weights, zeros: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The same network, in whose layers channels that are often zero together are pairs.

    Pairs of zeros are left out of sums (``integers``), so this makes decisions faster.

    Args:
        weights: The weights.
        zeros: As ``Activations``.
    """
    ordered = dict(weights)

    def permute(order: np.ndarray, outputs: Iterable[str], inputs: Iterable[str]) -> None:
        for name in outputs:
            for key in (f"{name}.weight", f"{name}.bias"):
                if key in ordered:
                    ordered[key] = ordered[key][order]
        for name in inputs:
            ordered[f"{name}.weight"] = ordered[f"{name}.weight"][:, order]

    at = len(weights["action.weight"].T)
    for number, (_, width) in enumerate(SETS):
        nearer = slice(at, at + 2 * width)
        along = slice(at + 2 * width, at + 4 * width)
        at += 4 * width
        together = zeros["moves"][nearer, nearer] + zeros["moves"][along, along]
        name = f"sets.{number}"
        readers = [f"{name}.{part}" for part in ("of_all", "nearer", "along")]
        permute(_pair_up(together), [f"{name}.values"], readers)
    sets = [f"sets.{number}" for number in _NUMBERS]
    permute(_pair_up(zeros["own"]), ["own", *(f"{s}.of_all" for s in sets)], ["state", "value"])
    moves = [f"{s}.{part}" for s in sets for part in ("nearer", "along")]
    permute(_pair_up(zeros["state"]), ["state", "action", *moves], ["hidden"])
    return ordered


def _pair_up(together: np.ndarray) -> np.ndarray:
    """An order of channels in which those that are most often zero together are neighbours."""
    left = [*range(len(together))]
    order: list[int] = []
    while left:
        counts = together[np.ix_(left, left)].copy()
        np.fill_diagonal(counts, -1)
        pair = np.unravel_index(counts.argmax(), counts.shape)
        order += [left[place] for place in pair]
        left = [channel for channel in left if channel not in order]
    return np.array(order)


class _Quantization:
    """The layers of a network, one after the other, as integers.

    Attributes:
        matrices: The (inputs, outputs) weights of the layers so far, by name.
        biases: Their biases.
        shifts: Their shifts.
    """

    def __init__(self, layers: Mapping[str, Layer], peaks: Mapping[str, np.ndarray]) -> None:
        self._layers = layers
        self._peaks = peaks
        self.matrices: dict[str, np.ndarray] = {}
        self.biases: dict[str, np.ndarray] = {}
        self.shifts: dict[str, int] = {}

    def outputs_of(self, names: Iterable[str]) -> list[int]:
        """The numbers of outputs of layers."""
        return [self._layers[name][0].shape[1] for name in names]

    def input_scales(self, name: str) -> np.ndarray:
        """Scales of inputs: powers of two, so that only the last rounding loses anything."""
        peaks = np.maximum(ROOM * self._peaks[name], 2.0**-3)
        return 2.0 ** np.floor(np.log2(MOST / peaks))

    def add(
        self,
        name: str,
        scales: np.ndarray,
        others: Mapping[str, np.ndarray] | None = None,
        room: float = ROOM,
    ) -> np.ndarray:
        """Add a layer; return the scales of its outputs.

        Args:
            name: The layer.
            scales: Of its inputs.
            others: Layers whose products are added to the same sums, with the scales of their
                inputs.
            room: By which its outputs may exceed the largest observed ones.
        """
        parts = {name: scales, **(others or {})}
        bias = self._layers[name][1]
        scaled = {part: self._layers[part][0] / parts[part][:, None] for part in parts}
        together = np.concatenate([*scaled.values()])
        limit = _largest_scales(together, bias)
        peaks = np.maximum(room * _round_up(self._peaks[name]), 1e-6)
        shift = max(int(np.ceil(np.median(np.log2(limit * peaks / MOST)))), 1)
        steps = np.minimum(limit, MOST * 2.0**shift / peaks)
        for part, matrix in scaled.items():
            self.matrices[part] = _round(matrix * steps)
        self.biases[name] = _round(bias * steps) + 2 ** (shift - 1)
        self.shifts[name] = shift
        _check(np.concatenate([self.matrices[part] for part in parts]), self.biases[name])
        return steps / 2.0**shift

    def add_values(self, name: str, scales: np.ndarray) -> None:
        """Add the last layer, whose sums are compared as they are: all have the same scale."""
        matrix, bias = self._layers[name]
        matrix = matrix / scales[:, None]
        step = _largest_scales(matrix, bias).min()
        self.matrices[name] = _round(matrix * step)
        self.biases[name] = _round(bias * step)
        _check(self.matrices[name], self.biases[name])


def _quantize_sets(quantization: _Quantization) -> Integers:
    """The layers of a network of sets in their order."""
    add = quantization.add

    def input_scales(name: str) -> np.ndarray:
        return np.minimum(quantization.input_scales(name), FINEST)

    own, action = (input_scales(name) for name in ("own_inputs", "action"))
    scales = {"own": own, "action": action}
    pooled = []
    for n in _NUMBERS:
        lines = scales[f"lines{n}"] = input_scales(f"lines{n}")
        first = add(f"context{n}", own, {f"inputs{n}": lines})
        second = add(f"layer{n}", first)
        pooled.append(add(f"values{n}", second))
    state = add("own", np.concatenate([own, *pooled]), room=STATE_ROOM)
    moves = np.concatenate([action, *(part for of_set in pooled for part in (of_set, of_set))])
    hidden = add("state", state, {"moves": moves})
    last = add("hidden", hidden)
    quantization.add_values("advantage", last)
    packed = [_pack(quantization.matrices[name], LAYERS[name]) for name in LAYERS]
    columns = [_fill(scales[name], SCALES[name]) for name in SCALES]
    return Integers(
        np.concatenate(packed),
        np.concatenate([quantization.biases[name] for name in SHIFTED]).astype(np.int32),
        np.array([quantization.shifts[name] for name in SHIFTED], np.int32),
        np.concatenate(columns).astype(np.float32),
    )


def _quantize_dense(quantization: _Quantization, names: Sequence[str]) -> Integers:
    """The hidden layers of a dense network in their order, and that of its values."""
    inputs = scales = quantization.input_scales("inputs")
    widths = filled_widths(len(inputs), quantization.outputs_of(names))
    packed = []
    biases = []
    for name, before, width in zip(names, widths, widths[1:], strict=False):
        scales = quantization.add(name, scales)
        for first in range(0, width, BLOCK):
            block = quantization.matrices[name][:, first : first + BLOCK]
            packed.append(_pack(block, (before, BLOCK)))
        biases.append(_fill(quantization.biases[name], width))
    quantization.add_values("values", scales)
    packed.append(_pack(quantization.matrices["values"], (widths[-1], VALUES)))
    biases.append(_fill(quantization.biases["values"], VALUES))
    return Integers(
        np.concatenate(packed),
        np.concatenate(biases).astype(np.int32),
        np.array([quantization.shifts[name] for name in names], np.int32),
        _fill(inputs, widths[0]).astype(np.float32),
    )


def _largest_scales(matrix: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """For each output the largest factor with which weights and sums stay within their bits."""
    size = np.abs(matrix).max(0).clip(1e-12)
    total = (np.abs(matrix).sum(0) * MOST + np.abs(bias)).clip(1e-12)
    return np.minimum(_MOST_WEIGHT / size, _MOST_SUM / total)


def _round_up(values: np.ndarray) -> np.ndarray:
    """Values rounded up to 7 bits, so that the last bits of products of matrices do not count."""
    mantissas, exponents = np.frexp(values)
    return np.ldexp(np.ceil(mantissas * 2**7), exponents - 7)


def _round(values: np.ndarray) -> np.ndarray:
    return np.floor(values + _HALF).astype(np.int64)


def _check(matrix: np.ndarray, bias: np.ndarray) -> None:
    """Make sure that the largest possible sums have 32 bits, in any order of their terms."""
    largest = np.abs(matrix).sum(0) * MOST + np.abs(bias)
    if np.abs(matrix).max() > _MOST_WEIGHT or largest.max() >= 2**31:
        raise ArithmeticError("a sum of integers exceeds its bits")


def _fill(values: np.ndarray, size: int) -> np.ndarray:
    """Values with zeros behind them."""
    return np.pad(values, (0, size - len(values)))


def _pack(matrix: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Weights (inputs, outputs) as ``dess.base.vectors`` has them; what is filled up is zero."""
    inputs, outputs = (length - size for length, size in zip(shape, matrix.shape, strict=True))
    filled = np.pad(matrix, ((0, inputs), (0, outputs)))
    return filled.reshape(-1, 2, shape[1]).swapaxes(1, 2).astype(np.int16).ravel()
