"""Proximal policy optimization: advantages by hand, and what a step does."""

import numpy as np
import pytest
import torch

from dess.envs.observations.states import layout_of, masks
from dess.policies.learner.checkpoint import new_training
from dess.policies.learner.ppo import (
    CLIP,
    TRACE,
    WORTH,
    ProximalTraining,
    _compute_advantages,
    _shorten_range,
)
from dess.scenario.scenario import load_scenario
from tests.policies.learner.tiny import CPU, tiny_on_seas, weights_of


def _training(ticks: int = 0, **changes: object) -> ProximalTraining:
    training = new_training(tiny_on_seas(**changes), CPU)
    assert isinstance(training, ProximalTraining)
    training.run_ticks(ticks)
    return training


def test_advantages_are_sums_of_what_the_critic_did_not_expect():
    """Two missions of two UAVs; the second UAV of the first one decides only once."""
    missions, uavs = np.array([0, 0, 1, 0, 1, 0]), np.array([0, 1, 0, 0, 0, 0])
    earned = np.array([0.0, 0.0, 0.0, 0.3, 0.5, 0.6])
    values = np.array([0.9, 0.7, 0.2, 0.6, 0.1, 0.4])
    products = np.array([1.1, 0.0])  # the second mission fails: all is lost
    found = _compute_advantages(missions, uavs, earned, values, products, 2)
    last = 1.1 - 0.6 - 0.4
    middle = 0.6 - 0.3 + 0.4 - 0.6 + TRACE * last
    first = 0.3 - 0.0 + 0.6 - 0.9 + TRACE * middle
    failed = 0.0 - 0.5 - 0.1
    before = 0.5 - 0.0 + 0.1 - 0.2 + TRACE * failed
    assert found == pytest.approx([first, 1.1 - 0.7, before, middle, failed, last])


def test_returns_are_what_missions_still_bring():
    """With a critic that expects nothing, the last returns of UAVs are what is then collected."""
    training = _training()
    with torch.no_grad():
        for weight in training.learner.critic.value.parameters():
            weight.zero_()
    decisions, records = training._simulate_missions(0, 1)
    products = WORTH * records["collection_ratio_and_communication"]
    of_mission = decisions.missions % len(records)
    uavs = zip(of_mission, decisions.uavs, strict=True)
    last = {uav: row for row, uav in enumerate(uavs)}
    for (mission, _), row in last.items():
        assert 0.0 <= decisions.returns[row] <= products[mission] + 1e-5
    assert (masks(decisions.states, decisions.missions, decisions.uavs).sum(1) > 1).all()


def test_at_first_only_the_critic_learns():
    training = _training()
    for ticks, learning in (
        (training.config.learning_starts, {"critic"}),
        (1, {"online", "critic", "average"}),
    ):
        before = weights_of(training)
        training.run_ticks(ticks)
        after = weights_of(training)
        moved = {name.partition(".")[0] for name in before if (before[name] != after[name]).any()}
        assert moved - {"best"} == learning


def test_what_brought_more_becomes_likelier_but_not_by_much_more():
    training = _training()
    decisions, _ = training._simulate_missions(0, 0)
    temperature = training.phase.temperature
    signs = np.where(np.arange(len(decisions.actions)) % 2, 1.0, -1.0).astype(np.float32)
    shown = decisions._replace(advantages=signs)

    def chances() -> np.ndarray:
        seen = shown.encoder.encode(shown.states, shown.missions, shown.uavs)
        allowed = masks(shown.states, shown.missions, shown.uavs)
        with torch.no_grad():
            logs, _ = training.learner.judge_actions(seen, allowed, temperature)
        return logs.numpy()[np.arange(len(signs)), shown.actions] - shown.likelihoods

    assert np.abs(chances()).max() < 1e-4
    training.learner.update_networks([shown], temperature, 1e-4, True)
    assert (signs * chances()).mean() > 0
    # Beyond the clip there is no gradient: one decision alone stops soon after it.
    alone = shown.select_rows(np.array([1]))
    for _ in range(100):
        training.learner.update_networks([alone], temperature, 1e-3, True)
    assert np.log(1 + CLIP) < chances()[1] < np.log(1 + CLIP) + 0.5


def _gradients(training: ProximalTraining) -> list[torch.Tensor | None]:
    networks = training.learner.online, training.learner.critic
    return [weight.grad for network in networks for weight in network.parameters()]


def test_parts_of_a_minibatch_count_as_one():
    training, other = _training(), _training()
    decisions, _ = training._simulate_missions(0, 0)
    rows = np.arange(40)
    for learner, parts in (
        (training.learner, [decisions.select_rows(rows)]),
        (other.learner, [decisions.select_rows(rows[:13]), decisions.select_rows(rows[13:])]),
    ):
        learner.update_networks(parts, 0.1, 1e-3, True)
    for ours, theirs in zip(_gradients(training), _gradients(other), strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-3, atol=1e-6)


def test_a_range_is_a_number_of_ways_to_the_farthest_node():
    space = load_scenario("paper")
    farthest = layout_of(space).zone_slots(np.array(space.nodes)).max()
    near = _shorten_range(space, 1.5)
    assert np.mean(near.charge_complete) == pytest.approx(1.5 * farthest, abs=1)
    share = near.quota / space.quota
    assert np.array(near.flying_time) == pytest.approx(share * np.array(space.flying_time), abs=1)
    assert near.charge_start[0] == space.charge_start[0]
    assert _shorten_range(space, 2.0) == space  # its batteries are smaller already
