"""``batch_env``: many missions in lockstep, with the interface of Gymnasium's vector environments.

env = batch_env(load_scenario("paper"), num_envs=256, seed=1)
observations, info = env.reset()
observations, rewards, terminated, truncated, info = env.step(actions)   # (256, I) actions
"""

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

from dess.env.observation import Observation, observation_names, observation_space, observe
from dess.env.stepper import MissionStepper, checked_actions
from dess.errors import InputError
from dess.scenario import Scenario, ScenarioSpace
from dess.state import ACTION_NAMES
from dess.view import View, acting_rows


def batch_env(scenario: Scenario | ScenarioSpace, num_envs: int, seed: int = 0) -> "BatchEnv":
    """An environment of many missions that advance together.

    Args:
        scenario: The scenario, or the space from which each mission draws its parameters.
        num_envs: Number of missions in progress (N).
        seed: Seed of the missions, until ``reset`` is called with another seed.

    Raises:
        InputError: If the seed or the number of missions is not allowed.
    """
    return BatchEnv(scenario, num_envs, seed)


class BatchEnv:
    """N missions in lockstep, with the conventions of Gymnasium's vector environments.

    Arrays have the shape (N, I, ...), first the mission, then the UAV; I is the largest fleet of
    the scenario. In a mission with fewer UAVs the last columns are unused. A UAV that has ended
    stays inactive until its mission ends. ``info["active"]`` (N, I) tells which UAVs act next; the
    actions of all others are ignored.

    An environment is reset within a step (``metadata["autoreset_mode"]``): when the last UAV of its
    mission ends, the environment starts the next mission and returns the first observation of that
    mission. ``info`` then has ``final_obs``, the last observations of the missions that ended, in
    the rows of their environments; ``_final_obs`` (N,), which tells these environments; and
    ``final_records``, the records of these missions in the order of their environments.

    Missions are numbered in the order in which they start: replications 0 to N - 1 at the first
    reset, then one after the other, in a lower environment first. So a seed gives the sequence of
    missions 0, 1, 2, ... for every N, and a mission depends only on its number and on the actions
    of its UAVs.

    Attributes:
        num_envs: Number of missions in progress (N).
        state: The arrays of the missions in progress; they must not be changed.
        world: The nodes and the tables of the channel.
        single_observation_space: The space of one UAV's observation.
        single_action_space: The space of one UAV's action.
        action_space: The space of all actions (N, I).
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(self, scenario: Scenario | ScenarioSpace, num_envs: int, seed: int):
        if not isinstance(num_envs, int) or num_envs < 1:
            raise InputError(f"num_envs: {num_envs!r} is not allowed; allowed: an integer >= 1")
        self.num_envs = num_envs
        self._stepper = MissionStepper(scenario, num_envs, seed)
        self.state, self.world = self._stepper.state, self._stepper.world
        self._components = len(observation_names(scenario))
        self.single_observation_space = observation_space(scenario)
        self.single_action_space = spaces.Discrete(len(ACTION_NAMES))
        self.action_space = spaces.MultiDiscrete(np.full(self.state.uavs.shape, len(ACTION_NAMES)))

    def reset(self, seed: int | None = None) -> tuple[Observation, dict[str, np.ndarray]]:
        """Start a new mission in every environment.

        Args:
            seed: Start at replication 0 of this seed. If None, the numbering continues.

        Returns:
            Observations, and info with ``active`` (N, I) and ``replication`` (N,).

        Raises:
            InputError: If the seed is out of range.
        """
        if seed is not None:
            self._stepper.start_at(seed, 0)
        self._stepper.launch(self._stepper.indices)
        return self._observe(self._stepper.indices), self._present()

    def step(
        self, actions: np.ndarray
    ) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Run one mission slot of every mission.

        Args:
            actions: (N, I) integers 0..4.

        Returns:
            Observations, rewards, terminated, truncated and info. Rewards, terminated and truncated
            are (N, I); terminated or truncated is true only in the step in which the UAV ends. Info
            has the other arrays of ``stepper.Outcome`` (where ``acted`` is true, the step is a
            transition of that UAV), ``active`` (N, I) and ``replication`` (N,) of the missions now
            in progress, and ``final_obs``, ``_final_obs`` and ``final_records`` of the missions
            that ended.

        Raises:
            InputError: If ``reset`` was not called first, or the actions are not allowed.
        """
        missions = self.state.missions
        if not missions["active"].all():
            raise InputError("step: no mission is in progress; call reset() first")
        info = self._stepper.step(checked_actions(actions, self.state.uavs.shape))._asdict()
        rewards, terminated, truncated = map(info.pop, ("reward", "terminated", "truncated"))
        over = missions["active"] == 0
        if over.any():
            done = np.nonzero(over)[0]
            info |= {"final_obs": self._observe(done), "_final_obs": over}
            info["final_records"] = self._stepper.records(done)
            self._stepper.launch(done)
        observations = self._observe(self._stepper.indices)
        return observations, rewards, terminated, truncated, info | self._present()

    def view(self) -> View:
        """The view that a policy's ``act`` takes, with a row per UAV that must act."""
        return View(
            self.state, self.world, *acting_rows(self.state.missions, self.state.uavs, 1, 0)
        )

    def close(self) -> None:
        """Do nothing, because the environment holds no resources."""

    def _observe(self, environments: np.ndarray) -> Observation:
        return observe(self.state, environments, self._components)

    def _present(self) -> dict[str, np.ndarray]:
        active, replication = self.state.uavs["active"], self.state.missions["replication"]
        return {"active": active.copy(), "replication": replication.copy()}
