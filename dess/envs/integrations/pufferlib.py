"""PufferLib: many missions as one native ``PufferEnv``, and its policy with masked actions.

env = HarvestPufferEnv(scenario, num_envs=64)
policy = MaskedPolicy(env)
"""

from typing import Any

import numpy as np
import pufferlib
import torch
from gymnasium import spaces
from pufferlib.models import Default

from dess.envs.options import with_known_options
from dess.envs.vector import vector_env
from dess.scenario.scenario import AnyScenario


class HarvestPufferEnv(pufferlib.PufferEnv):
    """The rows of ``vector_env`` as agents; the mask is the end of the observation.

    PufferLib has one array for what its policies see, so an observation is the vector and then the
    five numbers of the mask, 1 for an action that is allowed. ``masks`` tells which rows act next.
    The infos are a list: the mission's return and whether it succeeded, when missions have ended.
    """

    @with_known_options
    def __init__(
        self,
        scenario: AnyScenario,
        num_envs: int = 1,
        seed: int | None = None,
        guarded: bool = False,
        buf: Any = None,
    ):
        """Make the environment.

        Args:
            scenario: The scenario, or the space from which each mission draws its parameters; or
                what ``load_scenario`` takes.
            num_envs: Number of missions in progress.
            seed: Seed of the missions, until ``reset`` is called with another seed.
            guarded: Whether the masks are those of the return guard.
            buf: The arrays of PufferLib to write into; without it, own ones.

        Raises:
            InputError: If one of the arguments is not allowed.
        """
        self.env = vector_env(scenario, num_envs, seed, guarded=guarded)
        self.num_agents, self.single_action_space = self.env.num_envs, self.env.single_action_space
        features = spaces.flatdim(self.env.single_observation_space)
        self.single_observation_space = spaces.Box(-np.inf, np.inf, (features + 5,), np.float32)
        super().__init__(buf)

    def reset(self, seed: int | None = None) -> tuple[np.ndarray, list[dict[str, Any]]]:
        """Start a new mission in every environment."""
        observations, info = self.env.reset(seed=seed)
        self._write(observations, info)
        return self.observations, []

    def step(self, actions: np.ndarray) -> tuple:
        """Run one mission slot of every mission."""
        observations, *outcome, info = self.env.step(np.asarray(actions))
        self._write(observations, info)
        self.rewards[:], self.terminals[:], self.truncations[:] = outcome
        return self.observations, self.rewards, self.terminals, self.truncations, _ended(info)

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def _write(self, observations: Any, info: dict[str, Any]) -> None:
        self.observations[:, :-5] = observations
        self.observations[:, -5:] = info["action_mask"]
        self.masks[:] = info["active"]


class MaskedPolicy(Default):
    """PufferLib's default policy; the end of an observation is the mask of the actions."""

    def forward(self, observations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """The logits, very low for what is not allowed, and the values of the rows."""
        logits, values = super().forward(observations)
        return logits.masked_fill(observations[:, -5:] == 0, -1e9), values.squeeze(-1)


def _ended(info: dict[str, Any]) -> list[dict[str, Any]]:
    """The means over the missions that have ended in this slot."""
    if "final_info" not in info:
        return []
    over, final = info["_final_info"], info["final_info"]
    return [{name: final[name][over].mean() for name in ("success", "collection_ratio", "slots")}]
