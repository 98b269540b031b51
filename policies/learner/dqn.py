"""Double DQN: Algorithm 1, the replay memory, shared by all UAVs, and the update (eq. 26-29).

Missions run in parallel, and all UAVs train one network from one replay memory. A *tick* is one
mission slot of all environments, followed by the updates.
"""

import copy
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from dess.base.errors import InputError
from dess.base.kernels import kernel
from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates, empty_states, masks
from dess.envs.stepper import MissionStepper
from dess.model.state import HOVER, STEP_X, STEP_Y
from dess.physics.chart import FAR, spread
from dess.policies.learner import training
from dess.policies.learner.config import MISSION_SEED, TrainingConfig


class Batch(NamedTuple):
    """A minibatch of B n-step transitions.

    Attributes:
        state: The compact states of the memory.
        rows: (B,) indices in ``state`` of the states in which the UAVs acted.
        later: (B,) indices in ``state`` of the states after n slots, or at the end of the UAV's
            mission.
        uav: (B,) index of the UAV.
        action: (B,) action of the UAV.
        reward: (B,) float32, discounted sum of the UAV's rewards until the later state.
        discount: (B,) float32, factor of the later state's value; 0 if the UAV terminated.
    """

    state: CompactStates
    rows: np.ndarray
    later: np.ndarray
    uav: np.ndarray
    action: np.ndarray
    reward: np.ndarray
    discount: np.ndarray


class ReplayMemory:
    """A ring buffer of the last T slots of N environments.

    Attributes:
        capacity: T [mission slots per environment].
        count: Number of slots added so far; the last ``capacity`` of them are stored.
        arrays: The arrays of the memory, by name.
    """

    def __init__(self, capacity: int, num_envs: int, uavs: int, nodes: int):
        self.capacity = capacity
        self.num_envs = num_envs
        self.uavs = uavs
        self.count = 0
        self._states = empty_states(capacity * num_envs, uavs, nodes)
        kinds: dict[str, type] = {"action": np.int8, "reward": np.float32}
        kinds |= dict.fromkeys(("acted", "terminated", "truncated"), np.bool_)
        shape = (capacity * num_envs, uavs)
        outcomes: dict[str, Any] = {name: np.zeros(shape, kind) for name, kind in kinds.items()}
        self.arrays = self._states._asdict() | outcomes

    @staticmethod
    def count_bytes(capacity: int, num_envs: int, uavs: int, nodes: int) -> int:
        """The size of such a memory [bytes]."""
        smallest = ReplayMemory(1, 1, uavs, nodes)
        return capacity * num_envs * sum(array.nbytes for array in smallest.arrays.values())

    def add_slot(self, states: CompactStates, *outcome: np.ndarray) -> None:
        """Add one slot of all environments.

        Args:
            states: The states before the slot.
            *outcome: (N, I) arrays: actions, rewards, and which UAVs acted, terminated and were
                truncated.
        """
        first = self.count % self.capacity * self.num_envs
        rows = slice(first, first + self.num_envs)
        with np.errstate(over="ignore"):  # an infinite reward ends the training with a message
            for ring, new in zip(self.arrays.values(), (*states, *outcome), strict=True):
                ring[rows] = new
        self.count += 1

    def draw_batch(
        self, size: int, n_step: int, discount: float, generator: np.random.Generator
    ) -> Batch:
        """Draw transitions uniformly, with replacement, among those whose later state is stored.

        The last slot of a truncated mission is excluded.

        Args:
            size: Number of transitions (B).
            n_step: n of the n-step return.
            discount: Discount factor gamma per slot.
            generator: Random generator of the draw.

        Raises:
            InputError: If fewer than ``n_step + 1`` slots have been added, or hardly any of them
                holds a transition.
        """
        newest = self.count - 1
        oldest = max(0, self.count - self.capacity)
        if newest - oldest < n_step:
            raise InputError(
                "replay",
                f"{self.count} slots in memory are too few for {n_step}-step returns",
                "more than n_step",
            )
        rows: list[np.ndarray] = []
        uavs: list[np.ndarray] = []
        missing = size
        while missing > 0:
            slot = generator.integers(oldest, newest - n_step + 1, 2 * missing + 16)
            row = slot % self.capacity * self.num_envs + generator.integers(
                0, self.num_envs, len(slot)
            )
            uav = generator.integers(0, self.uavs, len(slot))
            good = self.arrays["acted"][row, uav] & ~self.arrays["truncated"][row, uav]
            keep = np.nonzero(good)[0][:missing]
            if not len(keep) and len(rows) > 1000:
                raise InputError(
                    "replay",
                    "hardly any slot of the memory has a transition",
                    "a scenario whose missions last more than a slot",
                )
            rows.append(row[keep])
            uavs.append(uav[keep])
            missing -= len(keep)
        row = np.concatenate(rows)
        uav = np.concatenate(uavs)
        later = np.empty(size, np.int64)
        reward = np.empty(size, np.float32)
        factor = np.empty(size, np.float32)
        stored = (self.arrays[name] for name in ("reward", "terminated", "truncated"))
        _compute_returns(row, uav, n_step, discount, self.num_envs, *stored, later, reward, factor)
        action = self.arrays["action"][row, uav].astype(np.int64)
        return Batch(self._states, row, later, uav, action, reward, factor)


@kernel
def _compute_returns(
    rows, uavs, n_step, discount, num_envs, rewards, terminated, truncated, later, total, factor
):
    """Compute n-step returns, which end when the UAV's mission ends.

    Truncation does not count as termination: the return then ends before the truncated slot, with
    the value of the last state in which the UAV chose an action.
    """
    size = len(rewards)
    for b in range(len(rows)):
        row = rows[b]
        i = uavs[b]
        value, weight = 0.0, 1.0
        for _ in range(n_step):
            if truncated[row, i] or weight == 0.0:
                break
            value += weight * rewards[row, i]
            weight = 0.0 if terminated[row, i] else weight * discount
            row = (row + num_envs) % size
        later[b] = row
        total[b] = value
        factor[b] = weight


def double_dqn_target(
    reward: torch.Tensor,
    discount: torch.Tensor,
    online: torch.Tensor,
    target: torch.Tensor,
    allowed: torch.Tensor,
) -> torch.Tensor:
    """The Q-target (eq. 29) with masked actions and n-step returns.

    Args:
        reward: (B,) discounted sum of the rewards until the later state.
        discount: (B,) factor of the later state's value; 0 after termination.
        online: (B, A) Q-values of the later state by the online network; they select the action.
        target: (B, A) Q-values by the target network; they give the value of that action.
        allowed: (B, A) mask of the actions allowed in the later state.

    Returns:
        (B,) target values.
    """
    choice = online.masked_fill(~allowed, -torch.inf).argmax(1, keepdim=True)
    return reward + discount * target.gather(1, choice).squeeze(1)


class DQNLearner(training.Learner):
    """The networks of double DQN, and the optimizer Adam.

    Attributes:
        target: The target network, whose weights follow those of ``online`` slowly.
    """

    def __init__(
        self, network: nn.Module, observation: Any, config: TrainingConfig, device: torch.device
    ):
        self.observation = observation
        self.target = copy.deepcopy(network).requires_grad_(False)
        average = None
        if config.average_rate < 1.0:
            average = copy.deepcopy(self.target)
        super().__init__(config, device, online=network, target=self.target, average=average)

    def action_values(
        self, network: nn.Module, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> torch.Tensor:
        """The (R, 5) action values of UAV ``uavs[r]`` in state ``missions[r]``."""
        parts = self.observation.encode(states, missions, uavs)
        return network(*map(self.to_tensor, parts))

    def update_networks(self, batch: Batch, learning_rate: float) -> dict[str, torch.Tensor]:
        """Make one gradient step on a minibatch; return loss, mean Q-value and gradient norm.

        Args:
            batch: The minibatch.
            learning_rate: Of the step.

        Raises:
            DivergenceError: If one of them is not finite; the weights are then as before.
        """
        loss, chosen = self.compute_loss(batch)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        norm = nn.utils.clip_grad_norm_(self.online.parameters(), self.config.gradient_norm)
        done = {"loss": loss.detach(), "value": chosen.detach().mean(), "gradient_norm": norm}
        training.check_finite(done)
        self.step(learning_rate)
        training.soft_update(self.target, self.online, self.config.target_rate)
        return done

    def compute_loss(self, batch: Batch) -> tuple[torch.Tensor, torch.Tensor]:
        """The loss of the TD error on a minibatch, and the (B,) values of the actions in it."""
        values = self.action_values(self.online, batch.state, batch.rows, batch.uav)
        with torch.no_grad():
            parts = self.observation.encode(batch.state, batch.later, batch.uav)
            later = [*map(self.to_tensor, parts)]
            q_target = double_dqn_target(
                self.to_tensor(batch.reward) * self.config.reward_scale,
                self.to_tensor(batch.discount),
                self.online(*later),
                self.target(*later),
                self.to_tensor(masks(batch.state, batch.later, batch.uav)),
            )
        chosen = values.gather(1, self.to_tensor(batch.action)[:, None]).squeeze(1)
        return _LOSSES[self.config.loss](chosen, q_target), chosen


_LOSSES = {"huber": nn.functional.smooth_l1_loss, "mse": nn.functional.mse_loss}


class DQNTraining(training.Training):
    """A training by double DQN in progress.

    Attributes:
        stepper: The missions in progress.
        early: (N, I) which UAVs return early.
        replay: What has happened in the missions of the present phase.
        home: (H + 2, W + 2) cells to the nearest zone, with a border around the grid.
    """

    learner: DQNLearner

    def _make_learner(self, network: nn.Module) -> DQNLearner:
        return DQNLearner(network, self.observation, self.config, self.device)

    def _begin_missions(self) -> None:
        config = self.config
        fleet = self.space.uavs[1]
        zones = self.space.chart.zones
        seed = MISSION_SEED + config.seed
        self.stepper = MissionStepper(self._in_phase(self.space), config.num_envs, seed)
        self.stepper.start_at(seed, self.phase_index * training.MISSIONS_PER_PHASE)
        self.early = np.zeros((config.num_envs, fleet), bool)
        self.replay = ReplayMemory(config.replay, config.num_envs, fleet, len(self.space.nodes))
        home = spread(zones, self.space.chart.parking)[0].reshape(zones.shape)
        self.home = np.pad(home, 1, constant_values=FAR)
        self._launch_missions(self.stepper.indices)

    def _learn_in_tick(self, share: float) -> None:
        config = self.config
        epsilon = training.interpolate_ends(self.phase.epsilon, share / self.phase.epsilon_decay)
        if self.replay.count == 0:
            for _ in range(config.learning_starts):
                self._collect_slot(1.0 if self.tick == 0 else epsilon)
        self._collect_slot(epsilon)
        rate = training.interpolate_ends(self.phase.learning_rate, share)
        for _ in range(config.updates):
            batch = self.replay.draw_batch(
                config.batch, config.n_step, config.discount, self.generator
            )
            self.losses.append(self.learner.update_networks(batch, rate))
            self.updates += 1

    def _launch_missions(self, environments: np.ndarray) -> None:
        """Start new missions, some of them with a low battery; draw which UAVs return early."""
        self.stepper.launch(environments)
        draws = self.generator.random((len(environments), self.early.shape[1]))
        self.early[environments] = draws < self.config.early_returns
        if self.config.low_battery_starts > 0 and len(environments):
            low = environments[
                self.generator.random(len(environments)) < self.config.low_battery_starts
            ]
            draws = self.generator.random((len(low), 2 + len(self.space.nodes)))
            state = self.stepper.state
            _lower_batteries(state.missions, state.uavs, state.residual, low, draws)

    def _collect_slot(self, epsilon: float) -> None:
        """Run one slot of all environments with the exploring policy, and store it."""
        state = self.stepper.state
        over = np.nonzero(state.missions["active"] == 0)[0]
        states, missions, uavs = training.find_acting_uavs(self.stepper, self.config.guard)
        actions = np.full(state.uavs.shape, HOVER)
        if len(missions):
            actions[missions, uavs] = self._choose_exploring(states, missions, uavs, epsilon)
        outcome = self.stepper.step(actions)
        self.replay.add_slot(
            states, actions, outcome["reward"],
            *(outcome[n] for n in ("acted", "terminated", "truncated")),
        )  # fmt: skip
        self.uav_slots += int(outcome["acted"].sum())
        ended = training.find_ended_missions(self.stepper, outcome)
        if len(ended):
            self.finished.append(self.stepper.records(ended).missions)
        self._launch_missions(over)

    def _choose_exploring(
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
            values = learner.action_values(learner.online, states, missions, uavs).cpu().numpy()
        if self.phase.temperature > 0.0:  # Gumbel noise samples from the softmax
            values = values / self.phase.temperature - np.log(-np.log(noise))
        choice = np.where(allowed, values, -np.inf).argmax(1)
        if self.config.early_returns > 0.0:
            homeward = allowed & self._find_homeward_actions(states, missions, uavs)
            choice = np.where(homeward.any(1), np.where(homeward, noise, -1.0).argmax(1), choice)
        return np.where(self.generator.random(len(choice)) < epsilon, random, choice)

    def _find_homeward_actions(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> np.ndarray:
        """The (R, 5) mask of the actions of UAVs that return early, to arrive with C_S left.

        The actions lead nearer to the zone; in the zone, a latched UAV hovers.
        """
        rows = states.uavs[missions, uavs]
        # the table has a border
        x = rows[:, column.X] + 1
        y = rows[:, column.Y] + 1
        home = self.home[y, x]
        reserve = rows[:, column.BATTERY] - states.missions[missions, column.CHARGE_START]
        due = self.early[missions, uavs] & (rows[:, column.MUST_CHARGE] > 0) & (reserve <= home)
        steps = zip(STEP_X, STEP_Y, strict=True)
        nearer = np.stack([self.home[y + south, x + east] < home for east, south in steps], 1)
        nearer[:, HOVER] = (home == 0) & (rows[:, column.LATCH] > 0)
        return nearer & due[:, None]


@kernel
def _lower_batteries(missions, uavs, residual, environments, draws):
    """Let new missions start as if the UAVs had just returned: with a low battery, and latched.

    The battery is drawn uniformly from 5 % to C_S and is the same for the whole team. The number of
    communications fits the battery that was used, and a random share of the nodes is empty.
    """
    for n in range(len(environments)):
        mission = missions[environments[n]]
        data = residual[environments[n]]
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
