"""The networks that value the five actions of a UAV: the paper's, and a dueling one on a vector.

All weights are float32. With ``precision`` bfloat16 the hidden layers compute in bfloat16 by
autocast, the last ones in float32.
"""

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

from dess.state import ACTION_NAMES

ACTIONS = len(ACTION_NAMES)
KERNELS, KERNEL_SIZE = 16, 5
DENSE = (256, 256, 256)


class PaperNetwork(nn.Module):
    """The paper's network: convolutions on both maps, then dense layers (Section VI-A).

    Two convolutions (16 kernels of 5 x 5, no padding) on the local and, with weights of their own,
    on the global map; three dense layers of 256 on what they give and the own flying time.
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
        local, far, own = shapes
        self.precision = precision
        self.local = _convolutions(local[0])
        self.far = _convolutions(far[0])
        width = sum(
            KERNELS * _convolved(rows) * _convolved(columns) for _, rows, columns in shapes[:2]
        )
        self.hidden = _dense([width + own[0], *DENSE])
        self.values = nn.Linear(DENSE[-1], ACTIONS)

    def forward(self, local: Tensor, far: Tensor, own: Tensor) -> Tensor:
        """The values (R, 5) of the actions.

        Args:
            local: (R, 4, l, l) local maps.
            far: (R, 4, w, w) global maps.
            own: (R, 1) own flying times.
        """
        with _autocast(own, self.precision):
            maps = [self.local(local).flatten(1), self.far(far).flatten(1)]
            hidden = self.hidden(torch.cat([*maps, own.to(maps[0].dtype)], 1))
        with _autocast(own, torch.float32):
            return self.values(hidden.float())


class DuelingNetwork(nn.Module):
    """Dense layers on a vector, then a value V and advantages A: ``Q = V + A - mean A``."""

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
        self.hidden = _dense(sizes)
        self.value = nn.Linear(sizes[-1], 1)
        self.advantage = nn.Linear(sizes[-1], ACTIONS)

    def forward(self, vector: Tensor) -> Tensor:
        """The values (R, 5) of the actions, from vectors (R, inputs)."""
        with _autocast(vector, self.precision):
            hidden = self.hidden(vector)
        with _autocast(vector, torch.float32):
            hidden = hidden.float()
            advantage = self.advantage(hidden)
            return self.value(hidden) + advantage - advantage.mean(1, keepdim=True)


def _autocast(tensor: Tensor, precision: torch.dtype) -> torch.autocast:
    """Compute in bfloat16 if that is the precision, else in float32."""
    return torch.autocast(tensor.device.type, torch.bfloat16, enabled=precision == torch.bfloat16)


def _convolutions(channels: int) -> nn.Sequential:
    first = nn.Conv2d(channels, KERNELS, KERNEL_SIZE)
    return nn.Sequential(
        first,
        nn.ReLU(),
        nn.Conv2d(KERNELS, KERNELS, KERNEL_SIZE),
        nn.ReLU(),
    )


def _convolved(width: int) -> int:
    """What two convolutions without padding leave of a width."""
    return width - 2 * (KERNEL_SIZE - 1)


def _dense(sizes: Sequence[int]) -> nn.Sequential:
    """Dense layers of the given widths, inputs first, each followed by a ReLU."""
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise(sizes):
        layers += [nn.Linear(inputs, outputs), nn.ReLU()]
    return nn.Sequential(*layers)
