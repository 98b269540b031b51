"""The double DQN update (eq. 26-29): Q-target, loss, optimizer step, soft target update."""

import copy
from collections.abc import Mapping
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
