"""Missions that advance slot by slot with actions that the caller gives; one per environment.

stepper = MissionStepper(space, num_envs=4, seed=1)
stepper.launch(stepper.indices)    # replications 0 to 3
outcome = stepper.step(actions)    # (4, I) actions
"""

from typing import Any

import numpy as np

from dess import rules
from dess.batch import check_slotted
from dess.channel import empty_scratch, world_of
from dess.code.kernels import kernel
from dess.errors import InputError
from dess.record import Records, empty_records, write_records
from dess.scenario import Scenario, ScenarioSpace
from dess.sections.wind import ways_home
from dess.state import ACTION_NAMES, TRUNCATED, check_seed, fields, spaces_of, starts_of, state_of

# The terms of a reward, in the order of ``rules.reward_terms``.
REWARD_TERMS = ("data", "step", "overruled", "charging", "quota", "depleted", "age")


# What a mission slot does to one UAV.
OUTCOME = np.dtype(
    [
        # Whether it was active in the slot, whether it has ended in it (quota filled or battery
        # depleted; or because of ``max_slots``), and whether the safety controller overruled it.
        *fields(np.bool_, "acted terminated truncated overruled"),
        ("end", np.int64),  # how its mission ended, an index of ``state.END_NAMES``
        # The reward, 0 for an inactive UAV, and the data that it, and all UAVs, collected.
        *fields(np.float64, "reward collected team_collected"),
        ("reward_terms", np.float64, len(REWARD_TERMS)),
    ],
    align=True,
)


class MissionStepper:
    """N missions of one scenario in progress.

    Attributes:
        space: The space from which each mission draws its parameters.
        seed: Seed of the missions to be launched.
        replication: The next replication to be launched.
        state: The arrays of the missions.
        world: The nodes and the tables of the channel.
        indices: (N,) the indices 0 to N - 1 of the environments.
    """

    def __init__(self, scenario: Scenario | ScenarioSpace, num_envs: int, seed: int):
        self.space = spaces_of([scenario])[0]
        check_slotted([self.space])
        self.indices = np.arange(num_envs)
        self.world, self.state = world_of(self.space), state_of([self.space], num_envs)
        self._starts = starts_of([self.space])
        self._scratch = empty_scratch(self.space.uavs[1], len(self.space.nodes))
        self.start_at(seed, 0)

    def start_at(self, seed: int, replication: int) -> None:
        """Make this replication of this seed the next mission to be launched.

        Raises:
            InputError: If one of them is out of range.
        """
        check_seed(seed, replication)
        self.seed, self.replication = seed, replication

    def start(self, seed: int | None, options: dict[str, Any] | None) -> None:
        """Launch a mission in every environment, as ``reset`` of an environment is asked to.

        Args:
            seed: Start at replication 0 of this seed. If None, the numbering continues.
            options: ``{"replication": r}`` starts at replication r; other keys are ignored.

        Raises:
            InputError: If the seed or the replication is out of range.
        """
        replication = (options or {}).get("replication")
        if seed is not None or replication is not None:
            self.start_at(self.seed if seed is None else seed, replication or 0)
        self.launch(self.indices)

    def launch(self, environments: np.ndarray) -> None:
        """Start the next replications in these environments, in this order."""
        check_seed(self.seed, self.replication + len(environments) - 1)
        self._starts.constants["seed"] = self.seed
        _launch(self.state, environments, self._starts, self.replication)
        self.replication += len(environments)

    def step(self, actions: np.ndarray) -> np.ndarray:
        """Run one slot of every environment.

        Args:
            actions: (N, I) integers 0..4, ignored where no UAV acts.

        Returns:
            (N, I) ``OUTCOME`` records.
        """
        outcome = np.zeros(self.state.uavs.shape, OUTCOME)
        _step(self.state, self.world, self._scratch, actions, outcome)
        return outcome

    def records(self, environments: np.ndarray) -> Records:
        """The records of the missions in these environments, up to the present slot."""
        fleet = self.state.uavs.shape[1]
        records = empty_records(len(environments), fleet, self.space.is_extended)
        ways = ways_home(self.state.missions, self.world.chart)
        write_records(environments, self.state, ways, records)
        return records


@kernel
def _launch(state, environments, starts, first):
    """Start the replications from ``first`` on in these environments."""
    for n in range(len(environments)):
        rules.launch(state, environments[n], starts, 0, first + n)


@kernel
def _step(state, world, scratch, actions, out):
    """Run one slot of every mission and write the ``OUTCOME`` records."""
    nodes, mean_snr, order, means, chart = world
    batches, search = scratch
    fleet = state.uavs.shape[1]
    arrivals = np.empty(len(world.nodes), np.int64)
    charged, collected = np.empty(fleet, np.int64), np.empty(fleet)
    for b in range(len(state.missions)):
        mission, uavs = state.missions[b], state.uavs[b]
        for i in range(fleet):
            u = uavs[i]
            u.action = actions[b, i]
            out[b, i].acted = u.active
            charged[i], collected[i] = u.slots_charging, u.collected
        rules.advance(
            mission, uavs, state.residual[b], state.sensors[b], state.teeth[b], arrivals,
            nodes, mean_snr, order, means, chart, batches, search,
        )  # fmt: skip
        for i in range(fleet):
            u, to = uavs[i], out[b, i]
            ended = to.acted and not u.active
            to.reward = u.reward
            to.end = u.end
            to.terminated = ended and u.end != TRUNCATED
            to.truncated = ended and u.end == TRUNCATED
            to.overruled = u.overruled
            to.collected = u.collected - collected[i]
            to.team_collected = mission.slot_collected
            if to.acted:
                terms = rules.reward_terms(mission, u, u.slots_charging > charged[i])
                for t in range(len(terms)):
                    to.reward_terms[t] = terms[t]


def checked_actions(actions: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Check actions and return them as an integer array.

    Raises:
        InputError: If they are not integers 0..4 of that shape.
    """
    array = np.asarray(actions)
    if array.dtype.kind not in "iu" or array.shape != shape:
        raise InputError(
            f"actions: {array.dtype} of shape {array.shape}; allowed: integers of shape {shape}"
        )
    wrong = array[(array < 0) | (array >= len(ACTION_NAMES))]
    if wrong.size:
        raise InputError(
            f"actions: {wrong[0]} is not an action; allowed: 0..{len(ACTION_NAMES) - 1}"
        )
    return array.astype(np.int64)
