"""What a trained policy observes in missions, from which it gets the scales of its integers.

    python -m dess.policies.learner.calibration FOLDER

writes the integers of a trained policy beside its float weights; again, they have the same bytes.
The missions are those of its own scenarios and, if it decides on any sea, of the shipped data
sheets and of drawn ones; otherwise with larger fleets and a larger quota. All are simulated
with lone UAVs as well, which see the largest values.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dess.base.errors import InputError
from dess.envs.observations.states import CompactStates, Layout, compact_states, masks
from dess.model.batch import simulate_batch
from dess.model.view import View
from dess.policies.integers import Integers
from dess.policies.learner.config import TrainingConfig
from dess.policies.learner.policy import LearnedPolicy
from dess.policies.learner.trained import INTEGER_KINDS, has_integers, load_teacher, save_integers
from dess.policies.network import Weights
from dess.policies.quantization import Observation, quantize, quantize_dense
from dess.scenario.families import SET_FAMILIES
from dess.scenario.scenario import ScenarioSpace, load_scenario, scenario_names

SEED = 910_000_001  # of the missions, and of what is drawn
MOST_OWN = 70  # of the scenarios of a training
MISSIONS = 2  # of each scenario
DECISIONS = 40  # of each scenario, at most
MISSIONS_OF_ONE = 50  # of the only scenario of a policy that decides on no other
DECISIONS_OF_ONE = 2000
EVERY = 8  # slots, of which one is observed
DRAWN = 40  # sheets


class _Recorder:
    """A policy that keeps what it observes where it has a choice."""

    def __init__(self, policy: LearnedPolicy) -> None:
        self.name = policy.name
        self.policy = policy
        self.slots = 0
        self.seen: list[tuple[Any, CompactStates, int]] = []

    def act(self, view: View) -> np.ndarray:
        """As the policy."""
        self.slots += 1
        if self.slots % EVERY == 0:
            self._observe(view)
        return self.policy.act(view)

    def _observe(self, view: View) -> None:
        states = compact_states(view.state, view.world.chart, self.policy.guarded, view.ways)
        has_choice = masks(states, view.mission, view.uav).sum(1) > 1
        for rows, encoder in self.policy.rows_by_sea(view):
            for row in rows[has_choice[rows]]:
                b = view.mission[row]
                state = CompactStates(*(part[b : b + 1] for part in states))
                self.seen.append((encoder, state, int(view.uav[row])))

    def observations(self, decisions: int) -> Iterator[Observation]:
        """What it has observed, sea by sea: at most so many decisions in all."""
        seen = self.seen[:: max(-(-len(self.seen) // decisions), 1)]
        for encoder in {id(encoder): encoder for encoder, *_ in seen}.values():
            rows = [(state, uav) for other, state, uav in seen if other is encoder]
            states, uavs = zip(*rows, strict=True)
            together = CompactStates(*map(np.concatenate, zip(*states, strict=True)))
            yield encoder.encode(together, np.arange(len(rows)), np.array(uavs))


def calibrate(policy: LearnedPolicy, weights: Weights, config: TrainingConfig) -> Integers:
    """The integers of a policy.

    Args:
        policy: The policy, which acts with its float weights.
        weights: The weights.
        config: The settings of its training.
    """
    trained = config.mission_spaces()
    if policy.layout is not None:
        spaces = [*trained, *(_beyond(space, policy.layout) for space in trained)]
        seen = observations_of(policy, spaces, MISSIONS_OF_ONE, DECISIONS_OF_ONE)
        return quantize_dense(weights, [*seen])
    spaces = [
        *trained[:: -(-len(trained) // MOST_OWN)],
        *_shipped(),
        *map(drawn_sheet, range(DRAWN)),
    ]
    return quantize(weights, [*observations_of(policy, spaces)])


def observations_of(
    policy: LearnedPolicy,
    spaces: list[ScenarioSpace],
    missions: int = MISSIONS,
    decisions: int = DECISIONS,
) -> Iterator[Observation]:
    """What a policy observes in missions of scenarios, and in those of lone UAVs.

    Args:
        policy: The policy.
        spaces: The scenarios.
        missions: The missions of each.
        decisions: The decisions that are taken of each at most, from the first to the last.
    """
    for space in spaces:
        for fleet in dict.fromkeys([space.uavs, (1, 1)]):
            recorder = _Recorder(policy)
            of_fleet = space.model_copy(update={"uavs": fleet})
            simulate_batch(of_fleet, recorder, SEED, missions)
            yield from recorder.observations(decisions)


def _beyond(space: ScenarioSpace, layout: Layout) -> ScenarioSpace:
    """The same layout with twice the UAVs, as far as the zone has room, and twice the quota."""
    _, _, width, height = layout.zone
    uavs = min(2 * space.uavs[1], int(width * height))
    return space.model_copy(update={"uavs": (uavs, uavs), "quota": 2 * space.quota})


def drawn_sheet(seed: int) -> ScenarioSpace:
    """A generated sea with a data sheet that is drawn, for one to five UAVs."""
    generator = np.random.default_rng(seed)

    def draw(low: float, high: float) -> float:
        return float(np.round(np.exp(generator.uniform(np.log(low), np.log(high))), 2))

    family = SET_FAMILIES[seed % len(SET_FAMILIES)]
    cruise = draw(8, 20)
    sheet = {
        "endurance": f"{draw(15, 60)} min",
        "cruise": f"{cruise} m/s",
        "charging": f"{draw(20, 120)} min",
        "data_rate": f"{draw(0.5, 20)} MB/h",
        "bandwidth": f"{draw(1, 20)} MHz",
        "snr": f"{draw(6, 25)} dB at 2 km",
        "max_speed": f"{1.5 * cruise:.4g} m/s",
        "wind": f"{draw(0.5, 0.5 * cruise)} m/s from SW",
        "horizon": f"{draw(3, 10)} h",
    }
    name = f"{family}:{seed}"
    _, most = load_scenario(name).limits("uavs")
    uavs = min(int(generator.integers(1, 6)), int(most))
    return load_scenario(name, uavs=uavs, data_sheet=sheet)


def _shipped() -> list[ScenarioSpace]:
    """The shipped scenarios, without their weather."""
    return [load_scenario(name).without_weather() for name in scenario_names()]


def main(folder: Path) -> None:
    """Write the integers of a trained policy.

    Raises:
        InputError: If the folder has no policy that can act in integers.
    """
    teacher = load_teacher(folder)
    if not has_integers(teacher[2]):
        raise InputError(folder, "its policy cannot act in integers", INTEGER_KINDS)
    save_integers(folder, calibrate(*teacher))


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]))
    except InputError as error:
        sys.exit(str(error))
