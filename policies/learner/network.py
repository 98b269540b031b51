"""The Q-networks in training: the paper's for maps, a dueling one for vectors, and one for sets.

    values = DuelingNetwork(inputs=454, hidden=(512, 512))(vector)     # (R, 5)

Policies act with those of the same names in ``dess.policies.network``, which compute the same. All
weights are float32. If ``precision`` is bfloat16, the hidden layers compute in bfloat16 during
training (autocast). The output layers always, and all layers in evaluation mode, compute in the
type of the weights.
"""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import pairwise
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor, nn

from dess.base.kernels import kernel
from dess.policies import network as acting
from dess.policies.learner.config import TrainingConfig
from dess.policies.network import ACTIONS, DENSE, KERNEL_SIZE, KERNELS


def make_network(config: TrainingConfig, shapes: Sequence[Sequence[int]]) -> nn.Module:
    """A new network of a config, for inputs whose rows have these shapes."""
    precision = getattr(torch, config.precision)
    if config.observation == "sets":
        return SetNetwork(shapes, config.hidden, precision)
    if config.observation == "maps":
        return PaperNetwork(shapes, precision)
    return DuelingNetwork(shapes[0][0], config.hidden, precision)


def to_arrays(tensors: Mapping[str, Tensor]) -> dict[str, np.ndarray]:
    """The values of tensors as arrays, which may share their memory."""
    return {name: value.detach().cpu().numpy() for name, value in tensors.items()}


def to_tensors(arrays: Mapping[str, np.ndarray], device: Any = "cpu") -> dict[str, Tensor]:
    """The values of arrays as tensors with memory of their own."""
    return {name: torch.tensor(value, device=device) for name, value in arrays.items()}


class PaperNetwork(nn.Module):
    """The paper's network: convolutions on both maps, then dense layers (Section VI-A).

    The local map passes two convolutions (16 kernels of 5 x 5, no padding), and the global map two
    others with their own weights. Their outputs and the UAV's own flying time pass three dense
    layers of 256 units.
    """

    def __init__(
        self, shapes: Sequence[Sequence[int]], precision: torch.dtype = torch.float32
    ) -> None:
        """Make the layers.

        Args:
            shapes: Shapes of one row of the local maps, the global maps and the own flying time
                (``Maps.shapes``); a map must be at least 9 cells wide.
            precision: Of the hidden layers, float32 or bfloat16.
        """
        super().__init__()
        local, far, _ = shapes
        self.precision = precision
        self.local = _make_convolutions(local[0])
        self.far = _make_convolutions(far[0])
        _, width = acting.PaperNetwork.layer_sizes(shapes)["hidden.0"]
        self.hidden = _make_dense_layers([width, *DENSE])
        self.values = nn.Linear(DENSE[-1], ACTIONS)

    def forward(self, local: Tensor, far: Tensor, own: Tensor) -> Tensor:
        """The values (R, 5) of the actions.

        Args:
            local: (R, 4, l, l) local maps.
            far: (R, 4, w, w) global maps.
            own: (R, 1) own flying times.
        """
        with _hidden_precision(self, self.precision, own):
            maps = [self.local(local).flatten(1), self.far(far).flatten(1)]
            hidden = self.hidden(torch.cat([*maps, own.to(maps[0].dtype)], 1))
        return self.values(hidden.to(self.values.weight.dtype))


class DuelingNetwork(nn.Module):
    """A dueling network: dense layers, then a value V and advantages A; ``Q = V + A - mean A``.

    Source: Z. Wang et al., Dueling network architectures for deep reinforcement learning, ICML
    2016.
    """

    def __init__(
        self, inputs: int, hidden: Sequence[int], precision: torch.dtype = torch.float32
    ) -> None:
        """Make the layers.

        Args:
            inputs: Width of the vector.
            hidden: Widths of the hidden layers.
            precision: Of the hidden layers, float32 or bfloat16.
        """
        super().__init__()
        self.precision = precision
        sizes = [inputs, *hidden]
        self.hidden = _make_dense_layers(sizes)
        self.value = nn.Linear(sizes[-1], 1)
        self.advantage = nn.Linear(sizes[-1], ACTIONS)

    def forward(self, vector: Tensor) -> Tensor:
        """The values (R, 5) of the actions, from vectors (R, inputs)."""
        with _hidden_precision(self, self.precision, vector):
            hidden = self.hidden(vector)
        hidden = hidden.to(self.value.weight.dtype)
        advantage = self.advantage(hidden)
        return self.value(hidden) + advantage - advantage.mean(1, keepdim=True)


class SetNetwork(nn.Module):
    """A dueling network for the sets of any sea: it takes the best of what is in them.

    Every node gives rise to some values. The state has the highest of each over all nodes. A move
    has the highest over those to which it makes the way shorter, and over all, each times the share
    of the straight line there that it is along. Teammates and zones likewise. All actions share the
    layers that follow, so a mirrored sea has mirrored values, and the number and order of nodes
    does not matter.
    """

    def __init__(
        self,
        shapes: Sequence[Sequence[int]],
        hidden: Sequence[int],
        precision: torch.dtype = torch.float32,
    ) -> None:
        """Make the layers.

        Args:
            shapes: Shapes of one row of the own state, the actions and the sets (``Sets.shapes``).
            hidden: Widths of the layers on a node, on a teammate or a zone, and of the joint ones.
            precision: Of the hidden layers, float32 or bfloat16.
        """
        super().__init__()
        (own_inputs,), (_, action_inputs), *sets = shapes
        nodes, others, joint = hidden
        self.precision = precision
        widths = (nodes, others, others)
        columns = [shape[-1] for shape in sets[::2]]
        self.sets = nn.ModuleList(
            _Pool(own_inputs, of_row, width, joint)
            for of_row, width in zip(columns, widths, strict=True)
        )
        self.own = nn.Linear(own_inputs, joint)
        self.action = nn.Linear(action_inputs, joint, bias=False)
        self.state = nn.Linear(joint, joint)
        self.hidden = nn.Linear(joint, joint // 2)
        self.value = nn.Linear(joint, 1)
        self.advantage = nn.Linear(joint // 2, 1)

    def forward(self, own: Tensor, actions: Tensor, *sets: Tensor) -> Tensor:
        """The values (R, 5) of the actions, from the arrays of ``Sets.encode``."""
        with _hidden_precision(self, self.precision, own):
            state = self.own(own)
            hidden = self.action(actions)
            for number, pool in enumerate(self.sets):
                of_all, of_moves = pool(own, *sets[2 * number : 2 * number + 2])
                state += of_all
                hidden[:, :4] += of_moves
            state = torch.relu_(state)
            hidden = torch.relu_(hidden.add_(self.state(state)[:, None]))
            hidden = torch.relu_(self.hidden(hidden))
        advantage = self.advantage(hidden.to(self.value.weight.dtype)).squeeze(2)
        value = self.value(state.to(self.value.weight.dtype))
        return value + advantage - advantage.mean(1, keepdim=True)

    def value_of_state(self, own: Tensor, _: Tensor, *sets: Tensor) -> Tensor:
        """The values (R,) of the states alone, the means of those of the actions."""
        state = self.own(own)
        for pool, rows, moves in zip(self.sets, sets[::2], sets[1::2], strict=True):
            state += cast(_Pool, pool).value_of_state(own, rows, moves)
        return self.value(torch.relu_(state)).squeeze(1)


class _Pool(nn.Module):
    """What is best in a set: in the whole, and in what each move comes nearer to."""

    def __init__(self, own: int, columns: int, width: int, joint: int) -> None:
        super().__init__()
        self.context = nn.Linear(own, width)
        self.inputs = nn.Linear(columns, width, bias=False)
        self.layer = nn.Linear(width, width)
        self.values = nn.Linear(width, 2 * width)
        self.of_all, self.nearer, self.along = (
            nn.Linear(2 * width, joint, bias=False) for _ in range(3)
        )

    def forward(self, own: Tensor, rows: Tensor, moves: Tensor) -> tuple[Tensor, Tensor]:
        """What (R, N, columns) mean for the state (R, joint) and for the moves (R, 4, joint)."""
        pooled = highest_products(self.value_of_rows(own, rows), moves)
        nearer = self.nearer(pooled[:, :4])
        along = self.along(pooled[:, 4:8])
        return self.of_all(pooled[:, 8]), nearer.add_(along)

    def value_of_state(self, own: Tensor, rows: Tensor, moves: Tensor) -> Tensor:
        """What the rows mean for the state alone."""
        return self.of_all(highest_products(self.value_of_rows(own, rows), moves[:, 8:])[:, 0])

    def value_of_rows(self, own: Tensor, rows: Tensor) -> Tensor:
        """What each of (R, N, columns) rows is worth (R, N, C), of which the highest counts."""
        hidden = torch.relu_(self.inputs(rows).add_(self.context(own)[:, None]))
        hidden = torch.relu_(self.layer(hidden))
        return torch.relu_(self.values(hidden))


def highest_products(values: Tensor, factors: Tensor) -> Tensor:
    """The highest product (R, M, C) of the rows' values (R, N, C) and factors (R, M, N), or 0."""
    if values.device.type == "cpu":
        return _Highest.apply(values, factors)
    if values.shape[1] == 0:
        return factors @ values
    products = [(factor[:, :, None] * values).amax(1) for factor in factors.unbind(1)]
    return torch.relu(torch.stack(products, 1))


class _Highest(torch.autograd.Function):
    """``highest_products`` on the CPU, in compiled code that touches each product once."""

    @staticmethod
    def forward(context: Any, values: Tensor, factors: Tensor) -> Tensor:
        """Compute the products; remember which rows have the highest."""
        values = values.contiguous()
        factors = factors.to(values.dtype).contiguous()
        shape = len(values), factors.shape[1], values.shape[2]
        out = torch.zeros(shape, dtype=values.dtype)
        best = torch.full(shape, -1, dtype=torch.int16)
        arrays = (tensor.detach().numpy() for tensor in (values, factors, out, best))
        _pool_products(*arrays)
        context.save_for_backward(factors, best)
        return out

    @staticmethod
    def backward(context: Any, gradient: Tensor) -> tuple[Tensor, None]:
        """Give the gradients to the rows with the highest products."""
        factors, best = context.saved_tensors
        shape = len(factors), factors.shape[2], gradient.shape[2]
        out = torch.zeros(shape, dtype=gradient.dtype)
        _pass_gradients(gradient.contiguous().numpy(), factors.numpy(), best.numpy(), out.numpy())
        return out, None


@kernel
def _pool_products(values, factors, out, best):
    for row in range(len(values)):
        for number in range(values.shape[1]):
            value = values[row, number]
            for move in range(factors.shape[1]):
                factor = factors[row, move, number]
                to = out[row, move]
                place = best[row, move]
                if factor > 0:
                    for c in range(len(value)):
                        product = factor * value[c]
                        place[c] = number if product > to[c] else place[c]
                        to[c] = max(to[c], product)


@kernel
def _pass_gradients(gradient, factors, best, out):
    for row in range(len(gradient)):
        for move in range(gradient.shape[1]):
            for c in range(gradient.shape[2]):
                number = best[row, move, c]
                if number >= 0:
                    out[row, number, c] += factors[row, move, number] * gradient[row, move, c]


def count_units(network: nn.Module, shapes: Sequence[Sequence[int]]) -> int:
    """The numbers that a row is and becomes in all layers of a network on the ``meta`` device.

    Args:
        network: The network; nothing is computed.
        shapes: The shapes of a row of each of its inputs.
    """
    rows = [torch.empty(1, *shape, device="meta") for shape in shapes]
    sizes = [row.numel() for row in rows]

    def count(layer: nn.Module, inputs: object, output: Tensor) -> None:
        sizes.append(output.numel())

    for layer in network.modules():
        if not [*layer.children()]:
            layer.register_forward_hook(count)
    network.eval()(*rows)
    return sum(sizes)


def _hidden_precision(
    network: nn.Module, precision: torch.dtype, inputs: Tensor
) -> AbstractContextManager[object]:
    """A context that computes in bfloat16 if that is the precision and the network is training."""
    if network.training and precision == torch.bfloat16:
        return torch.autocast(inputs.device.type, torch.bfloat16)
    return nullcontext()


def _make_convolutions(channels: int) -> nn.Sequential:
    first = nn.Conv2d(channels, KERNELS, KERNEL_SIZE)
    return nn.Sequential(first, nn.ReLU(), nn.Conv2d(KERNELS, KERNELS, KERNEL_SIZE), nn.ReLU())


def _make_dense_layers(sizes: Sequence[int]) -> nn.Sequential:
    """Dense layers of the given widths, inputs first, each followed by a ReLU."""
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise(sizes):
        layers += [nn.Linear(inputs, outputs), nn.ReLU()]
    return nn.Sequential(*layers)
