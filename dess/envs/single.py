"""``single_env``: a mission of one UAV as a Gymnasium ``Env``.

>>> env = gymnasium.make("dess.envs:dess/Paper-v0")   # or single_env("paper")
>>> observation, info = env.reset(seed=1)
>>> observation, reward, terminated, truncated, info = env.step(4)
"""

from typing import Any

import gymnasium
import numpy as np

from dess.envs.options import with_known_options
from dess.envs.parallel import HarvestEnv
from dess.model.state import check_seed
from dess.scenario.scenario import AnyScenario, ScenarioSpace

_UAV = "uav_0"


class HarvestSingleEnv(gymnasium.Env[Any, int]):
    """One mission of one UAV, whatever fleet the scenario has; see ``HarvestEnv``.

    The mask of the allowed actions is ``info["action_mask"]``, and that of the next step also
    ``action_masks()``, where sb3-contrib looks for it.

    Attributes:
        mission: The same mission as a PettingZoo environment, which has its ``record()``.
    """

    metadata = HarvestEnv.metadata

    @with_known_options
    def __init__(
        self,
        scenario: AnyScenario = "paper",
        seed: int | None = None,
        render_mode: str | None = None,
        observation: str = "vector",
        guarded: bool = False,
    ):
        """Make an environment.

        Args:
            scenario: The scenario, or what ``load_scenario`` takes.
            seed: As for ``HarvestEnv``.
            render_mode: As for ``HarvestEnv``.
            observation: As for ``HarvestEnv``.
            guarded: As for ``HarvestEnv``.

        Raises:
            InputError: If one of the arguments is not allowed.
        """
        space = ScenarioSpace.of(scenario, uavs=1)
        self.mission = HarvestEnv(space, seed, render_mode, observation, "info", "stay", guarded)
        self.render_mode = self.mission.render_mode
        self.observation_space = self.mission.observation_space(_UAV)
        self.action_space = self.mission.action_space(_UAV)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start the next mission, as ``HarvestEnv.reset``.

        Raises:
            InputError: If the seed or the replication is out of range.
        """
        if seed is not None:  # gymnasium takes no integer of numpy
            check_seed(seed, 0)
            seed = int(seed)
        super().reset(seed=seed)
        return self._own(self.mission.reset(seed, options))

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Run one mission slot, as ``HarvestEnv.step``."""
        return self._own(self.mission.step({_UAV: action}))

    def action_masks(self) -> np.ndarray:
        """The (5,) mask of the actions that are allowed in the next step."""
        return self._mask

    def render(self) -> Any:
        """A picture, as ``HarvestEnv.render``."""
        return self.mission.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self.mission.close()

    def _own(self, parts: tuple[dict[str, Any], ...]) -> Any:
        of_uav = tuple(part[_UAV] for part in parts)
        self._mask = of_uav[-1]["action_mask"].astype(bool)
        return of_uav


single_env = HarvestSingleEnv
