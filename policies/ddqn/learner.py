"""The double DQN update (eq. 26-29): Q-target, loss, optimizer step, soft target update."""

import copy
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import torch
from torch import nn

from dess.observations.states import CompactStates, masks
from policies.ddqn.config import TrainingConfig
from policies.ddqn.replay import Batch


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
        anchor: The network whose decisions are to be kept, with the weight of that loss; or None.
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
        self.anchor: nn.Module | None = None
        self.anchor_weight = 0.0
        self.restart()

    def restart(self) -> None:
        """Reset the optimizer."""
        self.optimizer = torch.optim.Adam(self.online.parameters(), fused=True)

    @property
    def evaluated(self) -> nn.Module:
        """The network that is evaluated: ``average`` or, without one, ``online``."""
        return self.online if self.average is None else self.average

    def values(
        self, network: nn.Module, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> torch.Tensor:
        """The (R, 5) action values of UAV ``uavs[r]`` in state ``missions[r]``."""
        parts = self.observation.encode(states, missions, uavs)
        return network(*self._together([parts]))

    def update(self, batch: Batch, learning_rate: float, *others: Batch) -> dict[str, torch.Tensor]:
        """Make one gradient step on a minibatch; return loss, mean Q-value and gradient norm.

        Args:
            batch: The minibatch.
            learning_rate: Of the step.
            *others: Parts of the minibatch on other seas.

        Raises:
            DivergenceError: If one of them is not finite; the weights are then as before.
        """
        settings = self.settings
        loss, chosen = self.loss(batch, *others)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        norm = nn.utils.clip_grad_norm_(self.online.parameters(), settings.gradient_norm)
        done = {"loss": loss.detach(), "value": chosen.detach().mean(), "gradient_norm": norm}
        for name, value in done.items():
            if not torch.isfinite(value):
                raise DivergenceError(
                    f"the training diverged: its {name} is {float(value)}; the best policy so far "
                    "is kept; allowed: a smaller learning_rate, reward_scale or reward"
                )
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate
        self.optimizer.step()
        soft_update(self.target, self.online, settings.target_rate)
        if self.average is not None:
            soft_update(self.average, self.online, settings.average_rate)
        return done

    def loss(self, *batches: Batch) -> tuple[torch.Tensor, torch.Tensor]:
        """The loss of the TD error on minibatches, and the (B,) values of the actions in them.

        Where a policy is imitated, the loss is how unlikely its actions are if values are taken for
        logits. The TD error of a quarter of the minibatches is added: so values have the right size
        when the next phase begins. An anchor is imitated likewise, with its weight.
        """
        settings = self.settings
        now = self._observe((b.observation, b.state, b.rows, b.uav) for b in batches)
        values = self.online(*now)
        imitation = torch.zeros((), device=self.device)
        if batches[0].planned is not None:
            planned = self._joined([b.planned for b in batches if b.planned is not None]).long()
            imitation = nn.functional.cross_entropy(self._logits(values, batches), planned)
            batches = batches[: max(len(batches) // 4, 1)]
        elif self.anchor is not None:
            with torch.no_grad():
                wanted = torch.softmax(self._logits(self.anchor(*now), batches), 1)
            imitation = nn.functional.cross_entropy(self._logits(values, batches), wanted)
            imitation = imitation * self.anchor_weight
        allowed = self._joined([masks(b.state, b.later, b.uav) for b in batches])
        reward = self._joined([b.reward for b in batches]) * settings.reward_scale
        discount = self._joined([b.discount for b in batches])
        action = self._joined([b.action for b in batches])
        with torch.no_grad():
            later = self._observe((b.observation, b.state, b.later, b.uav) for b in batches)
            q_target = double_dqn_target(
                reward, discount, self.online(*later), self.target(*later), allowed
            )
        chosen = values[: len(action)].gather(1, action[:, None]).squeeze(1)
        return _LOSSES[settings.loss](chosen, q_target) + imitation, chosen

    def _logits(self, values: torch.Tensor, batches: Sequence[Batch]) -> torch.Tensor:
        """Values as logits of the allowed actions."""
        allowed = self._joined([masks(b.state, b.rows, b.uav) for b in batches])
        return (values / self.settings.imitation_temperature).masked_fill(~allowed, -1e9)

    def _observe(
        self, rows: Iterable[tuple[Any, CompactStates, np.ndarray, np.ndarray]]
    ) -> list[torch.Tensor]:
        """Observations on the device, of an encoder (None for that of the learner) and states."""
        encoded = [(encoder or self.observation).encode(*states) for encoder, *states in rows]
        return self._together(encoded)

    def _together(self, encoded: Sequence[tuple[np.ndarray, ...]]) -> list[torch.Tensor]:
        """Observations on several seas, one after the other; sets are filled up with zeros."""
        return [self._joined(_filled(parts)) for parts in zip(*encoded, strict=True)]

    def _joined(self, arrays: Sequence[np.ndarray]) -> torch.Tensor:
        return torch.from_numpy(np.concatenate(arrays)).to(self.device)


def _filled(arrays: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Arrays with zeros at the end of those axes, but for the first, that are longer in others."""
    longest = np.max([array.shape for array in arrays], 0)[1:]
    return [
        np.pad(array, [(0, 0), *((0, n) for n in longest - array.shape[1:])])
        if (longest > array.shape[1:]).any()
        else array
        for array in arrays
    ]


_LOSSES = {"huber": nn.functional.smooth_l1_loss, "mse": nn.functional.mse_loss}
