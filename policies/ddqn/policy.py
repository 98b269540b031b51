"""The learned policy: the allowed action of the highest value (eq. 25)."""

from typing import Any

import numpy as np
import torch
from torch import nn

from dess.errors import InputError
from dess.view import View
from policies.ddqn.snapshot import Layout, masks, snapshot

# Values are told apart by this many decimals, so that the rounding of sums, which depends on how
# many rows are evaluated together, decides nothing.
DECIMALS = 9


class DDQN:
    """A network as a policy.

    Attributes:
        name: The name that results carry.
        observation: What the network is told: ``encode(snapshots, missions, uavs)``.
        network: Values of the five actions, in the precision of its weights.
        guarded: Whether it chooses among the actions of the return guard only.
        layout: The grid, zone and nodes that it has learned.
        weights: A hash of the weights, for whoever keeps results; empty while they change.
    """

    weights = ""

    def __init__(
        self, name: str, observation: Any, network: nn.Module, guarded: bool, layout: Layout
    ):
        self.name, self.observation, self.guarded = name, observation, guarded
        self.network, self.layout = network.eval(), layout
        self._weight = next(network.parameters())

    @torch.inference_mode()
    def act(self, view: View) -> np.ndarray:
        """(R,) actions for the rows of the view.

        Raises:
            InputError: If the missions have another grid, zone or nodes than it has learned.
        """
        self._check(view)
        states = snapshot(view.state, self.guarded)
        parts = self.observation.encode(states, view.mission, view.uav)
        inputs = (torch.from_numpy(part).to(self._weight) for part in parts)
        values = self.network(*inputs).cpu().numpy().round(DECIMALS)
        return np.where(masks(states, view.mission, view.uav), values, -np.inf).argmax(1)

    def _check(self, view: View) -> None:
        missions = view.state.missions[np.unique(view.mission)]
        learned = (self.layout.grid, *self.layout.zone)
        for field, value in zip(_PLACE, learned, strict=True):
            others = missions[field][missions[field] != value]
            if len(others):
                raise InputError(
                    f"policy {self.name}: has learned {field} {value}, not {others[0]}; "
                    "allowed: the grid, zone and nodes of its training"
                )
        if not np.array_equal(view.world.nodes, self.layout.nodes):
            raise InputError(
                f"policy {self.name}: has learned other nodes; allowed: those of its training"
            )


_PLACE = ("grid", "zone_x", "zone_y", "zone_width", "zone_height")
