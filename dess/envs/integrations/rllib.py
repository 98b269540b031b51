"""RLlib: a mission as a ``MultiAgentEnv`` for ``ActionMaskingTorchRLModule``.

config = PPOConfig().environment(HarvestMultiAgentEnv, env_config={"scenario": scenario})
"""

from typing import Any

from gymnasium import spaces
from ray.rllib.env.multi_agent_env import MultiAgentEnv

from dess.envs.parallel import parallel_env


class HarvestMultiAgentEnv(MultiAgentEnv):
    """``parallel_env`` with the keys that RLlib's module for action masks reads.

    An observation is a dictionary of ``observations`` and ``action_mask``. RLlib's own wrapper,
    ``ParallelPettingZooEnv``, takes the fleet of the first mission for the largest one, and runs
    past the end of a mission in whose last slot one UAV is terminated and another one truncated.

    RLlib hands the seed of ``config.debugging(seed=...)`` to ``reset``, another one to each runner.
    """

    def __init__(self, config: dict[str, Any]):
        """Make the environment.

        Args:
            config: The arguments of ``parallel_env``: the ``scenario``, and where wanted others.

        Raises:
            InputError: If one of the arguments is not allowed.
        """
        self.env = parallel_env(**config)
        self.agents = self.possible_agents = self.env.possible_agents
        self.observation_spaces = {
            agent: spaces.Dict(_renamed(space))
            for agent, space in self.env.observation_spaces.items()
        }
        self.action_spaces = self.env.action_spaces
        super().__init__()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start the next mission; see ``HarvestEnv.reset``."""
        observations, infos = self.env.reset(seed, options)
        return {agent: _renamed(observation) for agent, observation in observations.items()}, infos

    def step(self, actions: dict[str, int]) -> tuple[dict, dict, dict, dict, dict]:
        """Run one mission slot; see ``HarvestEnv.step``."""
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        terminated["__all__"] = not self.env.agents
        truncated["__all__"] = False
        seen = {agent: _renamed(observation) for agent, observation in observations.items()}
        return seen, rewards, terminated, truncated, infos


def _renamed(observation: Any) -> dict[str, Any]:
    return {
        "observations": observation["observation"],
        "action_mask": observation["action_mask"],
    }
