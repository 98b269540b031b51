"""The training of ``generalist`` by imitation: planned missions on generated seas as examples.

    python -m benchmarks.demonstrations --out runs/imitation
    dess train generalist --from runs/imitation --out runs/generalist

A planner flies missions on the seas of the set ``train``, and another policy makes a share of the
decisions, so that the planner also shows how to go on from there. In the first round that policy
is random; then it is the network that has learned from the rounds before (S. Ross et al., *A
reduction of imitation learning and structured prediction to no-regret online learning*, 2011). A
network on sets learns the decisions of all rounds by cross entropy. The folder is a policy, with
which the second command begins. The examples are kept in ``OUT-examples``, so a run that was cut
off goes on from there.
"""

import argparse
import copy
import pickle
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn
from tqdm import tqdm

from dess import load_scenario, simulate_batch
from dess.envs.observations.observer import encoder_of
from dess.envs.observations.sets import Sets
from dess.envs.observations.states import CompactStates, compact_states, masks
from dess.model.guard import guard
from dess.model.view import View
from dess.policies.learner.config import MISSION_SEED, TrainingConfig, load_config
from dess.policies.learner.network import SetNetwork, to_arrays
from dess.policies.learner.trained import make_policy, save_policy
from dess.policies.learner.training import soft_update
from dess.policies.planner import LongPlanner, Planner
from dess.scenario.families import FAMILIES, SETS


class Round(NamedTuple):
    """Missions of one kind.

    Attributes:
        seas: How many seas of each family, of the set ``train`` in order.
        deviations: The share of decisions that the other policy makes, in each mission of a sea.
        updates: The updates by which a network learns from this round and those before.
        team: The fewest and the most UAVs of a mission, beyond the most that its sea has data for.
    """

    seas: int
    deviations: tuple[float, ...]
    updates: int
    team: tuple[int, int]


ROUNDS = (
    Round(80, (0.03, 0.2), 4000, (-1, 0)),
    Round(120, (0.5, 0.9), 4000, (-5, 1)),
    Round(100, (0.2, 0.7), 26_000, (-5, 1)),
)
# On the largest seas a longer search finds clearly better plans.
TEACHERS = {"large": LongPlanner}
PARTS = 8  # seas of a minibatch
BATCH = 512
NEIGHBOURS = 0.1  # share of the seas, near in the number of nodes, that a minibatch is of
AVERAGE = 0.001  # rate of the slow copy of the weights, which is what is learned
RATES = (2e-3, 2e-5)  # learning rates of the first and the last update
TEMPERATURE = 0.1  # by which values are divided to be logits


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
    """The planner, with some decisions of another policy, and a record of what it decides."""

    name = "demonstrator"

    def __init__(self, planner: Planner, deviations: Sequence[float], other: Any, seed: int):
        self.planner, self.deviations, self.other = planner, np.array(deviations), other
        self.generator = np.random.default_rng(seed)
        self.seen: list[tuple[np.ndarray, ...]] = []

    def act(self, view: View) -> np.ndarray:
        """The planner's decisions, of which some are replaced."""
        planned = self.planner.act(view)
        states = compact_states(view.state, view.world.chart, True)
        labels = np.full(view.state.uavs.shape, -1, np.int8)
        labels[view.mission, view.uav] = planned
        self.seen.append(tuple(a[np.unique(view.mission)] for a in (*states, labels)))
        replaced = self.other.act(view) if self.other else self._random(view)
        share = self.deviations[view.constants["replication"] % len(self.deviations)]
        return np.where(self.generator.random(len(planned)) < share, replaced, planned)

    def _random(self, view: View) -> np.ndarray:
        allowed = guard(view)
        return np.where(allowed, self.generator.random(allowed.shape), -1.0).argmax(1)


def examples_on(name: str, kind: Round, weights: Path | None) -> Examples:
    """What the planner shows in a mission per share of deviations, where it had a choice."""
    torch.set_num_threads(1)
    space, (family, _, seed) = load_scenario(name), name.partition(":")
    room = space.zone[2] * space.zone[3]
    uavs = [min(max(space.uavs[1] + more, 1), room) for more in kind.team]
    space = load_scenario(name, uavs=uavs)
    other = None
    if weights:
        other = make_policy(load_config("generalist"), None, Sets, to_arrays(torch.load(weights)))
    planner = TEACHERS.get(family, Planner)()
    demonstrator = Demonstrator(planner, kind.deviations, other, int(seed))
    simulate_batch(space, demonstrator, MISSION_SEED + int(seed), len(kind.deviations))
    *parts, labels = (np.concatenate(arrays) for arrays in zip(*demonstrator.seen, strict=True))
    states = CompactStates(*parts)
    rows, uavs = np.nonzero(labels >= 0)
    is_choice = masks(states, rows, uavs).sum(1) > 1
    rows, uavs = rows[is_choice], uavs[is_choice]
    encoder = encoder_of("sets", space)
    return Examples(encoder, states, rows, uavs, labels[rows, uavs])


def recorded(folder: Path, names: Sequence[str], kind: Round, weights: Path | None) -> list[Path]:
    """Files with the examples on seas, of which those that do not exist are made."""
    paths = [folder / f"{name.replace(':', '-')}.pickle" for name in names]
    missing = [place for place in zip(names, paths, strict=True) if not place[1].exists()]
    with ProcessPoolExecutor() as workers:
        made = workers.map(
            partial(examples_on, kind=kind, weights=weights),
            [name for name, _ in missing],
        )
        for (_, path), examples in zip(missing, tqdm(made, total=len(missing)), strict=True):
            temporary = path.with_suffix(".tmp")
            temporary.write_bytes(pickle.dumps(examples))
            temporary.rename(path)
    return paths


def imitate(
    config: TrainingConfig, shown: list[Examples], updates: int, weights: Path | None
) -> dict[str, Any]:
    """The weights of a network that has learned the decisions, from weights of a round before."""
    torch.manual_seed(config.seed)
    torch.set_num_threads(1)
    generator = np.random.default_rng(config.seed)
    network = _network(config, weights)
    average = copy.deepcopy(network).requires_grad_(False)
    optimizer = torch.optim.Adam(network.parameters(), fused=True)
    shown = sorted(shown, key=lambda examples: len(examples.encoder.sea.nodes))
    near = round(NEIGHBOURS * len(shown))
    for update in tqdm(range(updates)):
        middle = generator.integers(len(shown))
        places = generator.integers(middle - near, middle + near + 1, PARTS)
        chosen = [shown[n] for n in places.clip(0, len(shown) - 1)]
        picks = [generator.integers(0, len(e.rows), BATCH // PARTS) for e in chosen]
        optimizer.zero_grad(set_to_none=True)
        for examples, pick in zip(chosen, picks, strict=True):
            at = examples.states, examples.rows[pick], examples.uavs[pick]
            logits = network(*map(torch.from_numpy, examples.encoder.encode(*at))) / TEMPERATURE
            planned = torch.from_numpy(examples.planned[pick].astype(np.int64))
            allowed = torch.from_numpy(masks(*at))
            loss = nn.functional.cross_entropy(logits.masked_fill(~allowed, -1e9), planned)
            (loss / PARTS).backward()
        nn.utils.clip_grad_norm_(network.parameters(), config.gradient_norm)
        cosine = (1 + np.cos(np.pi * update / updates)) / 2
        for group in optimizer.param_groups:
            group["lr"] = RATES[1] + (RATES[0] - RATES[1]) * cosine
        optimizer.step()
        soft_update(average, network, max(AVERAGE, 1 / (update + 1)))
    return average.state_dict()


def _network(config: TrainingConfig, weights: Path | None) -> SetNetwork:
    network = SetNetwork(Sets.shapes, config.hidden)
    if weights:
        network.load_state_dict(torch.load(weights))
    return network


def main() -> None:
    """Record and learn, round by round, and save."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the policy")
    options = parser.parse_args()
    config, weights, paths = load_config("generalist"), None, []
    first = 0
    for number, kind in enumerate(ROUNDS, 1):
        folder = options.out.with_name(f"{options.out.name}-examples") / str(number)
        folder.mkdir(parents=True, exist_ok=True)
        seeds = SETS["train"][first : first + kind.seas]
        names, first = [f"{f}:{s}" for s in seeds for f in FAMILIES], first + kind.seas
        paths += recorded(folder, names, kind, weights)
        shown = [pickle.loads(path.read_bytes()) for path in paths]
        print(f"{len(shown)} seas, {sum(len(e.rows) for e in shown):,} decisions")
        learned = folder / "weights.pt"
        if not learned.exists():
            torch.save(imitate(config, shown, kind.updates, weights), learned)
        weights = learned
    save_policy(options.out, torch.load(weights), config, config.space)


if __name__ == "__main__":
    main()
