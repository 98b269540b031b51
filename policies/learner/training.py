"""What the trainings by double DQN and by proximal policy optimization have in common.

A training goes through its phases tick by tick, evaluates its network now and then, and keeps the
best weights. Missions for training have the seed ``MISSION_SEED`` + the seed of the training,
missions for selecting weights have the config's ``evaluation_seed``, and missions for evaluations
should have any other seed.
"""

import time
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch import nn

from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates, compact_states
from dess.envs.stepper import MissionStepper
from dess.model.batch import simulate_batch
from dess.policies.learner.arrays import require_weights
from dess.policies.learner.config import Phase, TrainingConfig
from dess.policies.learner.description import field_ranges
from dess.policies.learner.network import make_network, to_arrays, to_tensors
from dess.policies.learner.policy import LearnedPolicy
from dess.policies.learner.trained import expected_weights, make_observation, make_policy
from dess.policies.network import Weights
from dess.scenario.scenario import ScenarioSpace

EVALUATED_METRICS = ("success", "collection_ratio", "collection_ratio_and_communication", "reward")
MISSIONS_PER_PHASE = 2**28
SELECT_BY = "collection_ratio_and_communication"
EARLY = 4  # the first evaluation comes after this part of the ticks between evaluations


class Learner:
    """The networks of a training and their optimizers.

    Attributes:
        config: The settings of the training.
        device: The device on which all of them are.
        networks: The networks, by name.
        online: The network that is trained.
        average: A copy that follows it slowly, and that is evaluated and saved; None if there is
            none.
        optimizers: The optimizers, each by the name under which a checkpoint has it.
    """

    def __init__(self, config: TrainingConfig, device: torch.device, **networks: nn.Module | None):
        self.config = config
        self.device = device
        present = {name: network for name, network in networks.items() if network is not None}
        self.networks = {name: network.to(device) for name, network in present.items()}
        self.online = self.networks["online"]
        self.average = self.networks.get("average")
        self.reset_optimizers()

    def reset_optimizers(self) -> None:
        """Reset the optimizers."""
        self.optimizer = torch.optim.Adam(self.online.parameters(), fused=True)
        self.optimizers = {"optimizer": self.optimizer}

    def ticks_before_step(self, optimizer: str) -> int:
        """The ticks of a phase before an optimizer makes its first step."""
        return 0

    @property
    def evaluated(self) -> nn.Module:
        """The network that is evaluated: ``average`` or, without one, ``online``."""
        return self.online if self.average is None else self.average

    def to_tensor(self, array: np.ndarray) -> torch.Tensor:
        """An array on the device."""
        return torch.from_numpy(array).to(self.device)

    def step(self, learning_rate: float) -> None:
        """Let the optimizer of ``online`` make a step, and ``average`` follow."""
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate
        self.optimizer.step()
        if self.average is not None:
            soft_update(self.average, self.online, self.config.average_rate)


class Training:
    """A training in progress, from its first tick to its last; one class for each algorithm.

    Attributes:
        config: The settings of the training.
        learner: The networks and their optimizers.
        tick: Number of ticks done, over all phases.
        curve: One row per evaluation: progress, metrics and losses.
    """

    learner: Learner

    def __init__(self, config: TrainingConfig, device: torch.device):
        self.config = config
        self.device = device
        self.generator = np.random.default_rng(config.seed)
        torch.manual_seed(config.seed)
        self.spaces = config.mission_spaces()
        self.space = self.spaces[0]
        self.layout, self.observation = make_observation(config, self.space)
        network = make_network(config, self.observation.shapes)
        self.learner = self._make_learner(network)
        self.tick = self.updates = self.uav_slots = 0
        self.seconds = 0.0
        self.curve: list[dict[str, Any]] = []
        self.best = _copy_weights(network)
        self.finished: list[np.ndarray] = []
        self.losses: list[dict[str, torch.Tensor]] = []
        self.enter_phase(0)

    @cached_property
    def ranges(self) -> dict[str, list[float]]:
        """The least and the largest value of each field in the missions."""
        return field_ranges(self.spaces)

    def _make_learner(self, network: Any) -> Any:
        """The networks and their optimizers, for a new network."""
        raise NotImplementedError

    def _begin_missions(self) -> None:
        """Begin the missions of a phase."""
        raise NotImplementedError

    def _learn_in_tick(self, share: float) -> None:
        """Simulate the missions of a tick, and update.

        Args:
            share: Of the phase that is over.
        """
        raise NotImplementedError

    @property
    def phase(self) -> Phase:
        """The phase to which the next tick belongs."""
        return self.config.phases[self.phase_index]

    @property
    def done(self) -> bool:
        """Whether all phases are over."""
        return self.tick >= self.config.ticks

    def run_ticks(self, ticks: int) -> None:
        """Train for that many ticks, or until the last phase ends."""
        for _ in range(min(ticks, self.config.ticks - self.tick)):
            began = time.perf_counter()
            self.step()
            self.seconds += time.perf_counter() - began

    def step(self) -> None:
        """Run one tick: the missions, the updates and, if due, an evaluation."""
        self._learn_in_tick((self.tick - self.phase_start) / self.phase.ticks)
        self.tick += 1
        over = self.tick - self.phase_start == self.phase.ticks
        if over or self.tick % self.config.evaluate_every == 0:
            self._evaluate_policy()
        elif self.tick == max(self.config.evaluate_every // EARLY, 1):
            self._evaluate_early()
        if over and not self.done:
            for network in self.learner.networks.values():
                network.load_state_dict(self.best)
            self.enter_phase(self.phase_index + 1)

    def make_policy(self, weights: Mapping[str, torch.Tensor]) -> LearnedPolicy:
        """A policy with these weights."""
        return make_policy(self.config, self.layout, self.observation, to_arrays(weights))

    def begin_with(self, weights: Weights) -> None:
        """Begin with the weights of another training.

        Raises:
            InputError: If they are not those of such a network.
        """
        require_weights(weights, expected_weights(self.config, self.observation), "from")
        for network in self.learner.networks.values():
            network.load_state_dict(to_tensors(weights))
        self.best = _copy_weights(self.learner.evaluated)

    @property
    def kept(self) -> dict[str, torch.Tensor]:
        """The best weights so far; before the first evaluation the present ones."""
        return self.best if self.curve else _copy_weights(self.learner.evaluated)

    def enter_phase(self, index: int) -> None:
        """Begin a phase with new missions and new optimizers."""
        self.phase_index = index
        self.phase_start = self.tick
        self._begin_missions()
        self.learner.reset_optimizers()
        self.scores: list[float] = []
        self.best_score: float | None = None

    def _in_phase(self, space: ScenarioSpace) -> ScenarioSpace:
        """A scenario as the missions of the present phase have it."""
        return ScenarioSpace.of(space, flight_cost=1 if self.phase.battery else 0)

    def _evaluate_policy(self) -> None:
        """Simulate the selection missions; keep the weights with the best moving average."""
        config = self.config
        records = self._selection_missions()
        settled = len(self.scores) == config.window  # before that, the latest weights are selected
        self.scores = [*self.scores, float(records[SELECT_BY].mean())][-config.window :]
        average = float(np.mean(self.scores))
        is_best = not settled or self.best_score is None or average > self.best_score
        if is_best:
            self.best = _copy_weights(self.learner.evaluated)
            self.best_score = average
        self.curve.append(self._make_row(records, average, is_best))
        self.finished, self.losses = [], []

    def _evaluate_early(self) -> None:
        """Evaluate before the first interval is over, so that a new training soon shows a result.

        The present weights are kept until the next evaluation, which replaces them. Nothing else
        changes: the training goes on as if there had been no early evaluation.
        """
        records = self._selection_missions()
        self.best = _copy_weights(self.learner.evaluated)
        self.curve.append(self._make_row(records, float(records[SELECT_BY].mean()), True))

    def _selection_missions(self) -> np.ndarray:
        """The records of the selection missions under the present policy."""
        missions = range(self.config.evaluation_missions)
        spaces = [
            self._in_phase(space) for space in self.config.mission_spaces(of_evaluations=True)
        ]
        policy = self.make_policy(self.learner.evaluated.state_dict())
        of_missions: Any = spaces[0]
        if len(spaces) > 1:
            of_missions = [spaces[mission % len(spaces)] for mission in missions]
        return simulate_batch(of_missions, policy, self.config.evaluation_seed, missions).missions

    def _make_row(self, records: np.ndarray, average: float, is_best: bool) -> dict[str, Any]:
        """A row of the curve: progress, metrics of an evaluation, metrics and losses since."""
        share = (self.tick - self.phase_start) / self.phase.ticks
        row = {
            "tick": self.tick,
            "phase": self.phase.name,
            "uav_slots": self.uav_slots,
            "updates": self.updates,
            "seconds": self.seconds,
            "epsilon": interpolate_ends(self.phase.epsilon, share / self.phase.epsilon_decay),
            "learning_rate": interpolate_ends(self.phase.learning_rate, share),
            "moving_average": average,
            "is_best": is_best,
        }
        row |= {f"evaluation_{name}": float(records[name].mean()) for name in EVALUATED_METRICS}
        if self.finished:
            finished = np.concatenate(self.finished)
            row |= {f"training_{name}": float(finished[name].mean()) for name in EVALUATED_METRICS}
        if self.losses:
            for name in self.losses[-1]:
                row[name] = float(torch.stack([loss[name] for loss in self.losses]).mean())
        return row


def interpolate_ends(ends: tuple[float, float], share: float) -> float:
    """Linear interpolation between the ends, constant beyond a share of 1."""
    return ends[0] + (ends[1] - ends[0]) * min(max(share, 0.0), 1.0)


def _copy_weights(network: nn.Module) -> dict[str, torch.Tensor]:
    """A copy of a network's weights."""
    return {name: value.detach().clone() for name, value in network.state_dict().items()}


def find_acting_uavs(
    stepper: MissionStepper, guarded: bool
) -> tuple[CompactStates, np.ndarray, np.ndarray]:
    """The present states of missions, and the missions and numbers of the R UAVs that act."""
    states = compact_states(stepper.state, stepper.world.chart, guarded)
    is_acting = states.uavs[..., column.ACTIVE] > states.uavs[..., column.CHARGING]
    missions, uavs = np.nonzero(is_acting)
    return states, missions, uavs


def find_ended_missions(stepper: MissionStepper, outcome: np.ndarray) -> np.ndarray:
    """The environments whose missions have ended in the slot with this outcome."""
    is_over = stepper.state.missions["active"] == 0
    return np.flatnonzero(is_over & outcome["acted"].any(1))


@torch.no_grad()
def soft_update(target: nn.Module, online: nn.Module, rate: float) -> None:
    """Move the weights of the target network towards the online weights (eq. 28).

    Args:
        target: The target network, changed in place.
        online: The online network.
        rate: The share of the way, tau in the paper; 1 copies the weights.
    """
    torch._foreach_lerp_(list(target.parameters()), list(online.parameters()), rate)


class DivergenceError(ArithmeticError):
    """The loss or its gradient is no finite number any more: one line that says so."""


def check_finite(done: Mapping[str, torch.Tensor]) -> None:
    """Refuse an update whose loss, value or gradient is no finite number.

    Raises:
        DivergenceError: If one of them is not finite.
    """
    for name, value in done.items():
        if not torch.isfinite(value):
            raise DivergenceError(
                f"the training diverged: its {name} is {float(value)}; the best policy so far "
                "is kept; allowed: a smaller learning_rate, reward_scale or reward"
            )
