"""Algorithm 1: missions run in parallel, and all UAVs train one network from one replay memory.

A *tick* is one mission slot of all environments, followed by the updates. Missions for training
have the seed ``MISSION_SEED`` + the seed of the training, missions for selecting weights have the
config's ``evaluation_seed``, and missions for evaluations should have any other seed.
"""

import copy
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
from dess.observations.observer import ENCODERS, encoder_of
from dess.observations.sets import Sets
from dess.observations.states import CompactStates, Layout, compact_states, layout_of, masks
from dess.scenario import ScenarioSpace
from dess.sea.chart import FAR, spread
from dess.state import HOVER, STEP_X, STEP_Y
from dess.view import View
from policies.ddqn.config import MISSION_SEED, Phase, TrainingConfig
from policies.ddqn.learner import Learner
from policies.ddqn.network import NARROWEST, DuelingNetwork, NodeNetwork, PaperNetwork, SetNetwork
from policies.ddqn.policy import DDQN
from policies.ddqn.replay import Batch, ReplayMemory
from policies.ddqn.tensors import require_forms
from policies.planner import LongPlanner, Planner, ShortPlanner

METRICS = ("success", "collection_ratio", "collection_ratio_and_communication", "reward")
MISSIONS_PER_PHASE = 2**28
SELECT_BY = "collection_ratio_and_communication"
# The data of the paper's nodes at the start [data units], as much as all data of a sea count where
# there are several seas.
DATA = 312.5
STRETCH = 64  # ticks for which the missions of some seas fly, before those of the next seas do
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
            f"observation: a grid of {layout.grid} is too small for maps; allowed: vector, nodes"
        )
    observation = ENCODERS[config.observation](layout)
    if config.observation == "maps":
        return observation, PaperNetwork(observation.shapes, precision)
    if config.observation == "nodes":
        return observation, NodeNetwork(observation.shapes, config.hidden, precision)
    return observation, DuelingNetwork(observation.shapes[0][0], config.hidden, precision)


TEACHERS = {kind.name: kind for kind in (Planner, LongPlanner, ShortPlanner)}


class Waters:
    """The missions of a training on one sea.

    Attributes:
        space: The scenario that they are drawn from, in the present phase.
        observation: The encoder of their states.
        stepper: The missions in progress.
        early: (N, I) which UAVs return early.
        replay: What has happened in them.
        home: (H + 2, W + 2) cells to the nearest zone, with a border around the grid.
    """

    def __init__(self, training: "Training", space: ScenarioSpace, observation: Any):
        config, phase = training.config, training.phase
        fleet, nodes = space.uavs[1], len(space.nodes)
        rewards = {}
        if config.observation == "sets":  # what is collected counts as a share of all data
            full = max(nodes * sum(space.initial_data) / 2, 1.0)
            rewards = {"reward_data": space.reward_data * DATA / full}
        cost = 1 if phase.battery else 0
        self.space = ScenarioSpace.of(space, flight_cost=cost, **rewards)
        self.observation = observation
        self.stepper = MissionStepper(self.space, config.num_envs, MISSION_SEED + config.seed)
        self.stepper.start_at(self.stepper.seed, training.phase_index * MISSIONS_PER_PHASE)
        self.early = np.zeros((config.num_envs, fleet), bool)
        self.replay = ReplayMemory(
            config.replay, config.num_envs, fleet, nodes, imitates=bool(phase.imitates)
        )
        zones = space.chart.zones
        home = spread(zones, space.chart.parking)[0].reshape(zones.shape)
        self.home = np.pad(home, 1, constant_values=FAR)


class Training:
    """A training in progress, from its first tick to its last.

    Attributes:
        config: The settings of the training.
        learner: The networks and the optimizer.
        seas: The missions on each sea.
        sea: Those that are simulated at present.
        tick: Number of ticks done, over all phases.
        curve: One row per evaluation: progress, metrics and losses.
    """

    def __init__(self, config: TrainingConfig, device: torch.device):
        self.config, self.device = config, device
        self.generator = np.random.default_rng(config.seed)
        torch.manual_seed(config.seed)
        self.spaces = config.spaces()
        self.space = self.spaces[0]
        self.layout = None if config.observation == "sets" else layout_of(self.space)
        self.observation, network = build(config, self.layout)
        self.learner = Learner(network, self.observation, config, device)
        self.tick = self.updates = self.uav_slots = 0
        self.seconds = 0.0
        self.curve: list[dict[str, Any]] = []
        self.best = _weights(network)
        self.finished: list[np.ndarray] = []
        self.losses: list[dict[str, torch.Tensor]] = []
        self._enter_phase(0)

    @property
    def phase(self) -> Phase:
        """The phase to which the next tick belongs."""
        return self.config.phases[self.phase_index]

    @property
    def phase_space(self) -> ScenarioSpace:
        """The scenario of the present missions."""
        return self.sea.space

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
        """Run one tick: a slot of all environments, the updates and, if due, an evaluation."""
        share = (self.tick - self.phase_start) / self.phase.ticks
        epsilon = _between(self.phase.epsilon, share / self.phase.epsilon_decay)
        begins_random = self.tick == 0 and self.config.observation != "sets"
        for self.sea in [sea for sea in self.seas if sea.replay.count == 0]:  # noqa: B020
            for _ in range(self.config.learning_starts):
                self._collect(1.0 if begins_random else epsilon)
        for self.sea in self._due(self.tick - self.phase_start):  # noqa: B020
            self._collect(epsilon)
        for _ in range(self.config.updates):
            rate = _between(self.phase.learning_rate, share)
            self.learner.anchor_weight = _between(
                self.config.anchor, share / self.phase.epsilon_decay
            )
            first, *others = self._samples()
            self.losses.append(self.learner.update(first, rate, *others))
            self.updates += 1
        self.tick += 1
        over = self.tick - self.phase_start == self.phase.ticks
        if over or self.tick % self.config.evaluate_every == 0:
            self._evaluate()
        elif self.tick == max(self.config.evaluate_every // EARLY, 1):
            self._evaluate_early()
        if over and not self.done:
            for network in (self.learner.online, self.learner.target, self.learner.average):
                if network is not None:
                    network.load_state_dict(self.best)
            self._enter_phase(self.phase_index + 1)

    def _due(self, tick: int) -> list[Waters]:
        """The seas whose missions fly in a tick of the phase: some for a while, then the next."""
        first = tick // STRETCH * self.config.seas_per_tick
        order = range(first, first + self.config.seas_per_tick)
        return [self.seas[number % len(self.seas)] for number in order]

    def simulated(self, ticks: int) -> list[int]:
        """The slots of each sea that are simulated in the first ticks of a phase."""
        seas, each = len(self.seas), self.config.seas_per_tick
        turns, last = divmod(ticks, STRETCH)
        counts = [STRETCH * ((turns * each - number + seas - 1) // seas) for number in range(seas)]
        for number in range(turns * each, (turns + 1) * each):
            counts[number % seas] += last
        return counts

    def _samples(self) -> list[Batch]:
        """The parts of a minibatch, each of one sea."""
        config = self.config
        chosen = self.seas
        if len(chosen) > 1:
            picks = self.generator.integers(0, len(chosen), config.seas_per_tick)
            chosen = [self.seas[pick] for pick in picks]
        each = config.batch // len(chosen)
        draw = each, config.n_step, config.discount, self.generator
        return [sea.replay.sample(*draw)._replace(observation=sea.observation) for sea in chosen]

    def policy(self, weights: dict[str, torch.Tensor]) -> DDQN:
        """A policy with these weights."""
        _, network = build(self.config, self.layout)
        network.load_state_dict(weights)
        return self._as_policy(network)

    def _as_policy(self, network: nn.Module) -> DDQN:
        config = self.config
        return DDQN(config.name, self.observation, network, config.guard, self.layout)

    def begin_with(self, weights: Mapping[str, torch.Tensor]) -> None:
        """Begin with the weights of another training.

        Raises:
            InputError: If they are not those of such a network.
        """
        learner = self.learner
        require_forms(weights, learner.online.state_dict(), "from")
        for network in (learner.online, learner.target, learner.average, learner.anchor):
            if network is not None:
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
        self.teacher = TEACHERS[self.phase.imitates]() if self.phase.imitates else None
        self.seas: list[Waters] = []
        for space in self.spaces:
            encoder = self.observation if self.layout else encoder_of("sets", space)
            self.sea = Waters(self, space, encoder)
            self.seas.append(self.sea)
            self._launch(self.stepper.indices)
        self.learner.restart()
        self.learner.anchor = None
        if max(self.config.anchor) > 0.0 and not self.teacher:
            self.learner.anchor = copy.deepcopy(self.learner.target)
            self.learner.anchor.load_state_dict(self.learner.online.state_dict())
        self.scores: list[float] = []
        self.best_score: float | None = None

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
        planned = [actions.copy()] if self.teacher else []
        if len(missions) and self.teacher:
            view = View(state, self.stepper.world, missions, uavs)
            planned[0][missions, uavs] = shown = self.teacher.act(view)
            own = self._explore(states, missions, uavs, 0.0)
            is_own = self.generator.random(len(own)) < epsilon
            actions[missions, uavs] = np.where(is_own, own, shown)
        elif len(missions):
            actions[missions, uavs] = self._explore(states, missions, uavs, epsilon)
        outcome = self.stepper.step(actions)
        self.replay.add(
            states, actions, outcome["reward"], *planned,
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
            learner.observation = self.sea.observation
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
        missions, cost = range(self.config.evaluation_missions), self.phase_space.flight_cost
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
            "epsilon": _between(self.phase.epsilon, share / self.phase.epsilon_decay),
            "learning_rate": _between(self.phase.learning_rate, share),
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


def _between(ends: tuple[float, float], share: float) -> float:
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
