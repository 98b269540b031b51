"""``vector_env``: many missions in lockstep as a Gymnasium ``VectorEnv`` with a row per UAV.

>>> env = vector_env(load_scenario("paper"), num_envs=64, seed=1)
>>> observations, info = env.reset()
>>> actions = env.action_space.sample()   # (R,)
>>> observations, rewards, terminated, truncated, info = env.step(actions)
"""

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from dess.base.errors import InputError, check_known
from dess.envs.observations.observer import Observation, Observer, rows_of
from dess.envs.options import with_known_options
from dess.envs.stepper import OUTCOME, MissionStepper, Seeds, checked_actions
from dess.model.record import Records
from dess.model.state import ACTION_NAMES, TRUNCATED, State
from dess.model.view import View, acting_rows
from dess.scenario.scenario import AnyScenario

_MODES = (AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP)
# What ``info`` has of ``OUTCOME``; the rest is in the other results of a step.
_INFOS = [n for n in OUTCOME.names or () if n not in ("reward", "terminated", "truncated")]


class HarvestVectorEnv(VectorEnv):
    """N missions in lockstep; each row is a UAV, so that one policy is shared by all UAVs.

    There are R = N x I rows, first the UAVs of mission 0; I is the largest fleet of the scenario.
    ``num_envs`` is R. The rows of UAVs that have ended, or that a smaller fleet does not have, are
    zeros with a mask of Hover alone, and their actions are ignored.

    The episode of a row is its mission: ``terminated`` (quota filled or battery depleted) or
    ``truncated`` (``max_slots`` reached) of all its UAVs come in the slot in which the last one
    ends; without a quota, this step also runs the rest of the mission, until ``max_slots``. By
    default the next mission starts in the same step (``metadata["autoreset_mode"]``), and its first
    observations are returned; the last ones are in ``info["final_obs"]``. With ``NextStep`` the
    last ones are returned; in the step after that the actions of these rows are ignored, the next
    mission starts, and its first observations are returned with reward 0.

    ``info`` has an array with R rows for each of: ``action_mask`` (R, 5) and ``active``, for the
    next step; ``replication`` of the mission in progress; and, after a step, the arrays of
    ``stepper.OUTCOME``, where ``acted`` tells which rows are transitions of a UAV. When missions
    have ended, it has ``final_info``, the record of the mission (``record.MISSION_RECORD``) and
    that of the UAV (``record.UAV_RECORD``) under ``uav``, and, with ``SameStep``, ``final_obs``;
    ``_final_info`` and ``_final_obs`` tell their rows.

    Missions are numbered in the order in which they start: replications 0 to N - 1 at the first
    reset, then one after the other, in a lower environment first. So a seed gives the sequence of
    missions 0, 1, 2, ... for every N, and a mission depends only on its number and on the actions
    of its UAVs.

    Attributes:
        missions: Number of missions in progress (N).
        num_envs: Number of rows (R).
        state: The arrays of the missions in progress; they must not be changed.
        world: The nodes and the tables of the channel.
    """

    @with_known_options
    def __init__(
        self,
        scenario: AnyScenario,
        num_envs: int,
        seed: int | None = None,
        observation: str = "vector",
        guarded: bool = False,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    ):
        """Make an environment.

        Args:
            scenario: The scenario, or the space from which each mission draws its parameters; or
                what ``load_scenario`` takes.
            num_envs: Number of missions in progress (N).
            seed: Seed of the missions, until ``reset`` is called with another seed. Without one,
                each ``reset`` draws one.
            observation: ``vector`` or ``maps``, the observations of the shipped learner,
                or ``state``, the components that
                ``dess.envs.observations.components.component_names`` lists.
            guarded: Whether the masks leave out what the return guard does not allow, as for the
                shipped learner.
            autoreset_mode: Whether the mission after one that has ended starts in the ``SameStep``
                or the ``NextStep``. Gymnasium's wrappers of observations need ``NextStep``.

        Raises:
            InputError: If one of the arguments is not allowed.
        """
        if autoreset_mode not in [name for mode in _MODES for name in (mode, mode.value)]:
            allowed = " or ".join(mode.value for mode in _MODES)
            raise InputError("autoreset_mode", repr(autoreset_mode), allowed)
        if not isinstance(num_envs, int | np.integer) or num_envs < 1:
            raise InputError("num_envs", f"{num_envs!r} is not allowed", "an integer >= 1")
        self.autoreset_mode = AutoresetMode(autoreset_mode)  # where TorchRL reads it
        self.metadata = {"autoreset_mode": self.autoreset_mode}
        self.missions = int(num_envs)
        self._stepper = MissionStepper(scenario, self.missions, seed)
        self._observer = Observer(self._stepper.space, observation, guarded)
        self.state = self._stepper.state
        self.world = self._stepper.world.shown()
        self.num_envs = self.state.uavs.size
        self.single_observation_space = self._observer.space
        self.single_action_space = spaces.Discrete(len(ACTION_NAMES))
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._mask = np.zeros((self.num_envs, len(ACTION_NAMES)), np.bool_)

    def reset(
        self, *, seed: Seeds | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start a new mission in every environment.

        Args:
            seed: Start at replication 0 of this seed. With a list of N seeds, mission n is
                replication 0 of the n-th one, and followed by the next ones of this seed. If None,
                the numbering continues.
            options: ``{"replication": r}`` starts at replication r.

        Raises:
            InputError: If a seed or the replication is out of range, there are not N seeds, or
                there is another option.
        """
        for name in options or ():
            check_known("options", name, ["replication"])
        self._stepper.start(seed, options)
        self._waiting = np.zeros(self.missions, np.bool_)  # over before the slot, with NextStep
        observations = self._observe(self.state.uavs["active"])
        return observations, self._present()

    def step(
        self, actions: np.ndarray
    ) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Run one mission slot of every mission.

        Args:
            actions: (R,) integers 0..4.

        Returns:
            Observations, rewards, terminated, truncated, each with R rows, and info.

        Raises:
            InputError: If ``reset`` was not called first, or the actions are not allowed.
        """
        if not self._stepper.is_started:
            raise InputError("step", "no mission is in progress", "reset() first")
        checked = checked_actions(actions, (self.num_envs,))
        outcome = self._stepper.step(checked.reshape(self.state.uavs.shape))
        rows = outcome.ravel()
        info: dict[str, Any] = {name: rows[name].copy() for name in _INFOS}
        terminated, truncated = np.zeros((2, self.num_envs), np.bool_)
        shown = outcome["acted"]
        if np.count_nonzero(self.state.missions["active"]) < self.missions:
            terminated, truncated, shown = self._turn(outcome, info)
        observations = self._observe(shown)
        info |= self._present()
        return observations, rows["reward"].copy(), terminated, truncated, info

    def action_masks(self) -> np.ndarray:
        """The (R, 5) mask of the actions that are allowed in the next step."""
        return self._mask

    def view(self) -> View:
        """The view that a policy's ``act`` takes, with a row per UAV that must act."""
        return View(
            self.state, self.world, *acting_rows(self.state.missions, self.state.uavs, 1, 0)
        )

    def _observe(self, shown: np.ndarray) -> Observation:
        observations, self._mask = self._observer.observe_all(self.state, shown)
        return observations

    def _turn(
        self, outcome: np.ndarray, info: dict[str, Any]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """After a slot, end the missions that are over, and start the next ones.

        Args:
            outcome: (N, I) ``OUTCOME`` records.
            info: The info of the step; records and last observations are added.

        Returns:
            (R,) terminated and truncated, and (N, I) the UAVs that observe something next.
        """
        active = self.state.uavs["active"]
        shown = outcome["acted"].copy()
        ended = (self.state.missions["active"] == 0) & ~self._waiting
        over = np.repeat(ended, active.shape[1])
        truncated = over & (outcome["end"].ravel() == TRUNCATED)
        if ended.any():
            info |= self._final(np.flatnonzero(ended), over, shown)
        is_same = self.autoreset_mode is AutoresetMode.SAME_STEP
        starting = np.flatnonzero(ended if is_same else self._waiting)
        self._stepper.launch(starting)
        self._waiting = self.state.missions["active"] == 0
        shown[starting] = active[starting]
        return over & ~truncated, truncated, shown

    def _final(self, ended: np.ndarray, over: np.ndarray, shown: np.ndarray) -> dict[str, Any]:
        """The records of the missions that have ended, and their last observations if needed."""
        records = self._by_row(over, self._stepper.records(ended))
        info: dict[str, Any] = {"final_info": records, "_final_info": over}
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            last = State(*(part[ended] for part in self.state))
            rows, _ = self._observer.observe_all(last, shown[ended])
            observations = np.empty(self.num_envs, object)
            observations[over] = np.fromiter(rows_of(rows), object, int(over.sum()))
            info |= {"final_obs": observations, "_final_obs": over}
        return info

    def _by_row(self, over: np.ndarray, records: Records) -> dict[str, Any]:
        """The records of the missions that are over as arrays, with zeros in the other rows."""
        missions = np.zeros(self.num_envs, records.missions.dtype)
        uavs = np.zeros(self.num_envs, records.uavs.dtype)
        missions[over] = np.repeat(records.missions, records.uavs.shape[1])
        uavs[over] = records.uavs.ravel()
        of_uav = {name: uavs[name] for name in uavs.dtype.names or ()}
        return {name: missions[name] for name in missions.dtype.names or ()} | {"uav": of_uav}

    def _present(self) -> dict[str, Any]:
        fleet = self.state.uavs.shape[1]
        return {
            "action_mask": self._mask,
            "active": self.state.uavs["active"].ravel(),
            "replication": self.state.missions["replication"].repeat(fleet),
        }


vector_env = HarvestVectorEnv
