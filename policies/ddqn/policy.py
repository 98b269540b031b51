"""The learned policy: the allowed action of the highest value (eq. 25)."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from torch import nn

from dess.errors import InputError
from dess.view import View
from policies.ddqn.observations.states import Layout, masks, snapshot

# The rounding of sums depends on how many rows are evaluated together, and must decide nothing:
# where the two best values are closer than this, they are computed again in double precision and
# told apart by that many decimals.
CLOSE, DECIMALS = 1e-3, 9


class DDQN:
    """A network as a policy.

    Attributes:
        name: The name that results carry.
        observation: What the network is told: ``encode(snapshots, missions, uavs)``.
        network: Values of the five actions.
        exact: The same network in double precision, for close decisions; None while weights change.
        guarded: Whether it chooses among the actions of the return guard only.
        layout: The grid, zone and nodes that it has learned.
        weights: A hash of the weights, for whoever keeps results; empty while they change.
        learner: What tells trainings apart that differ in more than their seed; empty before one
            has ended.
    """

    exact: nn.Module | None = None
    weights = ""
    learner = ""

    def __init__(
        self, name: str, observation: Any, network: nn.Module, guarded: bool, layout: Layout
    ):
        self.name, self.observation, self.guarded = name, observation, guarded
        self.network, self.layout = network.eval(), layout

    @torch.inference_mode()
    def act(self, view: View) -> np.ndarray:
        """(R,) actions for the rows of the view.

        Raises:
            InputError: If the missions have another grid, zone or nodes than it has learned.
        """
        self._check(view)
        states = snapshot(view.state, self.guarded)
        allowed = masks(states, view.mission, view.uav)
        parts = self.observation.encode(states, view.mission, view.uav)
        values = np.where(allowed, _values(self.network, parts).astype(np.float64), -np.inf)
        if self.exact is not None:
            second, best = np.partition(values, -2)[:, -2:].T
            close = best - second < CLOSE
            if close.any():
                exact = _values(self.exact, [part[close] for part in parts]).round(DECIMALS)
                values[close] = np.where(allowed[close], exact, -np.inf)
        return values.argmax(1)

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


def _values(network: nn.Module, parts: Iterable[np.ndarray]) -> np.ndarray:
    """(R, 5) values, in the precision and on the device of the network's weights."""
    weight = next(network.parameters())
    return network(*(torch.from_numpy(part).to(weight) for part in parts)).cpu().numpy()


_PLACE = ("grid", "zone_x", "zone_y", "zone_width", "zone_height")
