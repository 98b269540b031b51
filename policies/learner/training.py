"""Algorithm 1: missions run in parallel, and all UAVs train one network from one replay memory.

A *tick* is one mission slot of all environments, followed by the updates. Missions for training
have the seed ``MISSION_SEED`` + the seed of the training, missions for selecting weights have the
config's ``evaluation_seed``, and missions for evaluations should have any other seed.
"""

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import nn

from dess.batch import simulate_batch
from dess.code.kernels import kernel
from dess.env.stepper import MissionStepper
from dess.errors import InputError
from dess.observations import states as column
from dess.observations.maps import POOL
from dess.observations.observer import ENCODERS
from dess.observations.sets import Sets
from dess.observations.states import CompactStates, Layout, compact_states, layout_of, masks
from dess.scenario import ScenarioSpace
from dess.sea.chart import FAR, spread
from dess.state import HOVER, STEP_X, STEP_Y
from policies.learner.config import MISSION_SEED, Phase, TrainingConfig
from policies.learner.dqn import Learner, ReplayMemory
from policies.learner.network import NARROWEST, DuelingNetwork, PaperNetwork, SetNetwork
from policies.learner.policy import LearnedPolicy
from policies.learner.tensors import require_forms

METRICS = ("success", "collection_ratio", "collection_ratio_and_communication", "reward")
MISSIONS_PER_PHASE = 2**28
SELECT_BY = "collection_ratio_and_communication"
EARLY = 4  # the first evaluation comes after this part of the ticks between evaluations
# The attributes of a training that are plain values, not arrays.
_PROGRESS = (
    *("tick", "updates", "uav_slots", "seconds"),
    *("phase_index", "phase_start", "scores", "best_score"),
)


def build(config: TrainingConfig, layout: Layout | None) -> tuple[Any, nn.Module]:
    """The observation and a new network of a config, for missions with a layout, or on any sea."""
    precision = getattr(torch, config.precision)
    if layout is None:
        return Sets, SetNetwork(Sets.shapes, config.hidden, precision)
    if config.observation == "maps" and (2 * layout.grid - 1) // POOL < NARROWEST:
        raise InputError(
            f"observation: a grid of {layout.grid} is too small for maps; allowed: vector, sets"
        )
    observation = ENCODERS[config.observation](layout)
    if config.observation == "maps":
        return observation, PaperNetwork(observation.shapes, precision)
    return observation, DuelingNetwork(observation.shapes[0][0], config.hidden, precision)


class Waters:
    """The missions of a phase.

    Attributes:
        space: The scenario that they are drawn from.
        stepper: The missions in progress.
        early: (N, I) which UAVs return early.
        replay: What has happened in them.
        home: (H + 2, W + 2) cells to the nearest zone, with a border around the grid.
    """

    def __init__(self, training: "Training"):
        config, base = training.config, training.space
        fleet = base.uavs[1]
        self.space = ScenarioSpace.of(base, flight_cost=1 if training.phase.battery else 0)
        self.stepper = MissionStepper(self.space, config.num_envs, MISSION_SEED + config.seed)
        self.stepper.start_at(self.stepper.seed, training.phase_index * MISSIONS_PER_PHASE)
        self.early = np.zeros((config.num_envs, fleet), bool)
        self.replay = ReplayMemory(config.replay, config.num_envs, fleet, len(base.nodes))
        zones = self.space.chart.zones
        home = spread(zones, self.space.chart.parking)[0].reshape(zones.shape)
        self.home = np.pad(home, 1, constant_values=FAR)


class Training:
    """A training in progress, from its first tick to its last.

    Attributes:
        config: The settings of the training.
        learner: The networks and the optimizer.
        seas: The missions of the present phase; none in a training that keeps no missions.
        tick: Number of ticks done, over all phases.
        curve: One row per evaluation: progress, metrics and losses.
    """

    def __init__(self, config: TrainingConfig, device: torch.device):
        self.config, self.device = config, device
        self.generator = np.random.default_rng(config.seed)
        torch.manual_seed(config.seed)
        self.spaces = config.spaces()
        self.space = self.spaces[0]
        self.layout = None if config.is_proximal else layout_of(self.space)
        self.observation, network = build(config, self.layout)
        self.learner = self._learner(network)
        self.tick = self.updates = self.uav_slots = 0
        self.seconds = 0.0
        self.curve: list[dict[str, Any]] = []
        self.best = _weights(network)
        self.finished: list[np.ndarray] = []
        self.losses: list[dict[str, torch.Tensor]] = []
        self._enter_phase(0)

    def _learner(self, network: nn.Module) -> Any:
        return Learner(network, self.observation, self.config, self.device)

    @property
    def phase(self) -> Phase:
        """The phase to which the next tick belongs."""
        return self.config.phases[self.phase_index]

    @property
    def sea(self) -> Waters:
        """The present missions, and what has happened in them."""
        return self.seas[0]

    @property
    def stepper(self) -> MissionStepper:
        """The present missions."""
        return self.sea.stepper

    @property
    def replay(self) -> ReplayMemory:
        """The replay memory of the present missions."""
        return self.sea.replay

    @property
    def early(self) -> np.ndarray:
        """(N, I) which UAVs of the present missions return early."""
        return self.sea.early

    @property
    def done(self) -> bool:
        """Whether all phases are over."""
        return self.tick >= self.config.ticks

    def run(self, ticks: int) -> None:
        """Train for that many ticks, or until the last phase ends."""
        for _ in range(min(ticks, self.config.ticks - self.tick)):
            began = time.perf_counter()
            self.step()
            self.seconds += time.perf_counter() - began

    def step(self) -> None:
        """Run one tick: the missions, the updates and, if due, an evaluation."""
        self._learn((self.tick - self.phase_start) / self.phase.ticks)
        self.tick += 1
        over = self.tick - self.phase_start == self.phase.ticks
        if over or self.tick % self.config.evaluate_every == 0:
            self._evaluate()
        elif self.tick == max(self.config.evaluate_every // EARLY, 1):
            self._evaluate_early()
        if over and not self.done:
            for network in self.learner.networks().values():
                network.load_state_dict(self.best)
            self._enter_phase(self.phase_index + 1)

    def _learn(self, share: float) -> None:
        """Simulate a slot of all environments, and update.

        Args:
            share: Of the phase that is over.
        """
        config = self.config
        epsilon = between(self.phase.epsilon, share / self.phase.epsilon_decay)
        if self.replay.count == 0:
            for _ in range(config.learning_starts):
                self._collect(1.0 if self.tick == 0 else epsilon)
        self._collect(epsilon)
        rate = between(self.phase.learning_rate, share)
        for _ in range(config.updates):
            batch = self.replay.sample(config.batch, config.n_step, config.discount, self.generator)
            self.losses.append(self.learner.update(batch, rate))
            self.updates += 1

    def policy(self, weights: dict[str, torch.Tensor]) -> LearnedPolicy:
        """A policy with these weights."""
        _, network = build(self.config, self.layout)
        network.load_state_dict(weights)
        return self._as_policy(network)

    def _as_policy(self, network: nn.Module) -> LearnedPolicy:
        config = self.config
        return LearnedPolicy(config.name, self.observation, network, config.guard, self.layout)

    def begin_with(self, weights: Mapping[str, torch.Tensor]) -> None:
        """Begin with the weights of another training.

        Raises:
            InputError: If they are not those of such a network.
        """
        learner = self.learner
        require_forms(weights, learner.online.state_dict(), "from")
        for network in learner.networks().values():
            network.load_state_dict(weights)
        self.best = _weights(learner.evaluated)

    @property
    def kept(self) -> dict[str, torch.Tensor]:
        """The best weights so far; before the first evaluation the present ones."""
        return self.best if self.curve else _weights(self.learner.evaluated)

    def progress(self) -> dict[str, Any]:
        """The progress of the training, as plain values."""
        return {name: getattr(self, name) for name in _PROGRESS}

    def restore(self, progress: dict[str, Any]) -> None:
        """Restore what ``progress()`` returned; arrays and random states are restored elsewhere."""
        self._enter_phase(progress["phase_index"])
        for name in _PROGRESS:
            setattr(self, name, progress[name])

    def _enter_phase(self, index: int) -> None:
        """Begin a phase with new missions, an empty replay memory and a new optimizer."""
        self.phase_index, self.phase_start = index, self.tick
        self._begin_missions()
        self.learner.restart()
        self.scores: list[float] = []
        self.best_score: float | None = None

    def _begin_missions(self) -> None:
        self.seas = [Waters(self)]
        self._launch(self.stepper.indices)

    def _launch(self, environments: np.ndarray) -> None:
        """Start new missions, some of them with a low battery; draw which UAVs return early."""
        self.stepper.launch(environments)
        draws = self.generator.random((len(environments), self.early.shape[1]))
        self.early[environments] = draws < self.config.early_returns
        if self.config.low_battery_starts > 0 and len(environments):
            low = environments[
                self.generator.random(len(environments)) < self.config.low_battery_starts
            ]
            draws = self.generator.random((len(low), 2 + len(self.sea.space.nodes)))
            state = self.stepper.state
            _lower_batteries(state.missions, state.uavs, state.residual, low, draws)

    def _collect(self, epsilon: float) -> None:
        """Run one slot of all environments with the exploring policy, and store it."""
        state = self.stepper.state
        over = np.nonzero(state.missions["active"] == 0)[0]
        states = compact_states(state, self.stepper.world.chart, self.config.guard)
        missions, uavs = np.nonzero(
            states.uavs[..., column.ACTIVE] > states.uavs[..., column.CHARGING]
        )
        actions = np.full(state.uavs.shape, HOVER)
        if len(missions):
            actions[missions, uavs] = self._explore(states, missions, uavs, epsilon)
        outcome = self.stepper.step(actions)
        self.replay.add(
            states, actions, outcome["reward"],
            *(outcome[n] for n in ("acted", "terminated", "truncated")),
        )  # fmt: skip
        self.uav_slots += int(outcome["acted"].sum())
        ended = np.nonzero((state.missions["active"] == 0) & outcome["acted"].any(1))[0]
        if len(ended):
            self.finished.append(self.stepper.records(ended).missions)
        self._launch(over)

    def _explore(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray, epsilon: float
    ) -> np.ndarray:
        """Epsilon-greedy or softmax actions among the allowed ones."""
        allowed = masks(states, missions, uavs)
        noise = self.generator.random(allowed.shape)
        random = np.where(allowed, noise, -1.0).argmax(1)
        if epsilon >= 1.0:
            return random
        with torch.no_grad():
            learner = self.learner
            values = learner.values(learner.online, states, missions, uavs).cpu().numpy()
        if self.phase.temperature > 0.0:  # Gumbel noise samples from the softmax
            values = values / self.phase.temperature - np.log(-np.log(noise))
        choice = np.where(allowed, values, -np.inf).argmax(1)
        if self.config.early_returns > 0.0:
            homeward = allowed & self._homeward(states, missions, uavs)
            choice = np.where(homeward.any(1), np.where(homeward, noise, -1.0).argmax(1), choice)
        return np.where(self.generator.random(len(choice)) < epsilon, random, choice)

    def _homeward(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> np.ndarray:
        """The (R, 5) mask of the actions of UAVs that return early, to arrive with C_S left.

        The actions lead nearer to the zone; in the zone, a latched UAV hovers.
        """
        rows = states.uavs[missions, uavs]
        x, y = rows[:, column.X] + 1, rows[:, column.Y] + 1  # the table has a border
        home = self.sea.home[y, x]
        reserve = rows[:, column.BATTERY] - states.missions[missions, column.CHARGE_START]
        due = self.early[missions, uavs] & (rows[:, column.MUST_CHARGE] > 0) & (reserve <= home)
        steps = zip(STEP_X, STEP_Y, strict=True)
        nearer = np.stack([self.sea.home[y + south, x + east] < home for east, south in steps], 1)
        nearer[:, HOVER] = (home == 0) & (rows[:, column.LATCH] > 0)
        return nearer & due[:, None]

    def _evaluate(self) -> None:
        """Simulate the selection missions; keep the weights with the best moving average."""
        config, network = self.config, self.learner.evaluated
        records = self._selection_missions()
        settled = len(self.scores) == config.window  # before that, the latest weights are selected
        self.scores = [*self.scores, float(records[SELECT_BY].mean())][-config.window :]
        average = float(np.mean(self.scores))
        is_best = not settled or self.best_score is None or average > self.best_score
        if is_best:
            self.best, self.best_score = _weights(network), average
        self.curve.append(self._row(records, average, is_best))
        self.finished, self.losses = [], []

    def _evaluate_early(self) -> None:
        """Evaluate before the first interval is over, so that a new training soon shows a result.

        The present weights are kept until the next evaluation, which replaces them. Nothing else
        changes: the training goes on as if there had been no early evaluation.
        """
        records = self._selection_missions()
        self.best = _weights(self.learner.evaluated)
        self.curve.append(self._row(records, float(records[SELECT_BY].mean()), True))

    def _selection_missions(self) -> np.ndarray:
        """The records of the selection missions under the present policy."""
        network = self.learner.evaluated
        missions, cost = range(self.config.evaluation_missions), 1 if self.phase.battery else 0
        spaces = [ScenarioSpace.of(s, flight_cost=cost) for s in self.config.spaces(True)]
        records = simulate_batch(
            [spaces[mission % len(spaces)] for mission in missions]
            if len(spaces) > 1
            else spaces[0],
            self._as_policy(network),
            self.config.evaluation_seed,
            missions,
        ).missions
        network.train()
        return records

    def _row(self, records: np.ndarray, average: float, is_best: bool) -> dict[str, Any]:
        """A row of the curve: progress, metrics of an evaluation, metrics and losses since."""
        share = (self.tick - self.phase_start) / self.phase.ticks
        row = {
            "tick": self.tick,
            "phase": self.phase.name,
            "uav_slots": self.uav_slots,
            "updates": self.updates,
            "seconds": self.seconds,
            "epsilon": between(self.phase.epsilon, share / self.phase.epsilon_decay),
            "learning_rate": between(self.phase.learning_rate, share),
            "moving_average": average,
            "is_best": is_best,
        }
        row |= {f"evaluation_{name}": float(records[name].mean()) for name in METRICS}
        if self.finished:
            finished = np.concatenate(self.finished)
            row |= {f"training_{name}": float(finished[name].mean()) for name in METRICS}
        for name in self.losses[-1] if self.losses else ():
            row[name] = float(torch.stack([loss[name] for loss in self.losses]).mean())
        return row


def between(ends: tuple[float, float], share: float) -> float:
    """Linear interpolation between the ends, constant beyond a share of 1."""
    return ends[0] + (ends[1] - ends[0]) * min(max(share, 0.0), 1.0)


def _weights(network: nn.Module) -> dict[str, torch.Tensor]:
    """A copy of a network's weights."""
    return {name: value.detach().clone() for name, value in network.state_dict().items()}


@kernel
def _lower_batteries(missions, uavs, residual, environments, draws):
    """Let new missions start as if the UAVs had just returned: with a low battery, and latched.

    The battery is drawn uniformly from 5 % to C_S and is the same for the whole team. The number of
    communications fits the battery that was used, and a random share of the nodes is empty.
    """
    for n in range(len(environments)):
        mission, data = missions[environments[n]], residual[environments[n]]
        span = mission.charge_start - 5 + 1
        battery = min(5 + int(draws[n, 0] * span), mission.charge_start)
        slots_flown = max(mission.flying_time - battery, 0)
        for i in range(mission.uavs):
            u = uavs[environments[n], i]
            u.battery = battery
            u.communications = min(slots_flown * mission.communication_slots, u.quota - 1)
            u.latch = True
        for k in range(mission.nodes):
            if draws[n, 2 + k] < draws[n, 1]:
                mission.initial -= data[k]
                data[k] = 0.0
