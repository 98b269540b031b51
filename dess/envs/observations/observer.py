"""What UAVs observe and may do: one of the kinds of observations, with the mask of actions.

observer = Observer(space, "vector", guarded=False)
observations, masks = observer.observe(state, missions, uavs)    # (R, F) and (R, 5)
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from gymnasium import spaces

from dess.base.errors import check_known
from dess.envs.observations.components import Components, component_bounds
from dess.envs.observations.maps import Maps
from dess.envs.observations.sets import Sets, sea_of
from dess.envs.observations.states import compact_states, layout_of, masks
from dess.envs.observations.vector import Vector
from dess.model.channel import world_of
from dess.model.state import State, constants_of
from dess.model.view import legal_actions
from dess.model.ways import Ways
from dess.scenario.scenario import ScenarioSpace

# The encoders that learners use, by the kind of observation, and the names of their arrays.
ENCODERS: dict[str, Any] = {"vector": Vector, "maps": Maps, "sets": Sets}
_PARTS = {
    "maps": ("local", "global", "battery"),
    "sets": (
        *("own", "actions", "nodes", "node_moves"),
        *("mates", "mate_moves", "zones", "zone_moves"),
    ),
}
KINDS = (*ENCODERS, "state")

# One array, or one for each name.
Observation = np.ndarray | dict[str, np.ndarray]


def encoder_of(kind: str, space: ScenarioSpace) -> Any:
    """The encoder of a kind of observation for a scenario.

    Raises:
        InputError: If it does not fit the scenario.
    """
    if kind == "sets":
        return Sets(sea_of(constants_of(space)[0], world_of(space)), space.uavs[1])
    return ENCODERS[kind](layout_of(space))


class Observer:
    """Encodes what UAVs observe, and the mask of their allowed actions.

    Attributes:
        kind: ``vector``, ``maps`` or ``sets``, the observations of the shipped
            learner, or ``state``, the components that ``components.component_names`` lists.
        guarded: Whether the masks are those of the return guard; if not, they have all legal
            actions.
        space: The space of one UAV's observation: a ``Box``, or a ``Dict`` of several.
    """

    def __init__(self, scenario: ScenarioSpace, kind: str, guarded: bool):
        """Make an observer for the missions of a scenario.

        Raises:
            InputError: If there is no such kind, or it does not fit the scenario.
        """
        check_known("observation", kind, KINDS)
        self.kind = kind
        self.guarded = guarded
        self._chart = scenario.chart
        self._ways = Ways(constants_of(scenario), self._chart)
        self._encoder: Any = Components(scenario) if kind == "state" else encoder_of(kind, scenario)
        boxes = [spaces.Box(-np.inf, np.inf, shape) for shape in self._encoder.shapes]
        if kind == "state":
            boxes = [spaces.Box(*component_bounds(scenario), dtype=np.float32)]
        named = self._named(boxes)
        self.space: spaces.Space = named
        if isinstance(named, dict):
            self.space = spaces.Dict(named)

    def observe(
        self, state: State, missions: np.ndarray, uavs: np.ndarray
    ) -> tuple[Observation, np.ndarray]:
        """The observations of UAV ``uavs[r]`` in mission ``missions[r]``, for every r.

        Args:
            state: The state of B missions.
            missions: (R,) indices of the missions.
            uavs: (R,) indices of the UAVs, or -1 for an observation of zeros.

        Returns:
            The observations, arrays with R rows, and the (R, 5) masks of the allowed actions as
            booleans. Only Hover is allowed for a UAV that charges or is not active, and for -1.
        """
        if self.kind == "state" and not self.guarded:
            allowed = legal_actions(state.uavs, self._chart.zones, missions, uavs)
            return self._encoder.encode(state, missions, uavs)[0], allowed
        states = compact_states(state, self._chart, self.guarded, self._ways)
        parts = self._encoder.encode(state if self.kind == "state" else states, missions, uavs)
        return self._named(parts), masks(states, missions, uavs)

    def _named(self, parts: Sequence[Any]) -> Any:
        """The parts by their names, or the only one."""
        names = _PARTS.get(self.kind)
        if names:
            return dict(zip(names, parts, strict=True))
        return parts[0]

    def observe_all(self, state: State, shown: np.ndarray) -> tuple[Observation, np.ndarray]:
        """The observations and masks of all B x I UAVs, row by row of ``shown``.

        Args:
            state: The state of B missions with up to I UAVs.
            shown: (B, I) the UAVs that observe something; the rows of the others are zeros.

        Returns:
            As ``observe``, with B x I rows.
        """
        missions, uavs = _rows(shown.shape)
        return self.observe(state, missions, np.where(shown, uavs, -1).ravel())


@lru_cache(maxsize=16)
def _rows(shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """(B * I,) the mission of each UAV of all missions, and (B, I) its index in the mission."""
    missions, uavs = np.indices(shape)
    return missions.ravel(), uavs


def rows_of(observations: Observation) -> list[Any]:
    """The observations of one UAV after the other."""
    if not isinstance(observations, dict):
        return list(observations)
    names = tuple(observations)
    rows = zip(*observations.values(), strict=True)
    return [dict(zip(names, row, strict=True)) for row in rows]
