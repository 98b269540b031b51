"""Environments for learners, over the rules that both engines use.

``parallel_env`` is a PettingZoo ``ParallelEnv`` of one mission, ``batch_env`` the vectorised form
that steps many. Both count replications: mission r of seed s is the one that ``dess.simulate``
runs for them, and the same actions lead to the same record, bit for bit.

An observation is the vector that ``dess.observation`` lays out, with a mask of the legal actions;
an action is 0 north, 1 east, 2 south, 3 west, 4 hover. A move off the grid is one that the safety
controller overrules. A UAV that charges hovers, whatever was asked, without a penalty.
"""

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from pettingzoo import ParallelEnv

from dess.errors import InputError
from dess.lanes import REWARD_TERMS, Lanes, Outcome
from dess.observation import (
    observation_bounds,
    observation_names,
    observation_space,
    observe,
)
from dess.picture import draw
from dess.record import MissionRecord
from dess.scenario import Scenario, ScenarioSpace
from dess.state import ACTION_NAMES, END_NAMES, HOVER
from dess.view import View, acting_rows

Observation = dict[str, np.ndarray]


def parallel_env(
    scenario: Scenario | ScenarioSpace, seed: int = 0, render_mode: str | None = None
) -> "HarvestEnv":
    """A PettingZoo environment of one mission.

    Args:
        scenario: The scenario, or the space that each episode draws its own from.
        seed: Seed of the episodes until ``reset`` is given another.
        render_mode: None or ``"rgb_array"``.

    Raises:
        InputError: If the seed or the render mode is not allowed.
    """
    return HarvestEnv(scenario, seed, render_mode)


def batch_env(scenario: Scenario | ScenarioSpace, num_envs: int, seed: int = 0) -> "BatchEnv":
    """An environment of many missions that step together.

    Args:
        scenario: The scenario, or the space that each mission draws its own from.
        num_envs: Missions under way (N).
        seed: Seed of the missions until ``reset`` is given another.

    Raises:
        InputError: If the seed or the number of missions is not allowed.
    """
    return BatchEnv(scenario, num_envs, seed)


class HarvestEnv(ParallelEnv[str, Observation, int]):
    """One mission as a PettingZoo ``ParallelEnv``; each UAV is an agent, ``uav_0`` the first.

    ``reset(seed=s)`` starts replication 0 of seed s and each further ``reset()`` the next
    replication, so a seed repeats whole sequences of episodes. ``options={"replication": r}`` goes
    to replication r.

    A UAV that ends reports ``terminated`` (quota or battery) or ``truncated`` (``max_slots``) in
    that step and is out of ``agents`` from then on. The ``possible_agents`` are the largest fleet
    of the scenario; ``reset`` puts those of the episode into ``agents``.

    ``info`` holds, per agent: ``reward_terms`` (their sum is the reward), ``collected`` and
    ``team_collected`` (data units of the slot), ``end`` (``active``, ``quota``, ``battery`` or
    ``truncated``) and ``overruled``.
    """

    metadata: dict[str, Any] = {
        "name": "dess_harvest_v0",
        "render_modes": ["rgb_array"],
        "render_fps": 4,
    }

    def __init__(self, scenario: Scenario | ScenarioSpace, seed: int, render_mode: str | None):
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode: {render_mode!r} is unknown; allowed: None, 'rgb_array'")
        self.render_mode = render_mode
        self._lanes = Lanes(scenario, 1, seed)
        fleet = self._lanes.space.uavs[1]
        self._components = len(observation_names(scenario))
        self.agents: list[str] = []
        self.possible_agents = [f"uav_{i}" for i in range(fleet)]
        self.observation_spaces = {a: observation_space(scenario) for a in self.possible_agents}
        self.action_spaces = {a: spaces.Discrete(len(ACTION_NAMES)) for a in self.possible_agents}
        low, high = (np.tile(bound, fleet) for bound in observation_bounds(scenario))
        self.state_space = spaces.Box(low, high, dtype=np.float32)

    def observation_space(self, agent: str) -> spaces.Space:
        """The observation space of an agent: the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space:
        """The action space of an agent: the same object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start the next episode.

        Args:
            seed: Start over with replication 0 of this seed.
            options: ``{"replication": r}`` starts replication r; other keys are ignored.

        Raises:
            InputError: If the seed or the replication is out of range.
        """
        lanes, replication = self._lanes, (options or {}).get("replication")
        if seed is not None or replication is not None:
            lanes.start_at(lanes.seed if seed is None else seed, replication or 0)
        lanes.launch(lanes.numbers)
        self.agents = self.possible_agents[: lanes.state.missions["uavs"][0]]
        return self._observations(), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, int]) -> tuple[dict, dict, dict, dict, dict]:
        """One mission slot.

        Args:
            actions: An action 0..4 for each of ``agents``.

        Returns:
            Observations, rewards, terminated, truncated and info of the agents that acted.

        Raises:
            InputError: If no episode is under way, or the actions are not those of ``agents``.
        """
        acting = self.agents
        if not acting:
            raise InputError("step: no episode is under way; call reset() first")
        if set(actions) != set(acting):
            raise InputError(f"actions: of {sorted(actions)}; allowed: one of each of {acting}")
        index = {agent: self.possible_agents.index(agent) for agent in acting}
        row = np.full((1, len(self.possible_agents)), HOVER)
        row[0, list(index.values())] = _checked([actions[a] for a in acting], (len(acting),))
        out = self._lanes.step(row)
        observations = self._observations()
        rewards = {a: float(out.reward[0, i]) for a, i in index.items()}
        terminated = {a: bool(out.terminated[0, i]) for a, i in index.items()}
        truncated = {a: bool(out.truncated[0, i]) for a, i in index.items()}
        self.agents = [a for a in acting if not (terminated[a] or truncated[a])]
        infos = {a: _info(out, i) for a, i in index.items()}
        return observations, rewards, terminated, truncated, infos

    def state(self) -> np.ndarray:
        """The observations of all possible agents one after the other, for a central critic."""
        return self._observe()["observation"].ravel()

    def record(self) -> MissionRecord:
        """The record of the episode, as far as it has come."""
        records = self._lanes.records(self._lanes.numbers)
        return MissionRecord(records.missions[0], records.uavs[0, : records.missions["uavs"][0]])

    def render(self) -> np.ndarray | None:
        """A picture (H, W, 3) of uint8; None without a ``render_mode``."""
        return draw(self._lanes.space, self._lanes.state) if self.render_mode else None

    def _observe(self) -> Observation:
        return observe(self._lanes.state, self._lanes.numbers, self._components)

    def _observations(self) -> dict[str, Observation]:
        """Of the agents that are acting or have just acted."""
        every = self._observe()
        rows = [self.possible_agents.index(agent) for agent in self.agents]
        return {self.possible_agents[i]: {key: every[key][0, i] for key in every} for i in rows}


class BatchEnv:
    """N missions in lockstep, after the conventions of Gymnasium's vector environments.

    Arrays are (N, I, ...): mission, then UAV; I is the largest fleet of the scenario. A mission
    with fewer UAVs has absent ones, and a UAV that has ended stays inactive until its mission is
    over: ``info["active"]`` (N, I) says who acts next. The actions of the others are ignored.

    A mission is reset automatically in the same step (``metadata["autoreset_mode"]``): when its
    last UAV ends, its lane starts the next mission, and the observation returned is the new one's
    first. ``info`` then has ``final_obs``, the last observations of the missions that are over, in
    the rows of their lanes; ``_final_obs`` (N,), which lanes these are; and ``final_records``,
    their records in the order of the lanes.

    Missions are numbered as they start: replications 0 to N - 1 at the first reset, then one after
    the other, lower lanes first. So a seed gives the sequence of missions 0, 1, 2, ... whatever N
    is, and how a mission goes depends on its number and the actions of its UAVs alone.

    Attributes:
        num_envs: Missions under way (N).
        state: The arrays of the missions under way, to be read only.
        world: The nodes and the path loss table.
        single_observation_space: The space of one UAV's observation.
        single_action_space: The space of one UAV's action.
        action_space: The space of all actions (N, I).
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(self, scenario: Scenario | ScenarioSpace, num_envs: int, seed: int):
        if not isinstance(num_envs, int) or num_envs < 1:
            raise InputError(f"num_envs: {num_envs!r} is not allowed; allowed: an integer >= 1")
        self.num_envs = num_envs
        self._lanes = Lanes(scenario, num_envs, seed)
        self.state, self.world = self._lanes.state, self._lanes.world
        self._components = len(observation_names(scenario))
        self.single_observation_space = observation_space(scenario)
        self.single_action_space = spaces.Discrete(len(ACTION_NAMES))
        self.action_space = spaces.MultiDiscrete(np.full(self.state.uavs.shape, len(ACTION_NAMES)))

    def reset(self, seed: int | None = None) -> tuple[Observation, dict[str, np.ndarray]]:
        """Start a new mission in every lane.

        Args:
            seed: Start over with replication 0 of this seed; without it, the numbering goes on.

        Returns:
            Observations, and info with ``active`` (N, I) and ``replication`` (N,).

        Raises:
            InputError: If the seed is out of range.
        """
        if seed is not None:
            self._lanes.start_at(seed, 0)
        self._lanes.launch(self._lanes.numbers)
        return self._observe(self._lanes.numbers), self._present()

    def step(
        self, actions: np.ndarray
    ) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One mission slot of every mission.

        Args:
            actions: (N, I) integers 0..4.

        Returns:
            Observations; rewards, terminated and truncated (N, I), the last two true in the step
            in which the UAV ends; and info: of the slot the other arrays of ``lanes.Outcome``, of
            which ``acted`` tells the rows that are transitions, of the missions now under way
            ``active`` (N, I) and ``replication`` (N,), and of those that are over ``final_obs``,
            ``_final_obs`` and ``final_records``.

        Raises:
            InputError: If ``reset`` was not called first, or the actions are not allowed.
        """
        missions = self.state.missions
        if not missions["active"].all():
            raise InputError("step: no missions are under way; call reset() first")
        info = self._lanes.step(_checked(actions, self.state.uavs.shape))._asdict()
        rewards, terminated, truncated = map(info.pop, ("reward", "terminated", "truncated"))
        over = missions["active"] == 0
        if over.any():
            done = np.nonzero(over)[0]
            info |= {"final_obs": self._observe(done), "_final_obs": over}
            info["final_records"] = self._lanes.records(done)
            self._lanes.launch(done)
        observations = self._observe(self._lanes.numbers)
        return observations, rewards, terminated, truncated, info | self._present()

    def view(self) -> View:
        """What the UAVs that must act see, as a policy is shown it."""
        return View(
            self.state, self.world, *acting_rows(self.state.missions, self.state.uavs, 1, 0)
        )

    def close(self) -> None:
        """Nothing is held open."""

    def _observe(self, lanes: np.ndarray) -> Observation:
        return observe(self.state, lanes, self._components)

    def _present(self) -> dict[str, np.ndarray]:
        active, replication = self.state.uavs["active"], self.state.missions["replication"]
        return {"active": active.copy(), "replication": replication.copy()}


def _checked(actions: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Actions as an integer array of that shape.

    Raises:
        InputError: If they are none.
    """
    array = np.asarray(actions)
    if array.dtype.kind not in "iu" or array.shape != shape:
        raise InputError(
            f"actions: {array.dtype} of shape {array.shape}; allowed: integers of shape {shape}"
        )
    wrong = array[(array < 0) | (array >= len(ACTION_NAMES))]
    if wrong.size:
        raise InputError(f"actions: {wrong[0]} is no action; allowed: 0..{len(ACTION_NAMES) - 1}")
    return array.astype(np.int64)


def _info(out: Outcome, i: int) -> dict[str, Any]:
    """What a step did to UAV ``i`` of a single mission, in plain Python."""
    return {
        "reward_terms": dict(zip(REWARD_TERMS, out.reward_terms[0, i].tolist(), strict=True)),
        "collected": float(out.collected[0, i]),
        "team_collected": float(out.team_collected[0]),
        "end": END_NAMES[out.end[0, i]],
        "overruled": bool(out.overruled[0, i]),
    }
