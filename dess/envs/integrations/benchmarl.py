"""``parallel_env`` as a task of BenchMARL.

task = HarvestTask("paper", {"scenario": "paper"})
algorithm = MappoConfig.get_from_yaml()
experiment = Experiment(task, algorithm_config=algorithm, callbacks=[FleetMeans()], ...)
"""

from collections.abc import Callable
from itertools import count
from typing import Any

import torch
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment.callback import Callback
from tensordict import TensorDictBase
from torchrl.envs import EnvBase, PettingZooWrapper

from dess.envs.parallel import parallel_env
from dess.model.state import ACTIVE, spaces_of


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


class FleetMeans(Callback):
    """Logs the mean return of the UAVs that the fleet of each mission has.

    BenchMARL's own means are over all agents, so they take a UAV that a smaller fleet lacks for one
    whose return is 0. These are logged beside them, as ``reward/episode_reward_of_fleet_mean``.
    """

    def on_batch_collected(self, batch: TensorDictBase) -> None:
        """Log the missions that have ended in a batch of the collection."""
        after = batch["next"]
        over = after["done"].squeeze(-1)
        self._log("collection", after["uav", "episode_reward"][over], after["uav", "info"][over])

    def on_evaluation_end(self, rollouts: list[TensorDictBase]) -> None:
        """Log the missions of an evaluation, of which each rollout is one."""
        after = [rollout["next", "uav"] for rollout in rollouts]
        returns = torch.stack([uavs["reward"].sum(0) for uavs in after])
        self._log("eval", returns, torch.stack([uavs["info"][-1] for uavs in after]))

    def _log(self, when: str, returns: torch.Tensor, infos: TensorDictBase) -> None:
        """Log the (missions, UAVs, 1) returns of UAVs whose end is known: the fleet has them."""
        of_fleet = returns.squeeze(-1)[infos["end"] != ACTIVE]
        if of_fleet.numel():
            name = f"{when}/reward/episode_reward_of_fleet_mean"
            mean = of_fleet.mean().item()
            self.experiment.logger.log({name: mean}, step=self.experiment.n_iters_performed)
