"""Missions that advance slot by slot with actions that the caller gives; one per environment.

stepper = MissionStepper(space, num_envs=4, seed=1)
stepper.launch(stepper.indices)    # replications 0 to 3
outcome = stepper.step(actions)    # (4, I) actions
"""

from typing import Any, NamedTuple

import numpy as np

from dess import rules
from dess.batch import check_slotted
from dess.channel import empty_scratch, world_of
from dess.code.kernels import kernel
from dess.errors import InputError
from dess.record import Records, empty_records, write_records
from dess.scenario import Scenario, ScenarioSpace
from dess.state import (
    ACTION_NAMES,
    TRUNCATED,
    check_seed,
    constants_of,
    empty_state,
    ranges_of,
    spaces_of,
    teeth_lengths,
    types_of,
)

# The terms of a reward, in the order of ``rules.reward_terms``.
REWARD_TERMS = ("data", "step", "overruled", "charging", "quota", "depleted", "age")


class Outcome(NamedTuple):
    """The outcome of one mission slot, for each mission (N,) or each UAV (N, I).

    Attributes:
        acted: (N, I) whether the UAV was active in the slot.
        reward: (N, I) the reward of the slot; 0 for an inactive UAV.
        reward_terms: (N, I, 7) the terms of the reward, in the order of ``REWARD_TERMS``.
        end: (N, I) how the UAV's mission ended, an index of ``state.END_NAMES``.
        terminated: (N, I) whether the UAV ended in this slot because its quota was filled or its
            battery depleted.
        truncated: (N, I) whether the UAV ended in this slot because of ``max_slots``.
        overruled: (N, I) whether the safety controller overruled the UAV.
        collected: (N, I) data that the UAV collected in the slot [data units].
        team_collected: (N,) data that all UAVs of the mission collected in the slot [data units].
    """

    acted: np.ndarray
    reward: np.ndarray
    reward_terms: np.ndarray
    end: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    overruled: np.ndarray
    collected: np.ndarray
    team_collected: np.ndarray


def empty_outcome(shape: tuple[int, ...]) -> Outcome:
    """The outcome of a slot in which nothing happens, for (N, I) UAVs."""
    return Outcome(
        acted=np.zeros(shape, np.bool_),
        reward=np.zeros(shape),
        reward_terms=np.zeros((*shape, len(REWARD_TERMS))),
        end=np.zeros(shape, np.int64),
        terminated=np.zeros(shape, np.bool_),
        truncated=np.zeros(shape, np.bool_),
        overruled=np.zeros(shape, np.bool_),
        collected=np.zeros(shape),
        team_collected=np.zeros(shape[0]),
    )


class MissionStepper:
    """N missions of one scenario in progress.

    Attributes:
        space: The space from which each mission draws its parameters.
        state: The arrays of the missions.
        world: The nodes and the tables of the channel.
        indices: (N,) the indices 0 to N - 1 of the environments.
    """

    def __init__(self, scenario: Scenario | ScenarioSpace, num_envs: int, seed: int):
        self.space = spaces_of([scenario])[0]
        check_slotted([self.space])
        self.indices = np.arange(num_envs)
        fleet, nodes = self.space.uavs[1], len(self.space.nodes)
        self.world, self._ranges = world_of(self.space), ranges_of(self.space)
        self._constants, self._types = constants_of(self.space), types_of(self.space)
        lengths, kind = teeth_lengths([self.space]), self._constants.dtype
        self.state = empty_state(num_envs, fleet, nodes, lengths, kind)
        self._scratch = empty_scratch(fleet, nodes)
        self.start_at(seed, 0)

    @property
    def seed(self) -> int:
        """Seed of the missions to be launched."""
        return int(self._constants["seed"][0])

    @property
    def replication(self) -> int:
        """The next replication to be launched."""
        return self._next

    def start_at(self, seed: int, replication: int) -> None:
        """Make this replication of this seed the next mission to be launched.

        Raises:
            InputError: If one of them is out of range.
        """
        check_seed(seed, replication)
        self._constants["seed"], self._next = seed, replication

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
        check_seed(self.seed, self._next + len(environments) - 1)
        _launch(environments, self._next, self._constants, self._ranges, self._types, self.state)
        self._next += len(environments)

    def step(self, actions: np.ndarray) -> Outcome:
        """Run one slot of every environment.

        Args:
            actions: (N, I) integers 0..4, ignored where no UAV acts.
        """
        outcome = empty_outcome(self.state.uavs.shape)
        _step(self.state, self.world, self._scratch, actions, outcome)
        return outcome

    def records(self, environments: np.ndarray) -> Records:
        """The records of the missions in these environments, up to the present slot."""
        fleet = self.state.uavs.shape[1]
        records = empty_records(len(environments), fleet, self.space.is_extended)
        write_records(environments, self.state, records)
        return records


@kernel
def _launch(environments, first, constants, ranges, types, state):
    """Start the replications from ``first`` on in these environments."""
    for n in range(len(environments)):
        b = environments[n]
        state.missions[b] = constants[0]
        mission = state.missions[b]
        mission.replication = first + n
        rules.launch(
            mission, ranges, types,
            state.uavs[b], state.residual[b], state.sensors[b], state.teeth[b],
        )  # fmt: skip


@kernel
def _step(state, world, scratch, actions, out):
    """Run one slot of every mission and write the ``Outcome``."""
    nodes, mean_snr, order, means = world
    batches, search = scratch
    fleet = state.uavs.shape[1]
    arrivals = np.empty(len(world.nodes), np.int64)
    charged, collected = np.empty(fleet, np.int64), np.empty(fleet)
    for b in range(len(state.missions)):
        mission, uavs = state.missions[b], state.uavs[b]
        for i in range(fleet):
            u = uavs[i]
            u.action = actions[b, i]
            out.acted[b, i] = u.active
            charged[i], collected[i] = u.slots_charging, u.collected
        rules.advance(
            mission, uavs, state.residual[b], state.sensors[b], state.teeth[b], arrivals,
            nodes, mean_snr, order, means, batches, search,
        )  # fmt: skip
        out.team_collected[b] = mission.slot_collected
        for i in range(fleet):
            u, acted = uavs[i], out.acted[b, i]
            ended = acted and not u.active
            out.reward[b, i] = u.reward
            out.end[b, i] = u.end
            out.terminated[b, i] = ended and u.end != TRUNCATED
            out.truncated[b, i] = ended and u.end == TRUNCATED
            out.overruled[b, i] = u.overruled
            out.collected[b, i] = u.collected - collected[i]
            out.reward_terms[b, i] = 0.0
            if acted:
                terms = rules.reward_terms(mission, u, u.slots_charging > charged[i])
                for t in range(len(terms)):
                    out.reward_terms[b, i, t] = terms[t]


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
