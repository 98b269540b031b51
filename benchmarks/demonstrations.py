"""The first part of the training of ``any``, away from its learner: planned missions as examples.

    python -m benchmarks.demonstrations --out runs/demonstrations
    dess train any --from runs/demonstrations --out runs/any

A short planner flies missions on generated seas, and a share of its decisions is replaced by random
ones, so that it also shows how to go on from there. A network on sets then learns its decisions by
cross entropy. The folder is a policy, with which the double DQN of the config ``any`` begins.
"""

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from dess import load_scenario, simulate_batch
from dess.observations.guard import guard
from dess.observations.observer import encoder_of
from dess.observations.sets import Sets
from dess.observations.states import CompactStates, compact_states, masks
from dess.sea.families import FAMILIES, SETS
from dess.view import View
from policies.ddqn.config import MISSION_SEED, TrainingConfig, load_config
from policies.ddqn.learner import Learner
from policies.ddqn.network import SetNetwork
from policies.ddqn.trained import save_policy
from policies.ddqn.training import ShortPlanner

DEVIATIONS = (0.03, 0.2)  # share of random decisions, by mission
PARTS = 8  # seas of a minibatch
RATES = (2e-3, 2e-5)  # learning rates of the first and the last update
VALUE = 12.5  # of all states: about what a mission is worth from its beginning


class Examples(NamedTuple):
    """The decisions of the planner on a sea: N rows.

    Attributes:
        encoder: The encoder of the states.
        states: The states of all missions and slots.
        rows, uavs: (N,) the states in which UAVs decided.
        planned: (N,) the decisions.
    """

    encoder: Sets
    states: CompactStates
    rows: np.ndarray
    uavs: np.ndarray
    planned: np.ndarray


class Demonstrator:
    """The planner with random deviations, and a record of what it decides."""

    name = "demonstrator"

    def __init__(self, seed: int):
        self.planner, self.generator = ShortPlanner(), np.random.default_rng(seed)
        self.seen: list[tuple[np.ndarray, ...]] = []

    def act(self, view: View) -> np.ndarray:
        """The planner's decisions, of which some are replaced."""
        planned = self.planner.act(view)
        states = compact_states(view.state, view.world.chart, True)
        labels = np.full(view.state.uavs.shape, -1, np.int8)
        labels[view.mission, view.uav] = planned
        self.seen.append(tuple(a[np.unique(view.mission)] for a in (*states, labels)))
        safe = guard(view)
        random = np.where(safe, self.generator.random(safe.shape), -1.0).argmax(1)
        share = np.array(DEVIATIONS)[view.constants["replication"] % len(DEVIATIONS)]
        return np.where(self.generator.random(len(planned)) < share, random, planned)


def examples_on(name: str) -> Examples:
    """What the planner shows in two missions on a sea, where it had a choice."""
    space, seed = load_scenario(name), int(name.partition(":")[2])
    demonstrator = Demonstrator(seed)
    simulate_batch(space, demonstrator, MISSION_SEED + seed, len(DEVIATIONS))
    *parts, labels = (np.concatenate(arrays) for arrays in zip(*demonstrator.seen, strict=True))
    states = CompactStates(*parts)
    rows, uavs = np.nonzero(labels >= 0)
    is_choice = masks(states, rows, uavs).sum(1) > 1
    rows, uavs = rows[is_choice], uavs[is_choice]
    return Examples(encoder_of("sets", space), states, rows, uavs, labels[rows, uavs].astype(int))


def imitate(config: TrainingConfig, shown: list[Examples], updates: int) -> dict[str, Any]:
    """The weights of a network that has learned the decisions."""
    torch.manual_seed(config.seed)
    generator = np.random.default_rng(config.seed)
    network = SetNetwork(Sets.shapes, config.hidden)
    learner = Learner(network, Sets, config, torch.device("cpu"))
    assert learner.average is not None
    for update in range(updates):
        chosen = [shown[n] for n in generator.integers(0, len(shown), PARTS)]
        picks = [generator.integers(0, len(e.rows), config.batch // PARTS) for e in chosen]
        at = [(e.states, e.rows[p], e.uavs[p]) for e, p in zip(chosen, picks, strict=True)]
        seen = learner._observe((e.encoder, *rows) for e, rows in zip(chosen, at, strict=True))
        allowed = torch.from_numpy(np.concatenate([masks(*rows) for rows in at]))
        planned = np.concatenate([e.planned[p] for e, p in zip(chosen, picks, strict=True)])
        logits = network(*seen) / config.imitation_temperature
        loss = nn.functional.cross_entropy(
            logits.masked_fill(~allowed, -1e9), torch.from_numpy(planned)
        )
        learner.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), config.gradient_norm)
        cosine = (1 + np.cos(np.pi * update / updates)) / 2
        for group in learner.optimizer.param_groups:
            group["lr"] = RATES[1] + (RATES[0] - RATES[1]) * cosine
        learner.optimizer.step()
        rate = max(config.average_rate, 1 / (update + 1))
        torch._foreach_lerp_([*learner.average.parameters()], [*network.parameters()], rate)
    weights = learner.average.state_dict()
    weights["value.weight"] *= 0.0  # it has learned no values
    weights["value.bias"][:] = VALUE
    return weights


def main() -> None:
    """Record, learn and save."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the policy")
    parser.add_argument("--seas", type=int, default=60, help="of each family")
    parser.add_argument("--updates", type=int, default=4000)
    options = parser.parse_args()
    seeds = SETS["train"][: options.seas]
    shown = [examples_on(f"{family}:{seed}") for seed in seeds for family in FAMILIES]
    print(f"{len(shown)} seas, {sum(len(e.rows) for e in shown):,} decisions")
    config = load_config("any")
    save_policy(options.out, imitate(config, shown, options.updates), config, config.space)


if __name__ == "__main__":
    main()
