"""The learned policy: the allowed action with the highest Q-value (eq. 25)."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from dess.base.errors import InputError
from dess.envs.observations.sets import SEA_PART, Sets, sea_of
from dess.envs.observations.states import MASK, CompactStates, Layout, compact_states, masks
from dess.envs.observations.vector import Vector
from dess.model.channel import World
from dess.model.view import View
from dess.policies.dense import choose, filled_widths
from dess.policies.integers import Integers, decide
from dess.policies.network import DuelingNetwork, Weights

# The rounding errors of a network in floats depend on the number of rows that it evaluates together
# and on the processor, but the action must not. So if the two best values differ by less than a
# share CLOSE of the best one (and of 1), fifteen times the largest error seen, the values are
# computed again in double precision and rounded to DECIMALS.
CLOSE, DECIMALS = 1e-5, 9


class IntegerNetwork:
    """A network of sets in integers, with which a policy acts."""

    def __init__(self, integers: Integers) -> None:
        self.integers = integers

    def choose_actions(
        self, encoder: Sets, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> np.ndarray:
        """The (R,) allowed actions with the highest values, as ``FloatNetwork``."""
        actions = np.empty(len(missions), np.int64)
        decide(states, missions, uavs, encoder.sea, encoder.tables, self.integers, actions)
        return actions


class DenseIntegerNetwork:
    """A dense network in integers, with which a policy acts."""

    def __init__(self, integers: Integers, inputs: int, hidden: Sequence[int]) -> None:
        """Make it of its integers, the number of inputs, and the widths of its hidden layers."""
        self.integers = integers
        self._widths = np.array(filled_widths(inputs, hidden))

    def choose_actions(
        self, encoder: Vector, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> np.ndarray:
        """The (R,) allowed actions with the highest values, as ``FloatNetwork``."""
        actions = np.empty(len(missions), np.int64)
        allowed = states.uavs[missions, uavs, MASK].astype(np.int64)
        for first in range(0, len(missions), DuelingNetwork.rows):
            rows = slice(first, first + DuelingNetwork.rows)
            (vectors,) = encoder.encode(states, missions[rows], uavs[rows])
            choose(vectors, allowed[rows], self._widths, self.integers, actions[rows])
        return actions


class FloatNetwork:
    """A network in floats, with which a policy acts."""

    integers = None

    def __init__(self, network: Any, weights: Weights) -> None:
        """Make it of one of the networks of ``dess.policies.network``, with its weights."""
        self._network, self._exact = (network(weights, t) for t in (np.float32, np.float64))

    def choose_actions(
        self, encoder: Any, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> np.ndarray:
        """The (R,) allowed actions with the highest values.

        Args:
            encoder: The encoder of the sea.
            states: The states of the missions.
            missions, uavs: (R,) the state and the index of each UAV.
        """
        actions = np.empty(len(missions), np.int64)
        for first in range(0, len(missions), self._network.rows):
            rows = slice(first, first + self._network.rows)
            parts = encoder.encode(states, missions[rows], uavs[rows])
            allowed = masks(states, missions[rows], uavs[rows])
            actions[rows] = self._best_actions(parts, allowed)
        return actions

    def _best_actions(self, parts: tuple[np.ndarray, ...], allowed: np.ndarray) -> np.ndarray:
        """The (R,) allowed actions with the highest values."""
        values = np.where(allowed, self._network(*parts).astype(np.float64), -np.inf)
        second, best = np.partition(values, -2)[:, -2:].T
        close = best - second < CLOSE * (1 + np.abs(best))
        if close.any():
            exact = self._exact(*(part[close].astype(np.float64) for part in parts))
            values[close] = np.where(allowed[close], exact.round(DECIMALS), -np.inf)
        return values.argmax(1)


class LearnedPolicy:
    """A network as a policy.

    Attributes:
        name: The name under which results are stored.
        observation: The encoder of the network's input: ``encode(states, missions, uavs)``, or the
            kind of it if every sea has its own.
        guarded: Whether the return guard masks the actions.
        layout: The grid, zone and nodes of the training; None if it decides on any sea.
        weights: A hash of the weights, stored with results; empty during training.
        learner: An identifier of the settings of the training without the seed; empty during
            training.
    """

    weights = ""
    learner = ""

    def __init__(
        self, name: str, observation: Any, network: Any, guarded: bool, layout: Layout | None
    ):
        """Make the policy of a network in integers or in floats."""
        self.name = name
        self.observation = observation
        self.guarded = guarded
        self.layout = layout
        self._network = network
        self._world: World | None = None  # that of the last missions
        self._encoders: dict[bytes, Any] = {}  # of its seas, by what an encoder reads of them

    @property
    def integers(self) -> Integers | None:
        """The network in integers, if the policy acts with one."""
        return self._network.integers

    def act(self, view: View) -> np.ndarray:
        """Choose the (R,) actions for the rows of the view.

        Raises:
            InputError: If the missions have another grid, other zone or other nodes than the
                training.
        """
        states = compact_states(view.state, view.world.chart, self.guarded, view.ways)
        actions = np.empty(len(view), np.int64)
        for rows, encoder in self.rows_by_sea(view):
            of_sea = view.mission[rows], view.uav[rows]
            actions[rows] = self._network.choose_actions(encoder, states, *of_sea)
        return actions

    def rows_by_sea(self, view: View) -> Iterator[tuple[np.ndarray, Any]]:
        """The rows of a view sea by sea, with the encoder of the sea."""
        if self.layout is not None:
            if self._world is not view.world:
                self._require_layout(view, self.layout)
                self._world = view.world
            yield np.arange(len(view)), self.observation
            return
        for part, rows in view.rows_by(SEA_PART):
            yield rows, self._encoder_of_sea(part, view.world)

    def _encoder_of_sea(self, part: bytes, world: World) -> Any:
        """The encoder of a sea; those of a world are kept for the next slots."""
        if self._world is not world:
            self._world = world
            self._encoders = {}
        if part not in self._encoders:
            mission = np.frombuffer(part, SEA_PART)[0]
            self._encoders[part] = self.observation(sea_of(mission, world))
        return self._encoders[part]

    def _require_layout(self, view: View, layout: Layout) -> None:
        learned = (layout.grid, *layout.zone)
        for field, value in zip(_PLACE, learned, strict=True):
            of_missions = view.state.missions[field][view.mission]
            others = of_missions[of_missions != value]
            if len(others):
                raise InputError(
                    f"policy {self.name}",
                    f"has learned {field} {value}, not {others[0]}",
                    "the grid, zone and nodes of its training",
                )
        if not np.array_equal(view.world.chart.zones, layout.zones):
            raise InputError(
                f"policy {self.name}",
                "has learned a square grid with one zone and no no-fly cells",
                "the grid, zone and nodes of its training",
            )
        if not np.array_equal(view.world.nodes, layout.nodes):
            raise InputError(
                f"policy {self.name}", "has learned other nodes", "those of its training"
            )


_PLACE = ("grid", "zone_x", "zone_y", "zone_width", "zone_height")
