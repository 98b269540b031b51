"""``vector_env`` as a ``VecEnv`` of stable-baselines3, with the masks that sb3-contrib asks for.

env = SB3VecEnv(dess.vector_env(scenario, num_envs=64))
model = MaskablePPO("MlpPolicy", env)
"""

import time
from typing import Any

import numpy as np
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv

from dess.envs.vector import HarvestVectorEnv
from dess.model.state import ACTIVE


class SB3VecEnv(VecEnv):
    """The rows of a ``HarvestVectorEnv`` as environments: each is a UAV, its episode a mission.

    A UAV that has ended waits for the end of its mission: it observes zeros, may only hover and has
    reward 0. So what it has gained belongs to its own slots, and its return is that of its mission.

    When a mission is over, the infos of its rows have what SB3 expects: ``terminal_observation``,
    ``TimeLimit.truncated``, and for UAVs of the fleet, the ``episode`` statistics of ``Monitor``
    and ``is_success``. In all other rows they are one shared empty dictionary.

    ``seed`` and ``set_options`` are those of ``HarvestVectorEnv.reset`` for all missions together.
    """

    def __init__(self, env: HarvestVectorEnv):
        self.env = env
        self._started = time.time()
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Any:
        """Start a new mission in every environment, and return the observations of all rows."""
        observations, _ = self.env.reset(seed=self._seeds[0], options=self._options[0])
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Take the (R,) actions of the next step."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Run one mission slot; returns observations, rewards, dones and infos of all rows."""
        observations, rewards, terminated, truncated, info = self.env.step(self._actions)
        over = terminated | truncated
        infos: list[dict[str, Any]] = [{}] * self.num_envs
        for row in np.flatnonzero(over).tolist():
            infos[row] = self._final(row, bool(truncated[row]), info)
        return observations, rewards, over, infos

    def _final(self, row: int, truncated: bool, info: dict[str, Any]) -> dict[str, Any]:
        """The info of a row whose mission is over."""
        final = {"terminal_observation": info["final_obs"][row], "TimeLimit.truncated": truncated}
        mission = info["final_info"]
        if mission["uav"]["end"][row] != ACTIVE:  # the fleet has this UAV
            reward = float(mission["uav"]["reward"][row])
            slots = int(mission["slots"][row])
            final["episode"] = {"r": reward, "l": slots, "t": time.time() - self._started}
            final["is_success"] = bool(mission["success"][row])
        return final

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """The rows of what a method of the environment returns, such as ``action_masks``."""
        rows = getattr(self.env, method_name)(*method_args, **method_kwargs)
        return [rows[row] for row in self._get_indices(indices)]

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the environment, once for each row."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of the environment, which is that of all rows."""
        setattr(self.env, attr_name, value)

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """True for ``Monitor``, whose statistics are in the infos."""
        return [issubclass(Monitor, wrapper_class) for _ in self._get_indices(indices)]

    def close(self) -> None:
        """Close the environment."""
        self.env.close()
