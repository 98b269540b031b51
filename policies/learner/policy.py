"""The learned policy: the allowed action with the highest Q-value (eq. 25)."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import torch
from torch import nn

from dess.errors import InputError
from dess.observations.sets import sea_kinds, sea_of
from dess.observations.states import Layout, compact_states, masks
from dess.view import View

# The rounding errors of a network depend on the number of rows that it evaluates together, but the
# action must not. So if the two best values differ by less than a share CLOSE of the best one (and
# of 1), some thirty times the largest error seen, the values are computed again in double precision
# and rounded to DECIMALS.
CLOSE, DECIMALS = 1e-5, 9
# How many rows with sets a network evaluates together: what it computes stays in the cache.
ROWS = 256


class LearnedPolicy:
    """A network as a policy.

    Attributes:
        name: The name under which results are stored.
        observation: The encoder of the network's input: ``encode(states, missions, uavs)``, or the
            kind of it if every sea has its own.
        network: The network that computes the Q-values of the five actions.
        exact: The same network in double precision, for close decisions; None during training.
        guarded: Whether the return guard masks the actions.
        layout: The grid, zone and nodes of the training; None if it decides on any sea.
        weights: A hash of the weights, stored with results; empty during training.
        learner: An identifier of the settings of the training without the seed; empty during
            training.
    """

    exact: nn.Module | None = None
    weights = ""
    learner = ""

    def __init__(
        self, name: str, observation: Any, network: nn.Module, guarded: bool, layout: Layout | None
    ):
        self.name, self.observation, self.guarded = name, observation, guarded
        self.network, self.layout = network.eval(), layout

    @torch.inference_mode()
    def act(self, view: View) -> np.ndarray:
        """Choose the (R,) actions for the rows of the view.

        Raises:
            InputError: If the missions have another grid, other zone or other nodes than the
                training.
        """
        states = compact_states(view.state, view.world.chart, self.guarded)
        allowed = masks(states, view.mission, view.uav)
        actions = np.empty(len(view), np.int64)
        for rows, observation in self._encoders(view):
            parts = observation.encode(states, view.mission[rows], view.uav[rows])
            actions[rows] = self._best(parts, allowed[rows])
        return actions

    def _best(self, parts: tuple[np.ndarray, ...], allowed: np.ndarray) -> np.ndarray:
        """The (R,) allowed actions with the highest values."""
        values = np.where(allowed, _values(self.network, parts).astype(np.float64), -np.inf)
        if self.exact is not None:
            second, best = np.partition(values, -2)[:, -2:].T
            close = best - second < CLOSE * (1 + np.abs(best))
            if close.any():
                exact = _values(self.exact, [part[close] for part in parts]).round(DECIMALS)
                values[close] = np.where(allowed[close], exact, -np.inf)
        return values.argmax(1)

    def _encoders(self, view: View) -> Iterator[tuple[Any, Any]]:
        """The rows of a view, few at a time, with their encoder."""
        if self.layout is not None:
            self._require_layout(view, self.layout)
            yield slice(None), self.observation
            return
        kinds = sea_kinds(view.state.missions)[view.mission]
        for kind in np.unique(kinds):
            of_kind = np.flatnonzero(kinds == kind)
            mission = view.state.missions[view.mission[of_kind[0]]]
            encoder = self.observation(sea_of(mission, view.world))
            for first in range(0, len(of_kind), ROWS):
                yield of_kind[first : first + ROWS], encoder

    def _require_layout(self, view: View, layout: Layout) -> None:
        learned = (layout.grid, *layout.zone)
        for field, value in zip(_PLACE, learned, strict=True):
            of_missions = view.state.missions[field][view.mission]
            others = of_missions[of_missions != value]
            if len(others):
                raise InputError(
                    f"policy {self.name}: has learned {field} {value}, not {others[0]}; "
                    "allowed: the grid, zone and nodes of its training"
                )
        if not np.array_equal(view.world.chart.zones, layout.zones):
            raise InputError(
                f"policy {self.name}: has learned a square grid with one zone and no no-fly cells; "
                "allowed: the grid, zone and nodes of its training"
            )
        if not np.array_equal(view.world.nodes, layout.nodes):
            raise InputError(
                f"policy {self.name}: has learned other nodes; allowed: those of its training"
            )


def _values(network: nn.Module, parts: Iterable[np.ndarray]) -> np.ndarray:
    """The (R, 5) values, in the precision and on the device of the network's weights."""
    weight = next(network.parameters())
    return network(*(torch.from_numpy(part).to(weight) for part in parts)).cpu().numpy()


_PLACE = ("grid", "zone_x", "zone_y", "zone_width", "zone_height")
