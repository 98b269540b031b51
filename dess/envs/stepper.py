"""Missions that advance slot by slot with actions that the caller gives; one per environment.

>>> stepper = MissionStepper(load_scenario("paper", uavs=2), num_envs=4, seed=1)
>>> stepper.launch(stepper.indices)    # replications 0 to 3
>>> outcome = stepper.step(np.full((4, 2), 4))    # all hover
"""

from collections.abc import Sequence
from secrets import randbits
from typing import Any

import numpy as np

from dess.base.errors import InputError
from dess.base.kernels import kernel
from dess.model import rules
from dess.model.batch import check_slotted
from dess.model.channel import empty_scratch, world_of
from dess.model.record import Records, empty_records_of, write_records
from dess.model.state import (
    ACTION_NAMES,
    TRUNCATED,
    check_seed,
    fields,
    spaces_of,
    starts_of,
    state_of,
)
from dess.model.ways import Ways
from dess.scenario.scenario import AnyScenario
from dess.scenario.weather import refuse_weather

# The terms of a reward, in the order of ``rules.reward_terms``.
REWARD_TERMS = ("data", "step", "overruled", "charging", "quota", "depleted", "age")

Seeds = int | Sequence[int] | np.ndarray  # one for all environments, or one for each

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

    All environments take the next replication of one seed, or each that of a seed of its own.

    Attributes:
        space: The space from which each mission draws its parameters.
        is_started: Whether missions have been launched.
        state: The arrays of the missions.
        world: The nodes and the tables of the channel.
        ways: The battery that the ways between cells take.
        indices: (N,) the indices 0 to N - 1 of the environments.
    """

    def __init__(self, scenario: AnyScenario, num_envs: int, seed: int | None):
        self.space = spaces_of([scenario])[0]
        check_slotted([self.space])
        refuse_weather([self.space.weather])
        self.indices = np.arange(num_envs)
        self.world = world_of(self.space)
        self.state = state_of([self.space], num_envs)
        self._starts = starts_of([self.space])
        self.ways = Ways(self._starts.constants, self.world.chart)
        self._scratch = empty_scratch(self.space.uavs[1], len(self.space.nodes))
        self.is_started = False
        self._is_seeded = seed is not None
        self.start_at(seed or 0, 0)

    @property
    def seed(self) -> int:
        """Seed of the missions to be launched; the first one if there are several."""
        return int(self._seeds[0])

    @property
    def replication(self) -> int:
        """The next replication of this seed to be launched."""
        return int(self._next[0])

    def start_at(self, seed: Seeds, replication: int) -> None:
        """Make this replication of this seed the next mission to be launched.

        Args:
            seed: A seed, or one for each environment.
            replication: The replication.

        Raises:
            InputError: If one of them is out of range, or there are not as many seeds.
        """
        seeds = [*seed] if isinstance(seed, Sequence | np.ndarray) else [seed]
        if len(seeds) != 1 and len(seeds) != len(self.indices):
            raise InputError(
                "seed",
                f"there are {len(seeds)}",
                f"an integer, or a list of {len(self.indices)}, one for each mission in progress",
            )
        for seed_of_mission in seeds:
            check_seed(seed_of_mission, replication)
        self._seeds = np.array(seeds, np.uint64)
        self._next = np.full(len(seeds), replication, np.int64)

    def start(self, seed: Seeds | None, options: dict[str, Any] | None) -> None:
        """Launch a mission in every environment, as ``reset`` of an environment is asked to.

        Args:
            seed: Start at replication 0 of this seed, or of one for each environment. If None, the
                numbering continues; where no seed was ever given, one is drawn.
            options: ``{"replication": r}`` starts at replication r; other keys are ignored.

        Raises:
            InputError: If a seed or the replication is out of range, or there are not as many
                seeds.
        """
        replication = (options or {}).get("replication")
        following = seed
        if seed is None and not self._is_seeded:
            # Drawn at each start, so that copies of an environment play missions of their own; a
            # number that every reader of a record can represent.
            following = randbits(53)
        elif seed is None and replication is not None:
            following = self._seeds
        if following is not None:
            self.start_at(following, 0 if replication is None else replication)
        self._is_seeded |= seed is not None
        self.launch(self.indices)

    def launch(self, environments: np.ndarray) -> None:
        """Start the next replications in these environments, in this order."""
        check_seed(0, int(self._next.max()) + len(environments) - 1)
        _launch(self.state, environments, self._starts, self._seeds, self._next)
        self.is_started = True

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
        records = empty_records_of([self.space], len(environments))
        write_records(environments, self.state, self.ways.home, records)
        return records


@kernel
def _launch(state, environments, starts, seeds, following):
    """Start the next replications of the seeds, of which there is one, or one per environment."""
    for b in environments:
        number = b % len(seeds)
        starts.constants[0].seed = seeds[number]
        rules.launch(state, b, starts, 0, following[number])
        following[number] += 1


@kernel
def _step(state, world, scratch, actions, out):
    """Run one slot of every mission and write the ``OUTCOME`` records."""
    fleet = state.uavs.shape[1]
    charged = np.empty(fleet, np.int64)
    collected = np.empty(fleet)
    for b in range(len(state.missions)):
        mission = state.missions[b]
        team = state.uavs[b]
        for i in range(fleet):
            u = team[i]
            u.action = actions[b, i]
            out[b, i].acted = u.active
            charged[i], collected[i] = u.slots_charging, u.collected
        rules.run_slot(state, b, world, scratch)
        for i in range(fleet):
            u = team[i]
            to = out[b, i]
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
        # The rest of a mission whose last UAV has ended belongs to the step.
        residual, sensors = state.residual[b], state.sensors[b]
        while rules.advance_without_uavs(mission, team, residual, sensors, scratch):
            pass


def checked_actions(actions: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Check actions and return them as an integer array.

    Raises:
        InputError: If they are not integers 0..4 of that shape.
    """
    try:
        array = np.asarray(actions)
    except ValueError:  # a list in the place of an integer
        raise InputError("actions", "are not all integers", f"integers of shape {shape}") from None
    if array.dtype.kind not in "iu" or array.shape != shape:
        raise InputError(
            "actions", f"{array.dtype} of shape {array.shape}", f"integers of shape {shape}"
        )
    wrong = array[array.astype(np.uint64) >= len(ACTION_NAMES)]  # negative ones become large
    if wrong.size:
        raise InputError("actions", f"{wrong[0]} is not an action", f"0..{len(ACTION_NAMES) - 1}")
    return array.astype(np.int64)
