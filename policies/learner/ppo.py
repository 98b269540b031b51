"""The training of policies for any sea: proximal policy optimization of the product itself.

A *tick* is a number of whole missions on some of the seas, followed by the updates. The policy is
the softmax of the network's values of the allowed actions. A second network, the critic, learns
what a mission will still collect. An action that brought more than the critic had expected becomes
more likely, in small steps. The sum of a mission's rewards is its product: the share of all data
that the team has collected, or 0 if it fails.

Source: J. Schulman et al., *Proximal policy optimization algorithms*, 2017; advantages as in J.
Schulman et al., *High-dimensional continuous control using generalized advantage estimation*, 2016.
"""

import copy
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from dess.base.errors import InputError
from dess.base.kernels import kernel
from dess.envs.observations.observer import encoder_of
from dess.envs.observations.sets import Sets
from dess.envs.observations.states import CompactStates, masks
from dess.envs.stepper import MissionStepper
from dess.model.record import MISSION_RECORD
from dess.model.state import HOVER
from dess.physics.chart import spread
from dess.policies.learner import training
from dess.policies.learner.config import MISSION_SEED, TrainingConfig
from dess.policies.learner.description import field_ranges
from dess.policies.learner.network import SetNetwork
from dess.scenario.scenario import ScenarioSpace

TRACE = 0.98  # lambda of generalized advantage estimation
CLIP = 0.2  # by which share an action may become more likely or less before it gains no more
WORTH = 10.0  # by which products are multiplied, so that the critic's values have a usual size
CRITIC_RATE = 1e-3  # learning rate of the critic, whose task changes all the time
# Ranges, in ways to the farthest node: 1.8 on the paper's sea, 2.8 or more on generated ones.
RANGES = (1.4, 2.8)
ROWS = 256  # decisions that a network evaluates together
SEAS = 300  # of which the ways are kept in memory


class Decisions(NamedTuple):
    """What UAVs decided where they had a choice: R rows, all on one sea.

    Attributes:
        encoder: The encoder of the states.
        states: The states of the missions.
        missions, uavs: (R,) the states in which the UAVs decided.
        actions: (R,) the actions.
        likelihoods: (R,) logarithms of their probabilities.
        advantages: (R,) how much more they brought than others, as far as the critic can tell.
        returns: (R,) what the critic should have expected.
    """

    encoder: Sets
    states: CompactStates
    missions: np.ndarray
    uavs: np.ndarray
    actions: np.ndarray
    likelihoods: np.ndarray
    advantages: np.ndarray
    returns: np.ndarray

    def select_rows(self, rows: np.ndarray) -> "Decisions":
        """Those in some of the rows."""
        return Decisions(self.encoder, self.states, *(part[rows] for part in self[2:]))


class ProximalLearner(training.Learner):
    """The networks of proximal policy optimization and their optimizers.

    The values of the network ``online`` are the logits of the actions.

    Attributes:
        critic: The network that learns returns, as values of states.
    """

    def __init__(self, network: SetNetwork, config: TrainingConfig, device: torch.device):
        self.critic = copy.deepcopy(network)
        average = copy.deepcopy(network).requires_grad_(False)
        super().__init__(config, device, online=network, critic=self.critic, average=average)

    def reset_optimizers(self) -> None:
        """Reset the optimizers."""
        super().reset_optimizers()
        critic = torch.optim.Adam(self.critic.parameters(), lr=CRITIC_RATE, fused=True)
        self.optimizers["critic_optimizer"] = critic

    def ticks_before_step(self, optimizer: str) -> int:
        """The ticks of a phase before an optimizer makes its first step."""
        return self.config.learning_starts if optimizer == "optimizer" else 0

    def judge_actions(
        self, seen: Sequence[np.ndarray], allowed: np.ndarray, temperature: float
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """The (R, 5) logarithms of the probabilities of actions, and the (R,) values of states."""
        inputs = [*map(self.to_tensor, seen)]
        return self._log_probabilities(inputs, allowed, temperature), self.critic.value_of_state(
            *inputs
        )

    def update_networks(
        self, parts: Sequence[Decisions], temperature: float, rate: float, decides: bool
    ) -> dict[str, torch.Tensor]:
        """Make a gradient step of both networks; return loss, mean value and gradient norm.

        Args:
            parts: The minibatch, by seas. Advantages are in standard deviations.
            temperature: By which the values of actions are divided.
            rate: The learning rate of the policy.
            decides: Whether the policy learns as well, and not the critic alone.

        Raises:
            DivergenceError: If one of what it returns is not finite; the weights are then as
                before.
        """
        rows = sum(len(part.actions) for part in parts)
        learns = [*self.critic.parameters()]
        if decides:
            learns += self.online.parameters()

        def of_part(part: Decisions) -> tuple[torch.Tensor, ...]:
            loss, values = self._compute_loss(part, temperature, decides)
            gradients = torch.autograd.grad(loss / rows, learns, materialize_grads=True)
            return loss.detach() / rows, values.detach().sum() / rows, *gradients

        sums = [torch.stack(of_parts).sum(0) for of_parts in zip(*map(of_part, parts), strict=True)]
        loss, mean, *gradients = sums
        for weight, gradient in zip(learns, gradients, strict=True):
            weight.grad = gradient
        norms = [
            nn.utils.clip_grad_norm_(network.parameters(), self.config.gradient_norm)
            for network in (self.critic, self.online)[: 1 + decides]
        ]
        done = {"loss": loss, "value": mean, "gradient_norm": norms[-1]}
        training.check_finite(done)
        self.optimizers["critic_optimizer"].step()
        if decides:
            self.step(rate)
        return done

    def _compute_loss(
        self, part: Decisions, temperature: float, decides: bool
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """The loss of decisions, summed, and the (R,) values of their states."""
        seen = part.encoder.encode(part.states, part.missions, part.uavs)
        inputs = [*map(self.to_tensor, seen)]
        values = self.critic.value_of_state(*inputs)
        loss = (values - self.to_tensor(part.returns)).pow(2).sum()
        if not decides:
            return loss, values
        allowed = masks(part.states, part.missions, part.uavs)
        likelihoods = self._log_probabilities(inputs, allowed, temperature)
        chosen = likelihoods.gather(1, self.to_tensor(part.actions)[:, None]).squeeze(1)
        ratio = (chosen - self.to_tensor(part.likelihoods)).exp()
        advantage = self.to_tensor(part.advantages)
        gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage)
        return loss - gain.sum(), values

    def _log_probabilities(
        self, inputs: Sequence[torch.Tensor], allowed: np.ndarray, temperature: float
    ) -> torch.Tensor:
        logits = self.online(*inputs) / temperature
        return torch.log_softmax(logits.masked_fill(~self.to_tensor(allowed), -1e9), 1)


class ProximalTraining(training.Training):
    """A training in progress. Between two ticks there are no missions in progress.

    Attributes:
        shares: Of the seas in the missions, on average.
    """

    learner: ProximalLearner

    @cached_property
    def ranges(self) -> dict[str, list[float]]:
        """The least and the largest value of each field in the missions, short ones included."""
        short = self.spaces if self.config.short_ranges else []
        return field_ranges([*self.spaces, *(_shorten_range(space, RANGES[0]) for space in short)])

    def _make_learner(self, network: SetNetwork) -> ProximalLearner:
        return ProximalLearner(network, self.config, self.device)

    def _begin_missions(self) -> None:
        # A UAV more makes more decisions in a mission, so large fleets have fewer missions.
        weights = np.array([1 / np.mean(space.uavs) for space in self.spaces])
        self.shares = weights / weights.sum()
        self._sea = lru_cache(SEAS)(self._make_encoder)

    def _make_encoder(self, number: int) -> tuple[ScenarioSpace, Sets]:
        """A sea by its number, and the encoder of its states."""
        space = self._in_phase(self.spaces[number])
        return space, encoder_of("sets", space)

    def _learn_in_tick(self, share: float) -> None:
        config, generator = self.config, self.generator
        seas = config.seas_per_tick
        numbers = generator.choice(len(self.spaces), seas, len(self.spaces) < seas, self.shares)
        simulated = [
            self._simulate_missions(place, int(number)) for place, number in enumerate(numbers)
        ]
        shown = [decisions for decisions, _ in simulated if len(decisions.actions)]
        if not shown:
            raise InputError(
                "scenario",
                "no UAV had a choice in any mission of a tick",
                "one in which there is more to decide",
            )
        self.finished += [records for _, records in simulated]
        self.uav_slots += sum(int(records["uav_slots"].sum()) for _, records in simulated)
        spread = np.concatenate([decisions.advantages for decisions in shown]).std() + 1e-6
        shown = [d._replace(advantages=d.advantages / spread) for d in shown]
        rate = training.interpolate_ends(self.phase.learning_rate, share)
        decides = self.tick - self.phase_start >= config.learning_starts
        per_sea = max(config.batch // len(shown), 1)
        for _ in range(config.updates):
            rows = [generator.integers(0, len(d.actions), per_sea) for d in shown]
            parts = [d.select_rows(chosen) for d, chosen in zip(shown, rows, strict=True)]
            self.losses.append(
                self.learner.update_networks(parts, self.phase.temperature, rate, decides)
            )
            self.updates += 1

    def _simulate_missions(self, place: int, number: int) -> tuple[Decisions, np.ndarray]:
        """Missions on a sea: the decisions in which UAVs had a choice, and the records.

        Args:
            place: The place of these missions in their tick.
            number: The number of the sea.
        """
        config = self.config
        space, encoder = self._sea(number)
        generator = np.random.default_rng([config.seed, self.tick, place])
        if generator.random() < config.short_ranges:
            space = _shorten_range(space, generator.uniform(*RANGES))
        stepper = MissionStepper(space, config.num_envs, MISSION_SEED + config.seed)
        place_in_phase = self.tick * config.seas_per_tick + place
        first = place_in_phase * config.num_envs % training.MISSIONS_PER_PHASE
        stepper.start_at(stepper.seed, self.phase_index * training.MISSIONS_PER_PHASE + first)
        stepper.launch(stepper.indices)
        missions = stepper.state.missions
        records = np.zeros(config.num_envs, MISSION_RECORD)
        collected = [np.zeros(config.num_envs)]
        seen: list[CompactStates] = []
        decided: list[tuple[np.ndarray, ...]] = []
        while missions["active"].any():
            states, at, uavs = training.find_acting_uavs(stepper, config.guard)
            actions = np.full(states.uavs.shape[:2], HOVER)
            actions[at, uavs], *judged = self._draw_actions(encoder, states, at, uavs, generator)
            decided.append((np.full(len(at), len(seen)), at, uavs, actions[at, uavs], *judged))
            seen.append(states)
            outcome = stepper.step(actions)
            collected.append(collected[-1] + outcome["team_collected"].max(1))
            ended = training.find_ended_missions(stepper, outcome)
            records[ended] = stepper.records(ended).missions
        states = CompactStates(*(np.concatenate(parts) for parts in zip(*seen, strict=True)))
        columns = [np.concatenate(parts) for parts in zip(*decided, strict=True)]
        shares = np.array(collected) / np.maximum(records["initial"] + records["arrived"], 1e-9)
        return self._select_decisions(encoder, states, columns, WORTH * shares, records), records

    def _select_decisions(
        self,
        encoder: Sets,
        states: CompactStates,
        columns: list[np.ndarray],
        earned: np.ndarray,
        records: np.ndarray,
    ) -> Decisions:
        """What was decided where there was a choice.

        Args:
            encoder: The encoder of the states.
            states: Those of all missions, slot by slot.
            columns: Of each decision the slot, the mission, the UAV, the action, the logarithm of
                its probability and the value of the state.
            earned: (T, N) what the missions had brought before each slot.
            records: (N,) the missions.
        """
        slots, missions, uavs, actions, likelihoods, values = columns
        products = WORTH * records[training.SELECT_BY]
        fleet = states.uavs.shape[1]
        so_far = earned[slots, missions]
        advantages = _compute_advantages(missions, uavs, so_far, values, products, fleet)
        centred = (advantages - advantages.mean()).astype(np.float32)
        returns = (advantages + values).astype(np.float32)
        rows = slots * len(records) + missions
        decisions = Decisions(encoder, states, rows, uavs, actions, likelihoods, centred, returns)
        return decisions.select_rows(np.flatnonzero(masks(states, rows, uavs).sum(1) > 1))

    @torch.inference_mode()
    def _draw_actions(
        self,
        encoder: Sets,
        states: CompactStates,
        missions: np.ndarray,
        uavs: np.ndarray,
        generator: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Actions drawn from the policy, logarithms of their probabilities, and values."""
        allowed = masks(states, missions, uavs)
        noise = -np.log(-np.log(generator.random(allowed.shape)))
        batches: list[Any] = []
        for first in range(0, len(uavs), ROWS):
            rows = slice(first, first + ROWS)
            parts = encoder.encode(states, missions[rows], uavs[rows])
            judged = self.learner.judge_actions(parts, allowed[rows], self.phase.temperature)
            batches.append([part.cpu().numpy() for part in judged])
        if not batches:
            return np.zeros(0, np.int64), np.zeros(0, np.float32), np.zeros(0, np.float32)
        likelihoods, values = map(np.concatenate, zip(*batches, strict=True))
        drawn = (likelihoods + noise).argmax(1)
        return drawn, likelihoods[np.arange(len(drawn)), drawn], values


def _shorten_range(space: ScenarioSpace, times: float) -> ScenarioSpace:
    """A scenario in which a charged battery lasts so many times the way to the farthest node.

    The quota shrinks with the battery. If the battery is smaller already, nothing changes.
    """
    zones = space.chart.zones
    nodes = np.array(space.nodes)
    ways = spread(zones, space.chart.parking)[0].reshape(zones.shape)
    far = ways[nodes[:, 1], nodes[:, 0]].max()
    least = space.charge_start[0]
    fields = ("flying_time", "charge_start", "charge_complete")
    share = max(times * far / np.mean(space.charge_complete), 2 * least / space.charge_complete[0])
    if share >= 1.0:
        return space
    sizes = {name: [max(round(share * n), least) for n in getattr(space, name)] for name in fields}
    return ScenarioSpace.of(space, quota=round(share * space.quota), **sizes)


@kernel
def _compute_advantages(missions, uavs, earned, values, products, fleet):
    """Generalized advantages of (R,) decisions in the order of time.

    What a UAV decides counts until it decides again, and its last decision until its mission ends.
    Rewards are not discounted: a mission's product is worth as much whenever data are collected.
    """
    out = np.empty(len(missions))
    later = np.zeros((len(products), fleet, 3))  # advantage, value and what had been earned
    for m in range(len(products)):
        later[m, :, 2] = products[m]
    for r in range(len(missions) - 1, -1, -1):
        of_uav = later[missions[r], uavs[r]]
        out[r] = of_uav[2] - earned[r] + of_uav[1] - values[r] + TRACE * of_uav[0]
        of_uav[0] = out[r]
        of_uav[1] = values[r]
        of_uav[2] = earned[r]
    return out
