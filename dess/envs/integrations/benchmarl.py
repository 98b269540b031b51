"""``parallel_env`` as a task of BenchMARL.

task = HarvestTask("paper", {"scenario": "paper"})
experiment = Experiment(task, algorithm_config=MappoConfig.get_from_yaml(), ...)
"""

from collections.abc import Callable
from itertools import count
from typing import Any

from benchmarl.environments.pettingzoo.common import PettingZooClass
from torchrl.envs import EnvBase, PettingZooWrapper

from dess.envs.parallel import parallel_env
from dess.model.state import spaces_of


class HarvestTask(PettingZooClass):
    """A task that takes the arguments of ``parallel_env``, with the scenario, as its ``config``.

    UAVs that have ended stay until the mission is over. BenchMARL reads their masks, and the state
    of the fleet for critics that see all of it. Each environment that an experiment makes has a
    seed of its own, the first, for the evaluation, that of the experiment; in processes of their
    own (``parallel_collection``), all environments of the collection have the same seed.
    """

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Callable[[], EnvBase]:
        """A function that makes one environment, with the next seed."""
        seeds = count(seed or 0)

        def make() -> EnvBase:
            options = {"seed": next(seeds), "mask": "info", "ended": "stay"} | self.config
            return PettingZooWrapper(parallel_env(**options), return_state=True, device=device)

        return make

    def supports_continuous_actions(self) -> bool:
        """No: an action is one of five."""
        return False

    def supports_discrete_actions(self) -> bool:
        """Yes."""
        return True

    def has_render(self, env: EnvBase) -> bool:
        """Whether ``config`` asks for pictures: ``render_mode="rgb_array"``."""
        return "render_mode" in self.config

    def max_steps(self, env: EnvBase) -> int:
        """The slots after which a mission is truncated."""
        return spaces_of([self.config["scenario"]])[0].max_slots

    @staticmethod
    def env_name() -> str:
        """The name under which BenchMARL stores results."""
        return "dess"
