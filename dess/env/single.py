"""``single_env``: a mission of one UAV as a Gymnasium ``Env``.

env = gymnasium.make("dess/Paper-v0")   # after ``import dess``; or single_env("paper")
observation, info = env.reset(seed=1)
observation, reward, terminated, truncated, info = env.step(4)
"""

from typing import Any, SupportsInt

import gymnasium
import numpy as np

from dess.env.parallel import HarvestEnv
from dess.record import MissionRecord
from dess.scenario import AnyScenario, ScenarioSpace


class HarvestSingleEnv(gymnasium.Env[Any, SupportsInt]):
    """One mission of one UAV, whatever fleet the scenario has; see ``HarvestEnv``.

    The mask of the allowed actions is ``info["action_mask"]``, and that of the next step also
    ``action_masks()``, where sb3-contrib looks for it.
    """

    metadata = HarvestEnv.metadata

    def __init__(
        self,
        scenario: AnyScenario = "paper",
        seed: int | None = None,
        render_mode: str | None = None,
        observation: str = "vector",
        guarded: bool = False,
    ):
        """Make an environment; the arguments are those of ``parallel_env``.

        Raises:
            InputError: If one of the arguments is not allowed.
        """
        space = ScenarioSpace.of(scenario, uavs=1)
        self._mission = HarvestEnv(space, seed, render_mode, observation, "info", "stay", guarded)
        (self._agent,) = self._mission.possible_agents
        self.render_mode = render_mode
        self.observation_space = self._mission.observation_space(self._agent)
        self.action_space = self._mission.action_space(self._agent)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start the next mission, as ``HarvestEnv.reset``."""
        super().reset(seed=seed)
        observations, infos = self._mission.reset(seed, options)
        return observations[self._agent], self._known(infos)

    def step(self, action: SupportsInt) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Run one mission slot, as ``HarvestEnv.step``."""
        *outcome, infos = self._mission.step({self._agent: int(action)})
        observation, reward, terminated, truncated = (part[self._agent] for part in outcome)
        return observation, reward, terminated, truncated, self._known(infos)

    def action_masks(self) -> np.ndarray:
        """The (5,) mask of the actions that are allowed in the next step."""
        return self._mask

    def record(self) -> MissionRecord:
        """The record of the mission up to the present slot."""
        return self._mission.record()

    def render(self) -> Any:
        """A picture, as ``HarvestEnv.render``."""
        return self._mission.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._mission.close()

    def _known(self, infos: dict[str, dict[str, Any]]) -> dict[str, Any]:
        info = infos[self._agent]
        self._mask = info["action_mask"].astype(bool)
        return info


single_env = HarvestSingleEnv
