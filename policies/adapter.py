"""The policy of another library as a policy of ``dess``.

class Mine(Adapter):   # in my_policies.py, for dess evaluate --policy my_policies.py:Mine
    def __init__(self):
        super().__init__("mine", choose, guarded=True, weights=FILE)
"""

from ast import literal_eval
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from dess.base.files.reading import hash_file
from dess.envs.observations.observer import Observer
from dess.envs.stepper import checked_actions
from dess.model.view import View
from dess.physics.chart import geometry
from dess.scenario.scenario import ScenarioSpace

LIMIT = 2**32  # bytes of the largest file of weights


class Adapter:
    """A policy that observes what UAVs observe in ``parallel_env`` and ``vector_env``.

    An action that the mask leaves out is carried out as in the environments: if it leads off the
    grid, the safety controller overrules it.

    Attributes:
        name: The name under which results are stored.
        observation: The kind of observation.
        guarded: Whether the masks are those of the return guard.
        weights: The checksum of the file of weights, stored with results; empty if there is none.
    """

    def __init__(
        self,
        name: str,
        act: Callable[[Any, np.ndarray], Any],
        observation: str = "vector",
        guarded: bool = False,
        weights: str | Path | None = None,
    ):
        """Make a policy of a function.

        Args:
            name: The name under which results are stored.
            act: Chooses the (R,) actions for the observations of R UAVs, with R rows, and their
                masks (R, 5) of booleans, for any R. The same row must always give the same action.
            observation: ``vector``, ``maps`` or ``state``, as in the training.
            guarded: Whether the masks leave out what the return guard does not allow.
            weights: The file with the weights of ``act``, so that a study notices if they change.

        Raises:
            InputError: If the file of weights cannot be read.
        """
        self.name = name
        self.observation = observation
        self.guarded = guarded
        self._choose = act
        self.weights = hash_file(Path(weights), LIMIT) if weights else ""

    def act(self, view: View) -> np.ndarray:
        """Choose the (R,) actions for the rows of the view.

        Raises:
            InputError: If there is no such observation, or the function returns no actions.
        """
        fleet = view.state.uavs.shape[1]
        sea = geometry(view.world.chart)
        nodes = view.world.nodes.tolist()
        observer = _make_observer(self.observation, self.guarded, fleet, repr((sea, nodes)))
        seen = observer.observe(view.state, view.mission, view.uav)
        return checked_actions(self._choose(*seen), view.mission.shape)


@lru_cache
def _make_observer(kind: str, guarded: bool, uavs: int, sea: str) -> Observer:
    fields, nodes = literal_eval(sea)
    return Observer(ScenarioSpace.of(uavs=uavs, nodes=nodes, **fields), kind, guarded)
