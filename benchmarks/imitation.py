"""Does the learner gain from the planner's decisions? Trainings with and without, equal budgets.

    python -m benchmarks.imitation --out runs/imitation
    python -m benchmarks.imitation --out runs/imitation --start ddqn --ticks 6000

The planner flies missions once, and its actions are kept in the folder. In a training, a share of
the environments flies these missions again, so their transitions are in the replay memory. With the
large-margin loss (T. Hester et al., Deep Q-learning from demonstrations, AAAI 2018) the network is
also to give the planner's action a higher value there than any other allowed action.

Every training leaves its policy in the folder, and is not run again. Prints a row per policy: means
over missions that no training has used, the paired difference to the training of the same seed
without the planner, and the agreement with the planner in missions that it was not shown. With
``--start``, trainings continue that of a shipped policy, whose row is the last.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import torch

from benchmarks.recorded import Recorded, Recorder
from dess import load_scenario, policies, simulate_batch
from dess.analysis.metrics import PRODUCT
from dess.analysis.stats.intervals import mean_interval
from dess.envs.observations.states import CompactStates, masks
from dess.model.guard import guard
from dess.model.view import View
from dess.policies.learner.config import MISSION_SEED, TrainingConfig, load_config
from dess.policies.learner.dqn import Batch, DQNLearner, DQNTraining
from dess.policies.learner.trained import read_weights, save_policy
from dess.policies.registry import TRAINED

RECORDED, EVALUATED = 777_002, 777_001  # seeds of the planner's missions and of the evaluation
HELD_OUT = 50  # of the planner's missions, which no training sees
ENVIRONMENTS = 64  # of the training's 256, in which the planner's missions are flown
MARGIN = 0.1  # in scaled values: the median gap between the best two actions is 0.06
# Variant -> environments with the planner's missions; whether the TD loss, and whether the margin
# loss, is computed there.
VARIANTS = {
    "without": (0, True, False),
    "imitation": (ENVIRONMENTS, True, True),
    "no-margin": (ENVIRONMENTS, True, False),
    "margin-only": (ENVIRONMENTS, False, True),
}


class ImitatingLearner(DQNLearner):
    """A learner with other losses on the transitions of the first environments."""

    environments, flown, has_td, weight = 1, 0, True, 0.0

    def compute_loss(self, batch: Batch) -> tuple[torch.Tensor, torch.Tensor]:
        """The loss of the TD error and of the margin, and the values of the actions."""
        is_shown = batch.rows % self.environments < self.flown
        loss, chosen = super().compute_loss(batch if self.has_td else _part_of(batch, ~is_shown))
        if self.weight and is_shown.any():
            excess = self._excess(_part_of(batch, is_shown))
            loss = loss + self.weight * excess.sum() / len(batch.rows)
        return loss, chosen

    def _excess(self, batch: Batch) -> torch.Tensor:
        """By how much the planner's actions are not the highest by the margin; (B,) values."""
        values = self.action_values(self.online, batch.state, batch.rows, batch.uav)
        planned = torch.from_numpy(batch.action)[:, None]
        margins = torch.full_like(values, MARGIN).scatter_(1, planned, 0.0)
        allowed = torch.from_numpy(masks(batch.state, batch.rows, batch.uav))
        highest = (values + margins).masked_fill(~allowed, -torch.inf).amax(1)
        return highest - values.gather(1, planned).squeeze(1)


def _part_of(batch: Batch, which: np.ndarray) -> Batch:
    """The transitions of a minibatch for which ``which`` is true."""
    return Batch(batch.state, *(part[which] for part in batch[1:]))


class ImitatingTraining(DQNTraining):
    """A training whose first environments fly the planner's missions again and again."""

    def __init__(
        self, config: TrainingConfig, planned: np.ndarray,
        flown: int, has_td: bool, has_margin: bool, weight: float,
    ):  # fmt: skip
        self.planned, self.flown, self.following = planned, flown, 0
        device = torch.device("cpu")
        super().__init__(config, device)
        self.learner = ImitatingLearner(self.learner.online, self.observation, config, device)
        self.learner.environments, self.learner.flown = config.num_envs, flown
        self.learner.has_td, self.learner.weight = has_td, weight * has_margin

    def _collect_slot(self, epsilon: float) -> None:
        # The memory of a trained network is not to begin with random actions.
        super()._collect_slot(min(epsilon, self.phase.epsilon[0]))

    def _launch_missions(self, environments: np.ndarray) -> None:
        super()._launch_missions(environments[environments >= self.flown])
        again = environments[environments < self.flown]
        if not len(again):
            return
        own = self.stepper.replication
        if self.following + len(again) > len(self.planned) - HELD_OUT:
            self.following = 0
        self.stepper.start_at(RECORDED, self.following)
        self.stepper.launch(again)
        self.following += len(again)
        self.early[again] = False
        self.stepper.start_at(MISSION_SEED + self.config.seed, own)

    def _choose_exploring(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray, epsilon: float
    ) -> np.ndarray:
        actions = super()._choose_exploring(states, missions, uavs, epsilon)
        again = missions < self.flown
        now = self.stepper.state.missions[missions[again]]
        actions[again] = self.planned[now["replication"], now["slot"], uavs[again]]
        return actions


class Compared(Recorded):
    """The recorded actions as a policy, compared with the decisions of another policy."""

    def __init__(self, planned: np.ndarray, policy: Any):
        super().__init__(planned)
        self.policy, self.equal = policy, []

    def act(self, view: View) -> np.ndarray:
        """The recorded actions."""
        actions = super().act(view)
        is_choice = guard(view).sum(1) > 1
        self.equal.extend((self.policy.act(view) == actions)[is_choice])
        return actions


def recorded(out: Path, missions: int) -> np.ndarray:
    """The (missions, slots, I) actions of the planner, which a file in the folder keeps."""
    file, space = out / f"planner-{missions}.npy", load_scenario("paper")
    if not file.exists():
        planner = policies.load("planner")
        recorder = Recorder(planner, missions, space.max_slots, space.uavs[1])
        simulate_batch(space, recorder, RECORDED, missions)
        out.mkdir(parents=True, exist_ok=True)
        np.save(file, recorder.actions)
    return np.load(file)


def config_for(start: str | None, seed: int, ticks: int) -> TrainingConfig:
    """The last phase of ``quick``, or a continuation of the training of a shipped policy."""
    changes = {"ticks": ticks}
    if start:
        changes |= {"epsilon": (0.02, 0.02), "learning_rate": (1e-4, 1e-5)}
    config = load_config("ddqn" if start else "quick", seed=seed, precision="float32")
    phase = config.phases[-1].model_copy(update=changes)
    return config.model_copy(update={"phases": (phase,), "evaluate_every": 1000})


def main() -> None:
    """Train, evaluate and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the planner's actions")
    parser.add_argument("--start", choices=policies.registry.trained_names())
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--ticks", type=int, default=12_000)
    parser.add_argument("--weight", type=float, default=0.3, help="of the margin loss")
    parser.add_argument("--planned", type=int, default=400, help="missions of the planner")
    parser.add_argument("--missions", type=int, default=2000, help="missions of an evaluation")
    given = parser.parse_args()
    planned = recorded(given.out, given.planned)
    shown = range(given.planned - HELD_OUT, given.planned)
    print("| policy | success [%] | product [%] | difference | agreement [%] |")
    print("| --- | --- | --- | --- | --- |")
    for seed in given.seeds:
        config, first = config_for(given.start, seed, given.ticks), None
        folders = [given.out / f"{config.name}-{seed}-{variant}" for variant in VARIANTS]
        for variant, folder in zip(VARIANTS, folders, strict=True):
            if not folder.exists():
                training = ImitatingTraining(config, planned, *VARIANTS[variant], given.weight)
                if given.start:
                    training.begin_with(read_weights(TRAINED / given.start))
                training.run_ticks(given.ticks)
                save_policy(folder, training.best, config, training.space)
        for name in [*folders, given.start] if given.start else folders:
            policy = policies.load(name)
            records = simulate_batch(config.space, policy, EVALUATED, given.missions).missions
            products = 100 * records[PRODUCT]
            first = products if first is None else first
            gain = mean_interval(products - first)
            compared = Compared(planned, policy)
            simulate_batch(config.space, compared, RECORDED, shown)
            print(
                f"| {name} | {100 * records['success'].mean():.1f} | {products.mean():.1f} "
                f"| {gain.mean:+.2f} [{gain.low:.2f}, {gain.high:.2f}] "
                f"| {100 * np.mean(compared.equal):.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
