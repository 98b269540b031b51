"""The double DQN update: eq. 28 and 29 by hand, and what a step does to loss and weights."""

from typing import Any

import pytest
import torch
from torch import nn

from dess.envs.observations.states import masks
from dess.policies.learner.dqn import Batch, DQNLearner, DQNTraining
from tests.policies.learner.tiny import CPU, PHASES, tiny

LOSSES = {"mse": lambda e: e**2, "huber": lambda e: e**2 / 2 if e < 1 else e - 0.5}


def _learner(**changes: Any) -> tuple[DQNLearner, Batch]:
    """A new learner, and a batch of what a tiny training has seen."""
    flown = tiny(learning_starts=300, replay=300, phases=PHASES[1:])  # some missions end
    training = DQNTraining(flown, CPU)
    training.run_ticks(1)
    batch = training.replay.draw_batch(1000, flown.n_step, flown.discount, training.generator)
    config = tiny(**changes)
    network = DQNTraining(config, CPU).learner.online
    return DQNLearner(network, training.observation, config, CPU), batch


def _values(network: nn.Module) -> list[torch.Tensor]:
    return [parameter.detach().clone() for parameter in network.parameters()]


@pytest.mark.parametrize("loss", ["huber", "mse"])
def test_the_loss_is_that_of_the_differences_to_the_target(loss):
    learner, batch = _learner(loss=loss, reward_scale=0.5)
    assert 0 < (batch.discount == 0).mean() < 0.5
    learner.target.load_state_dict(DQNTraining(tiny(seed=9), CPU).learner.online.state_dict())
    with torch.no_grad():
        values = learner.action_values(learner.online, batch.state, batch.rows, batch.uav)
        later = learner.action_values(learner.online, batch.state, batch.later, batch.uav)
        judged = learner.action_values(learner.target, batch.state, batch.later, batch.uav)
    allowed = masks(batch.state, batch.later, batch.uav)
    expected, chosen = 0.0, 0.0
    for b, action in enumerate(batch.action):
        best = max((a for a in range(5) if allowed[b, a]), key=lambda a: later[b, a])
        goal = 0.5 * batch.reward[b] + batch.discount[b] * float(judged[b, best])
        value = float(values[b, action])
        error = abs(value - goal)
        expected += LOSSES[loss](error)
        chosen += value
    update = learner.update_networks(batch, 1e-3)
    assert float(update["loss"]) == pytest.approx(expected / len(batch.action), rel=1e-4)
    assert float(update["value"]) == pytest.approx(chosen / len(batch.action), rel=1e-4)


def test_after_a_step_the_copies_have_moved_by_their_rates():
    learner, batch = _learner(target_rate=0.25, average_rate=0.5)
    assert learner.average is not None
    assert learner.evaluated is learner.average
    for copy in (learner.target, learner.average):
        assert not any(parameter.requires_grad for parameter in copy.parameters())
    before = _values(learner.online)
    learner.update_networks(batch, 1e-2)
    after = _values(learner.online)
    assert any((a != b).any() for a, b in zip(after, before, strict=True))
    for copy, rate in ((learner.target, 0.25), (learner.average, 0.5)):
        for parameter, old, new in zip(_values(copy), before, after, strict=True):
            torch.testing.assert_close(parameter, old + rate * (new - old))


def test_without_a_slow_copy_the_online_network_is_evaluated():
    learner, _ = _learner(average_rate=1.0)
    assert learner.average is None
    assert learner.evaluated is learner.online


def test_gradients_are_clipped():
    learner, batch = _learner(gradient_norm=0.01, reward_scale=1.0)
    norm = float(learner.update_networks(batch, 1e-3)["gradient_norm"])
    gradients = [p.grad for p in learner.online.parameters() if p.grad is not None]
    clipped = float(torch.cat([gradient.flatten() for gradient in gradients]).norm())
    assert norm > 0.01
    assert clipped == pytest.approx(0.01, rel=1e-3)
