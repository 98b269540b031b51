"""Double DQN: the replay memory, shared by all UAVs, and the update (eq. 26-29)."""

import copy
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from dess.code.kernels import kernel
from dess.errors import InputError
from dess.observations.states import CompactStates, empty_states, masks
from policies.learner.config import TrainingConfig


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
        self.capacity, self.num_envs, self.uavs = capacity, num_envs, uavs
        self.count = 0
        self._states = empty_states(capacity * num_envs, uavs, nodes)
        kinds: dict[str, type] = {"action": np.int8, "reward": np.float32}
        kinds |= dict.fromkeys(("acted", "terminated", "truncated"), np.bool_)
        shape = (capacity * num_envs, uavs)
        outcomes: dict[str, Any] = {name: np.zeros(shape, kind) for name, kind in kinds.items()}
        self.arrays = self._states._asdict() | outcomes

    @staticmethod
    def bytes_for(capacity: int, num_envs: int, uavs: int, nodes: int) -> int:
        """The size of such a memory [bytes]."""
        one = ReplayMemory(1, 1, uavs, nodes)
        return capacity * num_envs * sum(array.nbytes for array in one.arrays.values())

    def add(self, states: CompactStates, *outcome: np.ndarray) -> None:
        """Add one slot of all environments.

        Args:
            states: The states before the slot.
            *outcome: (N, I) arrays: actions, rewards, and which UAVs acted, terminated and were
                truncated.
        """
        first = self.count % self.capacity * self.num_envs
        here = slice(first, first + self.num_envs)
        with np.errstate(over="ignore"):  # an infinite reward ends the training with a message
            for ring, new in zip(self.arrays.values(), (*states, *outcome), strict=True):
                ring[here] = new
        self.count += 1

    def sample(
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
                f"replay: {self.count} slots in memory are too few for {n_step}-step returns; "
                "allowed: more than n_step"
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
                    "replay: hardly any slot of the memory has a transition; allowed: a scenario "
                    "whose missions last more than a slot"
                )
            rows.append(row[keep])
            uavs.append(uav[keep])
            missing -= len(keep)
        row, uav = np.concatenate(rows), np.concatenate(uavs)
        later, reward = np.empty(size, np.int64), np.empty(size, np.float32)
        factor = np.empty(size, np.float32)
        known = (self.arrays[name] for name in ("reward", "terminated", "truncated"))
        _returns(row, uav, n_step, discount, self.num_envs, *known, later, reward, factor)
        action = self.arrays["action"][row, uav].astype(np.int64)
        return Batch(self._states, row, later, uav, action, reward, factor)


@kernel
def _returns(
    rows, uavs, n_step, discount, num_envs, rewards, terminated, truncated, later, total, factor
):
    """Compute n-step returns, which end when the UAV's mission ends.

    Truncation does not count as termination: the return then ends before the truncated slot, with
    the value of the last state in which the UAV chose an action.
    """
    size = len(rewards)
    for b in range(len(rows)):
        row, i = rows[b], uavs[b]
        value, weight = 0.0, 1.0
        for _ in range(n_step):
            if truncated[row, i] or weight == 0.0:
                break
            value += weight * rewards[row, i]
            weight = 0.0 if terminated[row, i] else weight * discount
            row = (row + num_envs) % size
        later[b], total[b], factor[b] = row, value, weight


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


class Learner:
    """The networks and the optimizer of a training.

    Attributes:
        online: The network that is trained.
        target: The target network, whose weights follow those of ``online`` slowly.
        average: A copy that follows still more slowly, and that is evaluated and saved; None if
            ``average_rate`` is 1.
        optimizer: The optimizer Adam.
        device: The device on which all of them are.
    """

    def __init__(
        self, network: nn.Module, observation: Any, settings: TrainingConfig, device: torch.device
    ):
        self.online = network.to(device)
        self.target = copy.deepcopy(self.online).requires_grad_(False)
        self.average = copy.deepcopy(self.target) if settings.average_rate < 1.0 else None
        self.observation, self.settings, self.device = observation, settings, device
        self.restart()

    def restart(self) -> None:
        """Reset the optimizer."""
        self.optimizer = torch.optim.Adam(self.online.parameters(), fused=True)

    def networks(self) -> dict[str, nn.Module]:
        """The networks, by name."""
        found = {"online": self.online, "target": self.target}
        return found if self.average is None else found | {"average": self.average}

    def optimizers(self) -> dict[str, torch.optim.Optimizer]:
        """The optimizers, each by the name under which a checkpoint has it."""
        return {"optimizer": self.optimizer}

    def waits(self, optimizer: str) -> int:
        """The ticks of a phase before an optimizer makes its first step."""
        return 0

    @property
    def evaluated(self) -> nn.Module:
        """The network that is evaluated: ``average`` or, without one, ``online``."""
        return self.online if self.average is None else self.average

    def values(
        self, network: nn.Module, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> torch.Tensor:
        """The (R, 5) action values of UAV ``uavs[r]`` in state ``missions[r]``."""
        parts = self.observation.encode(states, missions, uavs)
        return network(*map(self._tensor, parts))

    def update(self, batch: Batch, learning_rate: float) -> dict[str, torch.Tensor]:
        """Make one gradient step on a minibatch; return loss, mean Q-value and gradient norm.

        Args:
            batch: The minibatch.
            learning_rate: Of the step.

        Raises:
            DivergenceError: If one of them is not finite; the weights are then as before.
        """
        settings = self.settings
        loss, chosen = self.loss(batch)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        norm = nn.utils.clip_grad_norm_(self.online.parameters(), settings.gradient_norm)
        done = {"loss": loss.detach(), "value": chosen.detach().mean(), "gradient_norm": norm}
        check_finite(done)
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate
        self.optimizer.step()
        soft_update(self.target, self.online, settings.target_rate)
        if self.average is not None:
            soft_update(self.average, self.online, settings.average_rate)
        return done

    def loss(self, batch: Batch) -> tuple[torch.Tensor, torch.Tensor]:
        """The loss of the TD error on a minibatch, and the (B,) values of the actions in it."""
        settings = self.settings
        values = self.values(self.online, batch.state, batch.rows, batch.uav)
        allowed = self._tensor(masks(batch.state, batch.later, batch.uav))
        with torch.no_grad():
            later = [
                *map(self._tensor, self.observation.encode(batch.state, batch.later, batch.uav))
            ]
            q_target = double_dqn_target(
                self._tensor(batch.reward) * settings.reward_scale,
                self._tensor(batch.discount),
                self.online(*later),
                self.target(*later),
                allowed,
            )
        chosen = values.gather(1, self._tensor(batch.action)[:, None]).squeeze(1)
        return _LOSSES[settings.loss](chosen, q_target), chosen

    def _tensor(self, array: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(array).to(self.device)


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


_LOSSES = {"huber": nn.functional.smooth_l1_loss, "mse": nn.functional.mse_loss}
