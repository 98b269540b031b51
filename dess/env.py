"""Environments for learners, over the rules that both engines use.

``parallel_env`` is a PettingZoo ``ParallelEnv`` of one mission, ``batch_env`` its vectorised form of
many. Both count replications: mission r of seed s is the one that ``simulate(scenario, ..., s, r)``
runs, and the same actions lead to the same record, bit for bit.

An observation is a vector of float32 in the order of ``observation_names``; an action is 0 north,
1 east, 2 south, 3 west, 4 hover. A UAV that charges hovers, whatever was asked, without a penalty.
"""

from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numba import njit
from pettingzoo import ParallelEnv

from dess import rules
from dess.errors import InputError
from dess.record import MissionRecord, Records, empty_records, write_record
from dess.scenario import Scenario, ScenarioSpace
from dess.state import (
    ACTION_NAMES,
    ACTIVE,
    BATTERY,
    END_NAMES,
    HOVER,
    QUOTA,
    TRUNCATED,
    check_seed,
    constants_of,
    empty_scratch,
    empty_state,
    ranges_of,
    spaces_of,
    world_of,
)
from dess.view import View, acting_rows, legal_actions

# The parts of a reward (eq. 14-18), in the order in which they are added.
REWARD_TERMS = ("data", "step", "overruled", "charging", "quota", "depleted")

# The observation of a UAV: its own state, the scenario's parameters and the clock, then the residual
# data of the nodes, then its team mates in the order of their numbers.
_OWN = (
    "active",
    "x",
    "y",
    "battery",
    "quota",
    "latch",
    "charging",
    "waiting",
    "zone_dx",  # to the nearest cell of the zone
    "zone_dy",
    "charge_start",
    "charge_complete",
    "slot",
)
_MATE = ("active", "dx", "dy", "battery", "quota", "charging")  # zeros once it has ended

Observations = dict[str, np.ndarray]


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


def observation_names(scenario: Scenario | ScenarioSpace) -> list[str]:
    """The names of the F components of an observation.

    Cells are divided by the grid's last index, the battery, C_S and C_C by 100, communications by the
    quota, the slot by ``max_slots``, residual data by the high end of ``initial_data``.
    """
    space = spaces_of([scenario])[0]
    nodes = [f"residual_{k}" for k in range(len(space.nodes))]
    mates = [f"mate_{j}_{name}" for j in range(1, space.uavs[1]) for name in _MATE]
    return [*_OWN, *nodes, *mates]


class Outcome(NamedTuple):
    """What one mission slot did, per mission (N,) and per UAV (N, I).

    Attributes:
        acted: (N, I) whether the UAV was active in the slot.
        reward: (N, I) of the slot; 0 without having acted.
        reward_terms: (N, I, 6) its parts, in the order of ``REWARD_TERMS``.
        end: (N, I) how the UAV's mission ended, an index of ``state.END_NAMES``.
        terminated: (N, I) whether it ended in this slot, by its quota or its battery.
        truncated: (N, I) whether it ended in this slot, by ``max_slots``.
        overruled: (N, I) whether the safety controller overruled it.
        collected: (N, I) data that the UAV collected in the slot [data units].
        team_collected: (N,) data that its team collected.
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


class _Lanes:
    """N missions under way; what both environments stand on."""

    def __init__(self, scenario: Scenario | ScenarioSpace, lanes: int, seed: int):
        self.space = spaces_of([scenario])[0]
        self.fleet, nodes = self.space.uavs[1], len(self.space.nodes)
        self.world, self.ranges = world_of(self.space), ranges_of(self.space)
        self.constants = constants_of(self.space)
        self.state, self.scratch = empty_state(lanes, self.fleet, nodes), empty_scratch(self.fleet, nodes)
        self.all = np.arange(lanes)
        self.components = len(observation_names(self.space))
        self.seed(seed, 0)

    def seed(self, seed: int, replication: int) -> None:
        """The next mission to be launched is this replication of this seed."""
        check_seed(seed, replication)
        self.constants["seed"], self.replication = seed, replication

    def launch(self, lanes: np.ndarray) -> None:
        """Put the next replications into these lanes, in this order."""
        check_seed(int(self.constants["seed"][0]), self.replication + len(lanes) - 1)
        _launch(lanes, self.replication, self.constants, self.ranges, self.state)
        self.replication += len(lanes)

    def step(self, actions: np.ndarray) -> Outcome:
        """One mission slot of every lane; (N, I) actions, those of UAVs that do not act ignored."""
        shape = actions.shape
        outcome = Outcome(
            acted=np.empty(shape, np.bool_),
            reward=np.empty(shape),
            reward_terms=np.empty((*shape, len(REWARD_TERMS))),
            end=np.empty(shape, np.int64),
            terminated=np.empty(shape, np.bool_),
            truncated=np.empty(shape, np.bool_),
            overruled=np.empty(shape, np.bool_),
            collected=np.empty(shape),
            team_collected=np.empty(shape[0]),
        )
        _step(self.state, self.world, self.scratch, actions, outcome)
        return outcome

    def observe(self, lanes: np.ndarray, lanes_out: int) -> Observations:
        """The observations of these lanes, in arrays of ``lanes_out`` rows; other rows are zeros."""
        shape = (lanes_out, self.fleet)
        vector = np.zeros((*shape, self.components), np.float32)
        mask = np.zeros((*shape, len(ACTION_NAMES)), np.int8)
        _observe(self.state, lanes, vector, mask)
        return {"observation": vector, "action_mask": mask}

    def records(self, lanes: np.ndarray) -> Records:
        """The records of these lanes' missions, as far as they have come."""
        records = empty_records(len(lanes), self.fleet)
        for row, lane in enumerate(lanes):
            write_record(*(part[lane] for part in self.state), records.missions[row], records.uavs[row])
        return records

    def observation_space(self) -> spaces.Dict:
        """The space of one UAV's observation."""
        low, high = np.zeros(self.components, np.float32), np.ones(self.components, np.float32)
        for index, name in enumerate(observation_names(self.space)):
            if name.endswith(("dx", "dy")):
                low[index] = -1.0
            elif name.startswith("residual"):  # new data arrives without a bound
                high[index] = np.inf
        vector = spaces.Box(low, high, dtype=np.float32)
        return spaces.Dict({"observation": vector, "action_mask": spaces.MultiBinary(len(ACTION_NAMES))})


class HarvestEnv(ParallelEnv[str, Observations, int]):
    """One mission as a PettingZoo ``ParallelEnv``; each UAV is an agent, ``uav_0`` the first.

    ``reset(seed=s)`` starts replication 0 of seed s, each further ``reset()`` the next replication, so a
    seed repeats whole sequences of episodes; ``reset(options={"replication": r})`` goes to replication r.
    A UAV that ends reports ``terminated`` (quota or battery) or ``truncated`` (``max_slots``) in that
    step and is out of ``agents`` from then on. A space with a range of fleet sizes has the largest as
    ``possible_agents``; ``reset`` puts those of the episode into ``agents``.

    ``info`` holds, per agent: ``reward_terms`` (a dictionary whose values sum to the reward),
    ``collected`` and ``team_collected`` (data units of the slot), ``end`` (``active``, ``quota``,
    ``battery`` or ``truncated``) and ``overruled``.
    """

    metadata = {"name": "dess_harvest_v0", "render_modes": ["rgb_array"], "render_fps": 4}

    def __init__(self, scenario: Scenario | ScenarioSpace, seed: int, render_mode: str | None):
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode: {render_mode!r} is unknown; allowed: None, 'rgb_array'")
        self.render_mode = render_mode
        self._lanes = _Lanes(scenario, 1, seed)
        self.agents: list[str] = []
        self.possible_agents = [f"uav_{i}" for i in range(self._lanes.fleet)]
        self.observation_spaces: dict = {a: self._lanes.observation_space() for a in self.possible_agents}
        self.action_spaces: dict = {a: spaces.Discrete(len(ACTION_NAMES)) for a in self.possible_agents}
        one = self.observation_spaces["uav_0"]["observation"]
        self.state_space = spaces.Box(
            np.tile(one.low, self._lanes.fleet), np.tile(one.high, self._lanes.fleet), dtype=np.float32
        )

    def observation_space(self, agent: str) -> spaces.Space:
        """The observation space of an agent: the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space:
        """The action space of an agent: the same object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observations], dict[str, dict[str, Any]]]:
        """Start the next episode.

        Args:
            seed: Start over with replication 0 of this seed.
            options: ``{"replication": r}`` starts replication r; other keys are ignored.

        Raises:
            InputError: If the seed or the replication is out of range.
        """
        lanes = self._lanes
        asked = (options or {}).get("replication")
        if seed is not None or asked is not None:
            lanes.seed(int(lanes.constants["seed"][0]) if seed is None else seed, asked or 0)
        lanes.launch(lanes.all)
        self.agents = self.possible_agents[: int(lanes.state.missions["uavs"][0])]
        return self._observations(), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, int]) -> tuple[dict, dict, dict, dict, dict]:
        """One mission slot.

        Args:
            actions: An action 0..4 for each of ``agents``.

        Returns:
            Observations, rewards, terminated, truncated and info of the agents that acted.

        Raises:
            InputError: If the episode is over, or an action is missing, too many or not allowed.
        """
        acting = self.agents
        if not acting:
            raise InputError("step: no episode is under way; call reset() first")
        if set(actions) != set(acting):
            raise InputError(f"actions: of {', '.join(actions)}; allowed: of {', '.join(acting)}")
        chosen = _checked([actions[agent] for agent in acting], (len(acting),))
        row = np.full((1, self._lanes.fleet), HOVER)
        row[0, [self.possible_agents.index(agent) for agent in acting]] = chosen
        out = self._lanes.step(row)
        result = self._observations(), *({} for _ in range(4))
        for i, agent in enumerate(self.possible_agents):
            if agent in acting:
                _, rewards, terminated, truncated, infos = result
                rewards[agent] = float(out.reward[0, i])
                terminated[agent] = bool(out.terminated[0, i])
                truncated[agent] = bool(out.truncated[0, i])
                infos[agent] = _info(out, i)
        self.agents = [a for a in acting if not (terminated[a] or truncated[a])]
        return result

    def state(self) -> np.ndarray:
        """The observations of all possible agents, one after the other, for a central critic."""
        return self._lanes.observe(self._lanes.all, 1)["observation"].ravel()

    def record(self) -> MissionRecord:
        """The record of the episode, as far as it has come."""
        records = self._lanes.records(self._lanes.all)
        fleet = int(records.missions["uavs"][0])
        return MissionRecord(records.missions[0], records.uavs[0, :fleet])

    def render(self) -> np.ndarray | None:
        """A picture of the mission, if ``render_mode`` is ``"rgb_array"``: (H, W, 3) of uint8."""
        return None if self.render_mode is None else _picture(self._lanes)

    def _observations(self) -> dict[str, Observations]:
        """Of the present agents."""
        every = self._lanes.observe(self._lanes.all, 1)
        rows = [(agent, self.possible_agents.index(agent)) for agent in self.agents]
        return {agent: {key: every[key][0, i] for key in every} for agent, i in rows}


class BatchEnv:
    """N missions in lockstep, after the conventions of Gymnasium's vector environments.

    Arrays are (N, I, ...): mission, then UAV; I is the largest fleet of the scenario. A mission with
    fewer UAVs has absent ones, and a UAV that has ended stays inactive until its mission is over:
    ``info["active"]`` (N, I) says who must act next. The actions of the others are ignored.

    Automatic reset is of the same step (``metadata["autoreset_mode"]``): when a mission's last UAV ends,
    its lane starts the next mission at once and the observation returned is the new one's first.
    ``info`` then has ``final_obs``, the last observations of the missions that are over,
    ``_final_obs`` (N,), which these are, and ``final_records``, their records in the order of the
    lanes. While its mission goes on, the last observation of a UAV that has ended is the one returned.

    Missions are numbered in the order in which they start: replications 0 to N - 1 at the first reset,
    then one after the other, lower lanes first. So the sequence of missions that a seed gives is
    always 0, 1, 2, ..., whatever N is, and how a mission goes depends on its number and its actions alone.

    Attributes:
        num_envs: Missions under way (N).
        state: The arrays of the missions under way, to be read.
        world: The nodes and the path loss table.
        single_observation_space, single_action_space: Spaces of one UAV.
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(self, scenario: Scenario | ScenarioSpace, num_envs: int, seed: int):
        if not isinstance(num_envs, int) or num_envs < 1:
            raise InputError(f"num_envs: {num_envs!r}; allowed: an integer >= 1")
        self._lanes = _Lanes(scenario, num_envs, seed)
        self.num_envs = num_envs
        self.state, self.world = self._lanes.state, self._lanes.world
        self.single_observation_space = self._lanes.observation_space()
        self.single_action_space = spaces.Discrete(len(ACTION_NAMES))
        self.action_space = spaces.MultiDiscrete(np.full((num_envs, self._lanes.fleet), len(ACTION_NAMES)))

    def reset(self, seed: int | None = None) -> tuple[Observations, dict[str, Any]]:
        """Start a new mission in every lane.

        Args:
            seed: Start over with replication 0 of this seed; without it, the numbering goes on.

        Raises:
            InputError: If the seed is out of range.
        """
        if seed is not None:
            self._lanes.seed(seed, 0)
        self._lanes.launch(self._lanes.all)
        return self._lanes.observe(self._lanes.all, self.num_envs), self._numbers()

    def step(
        self, actions: np.ndarray
    ) -> tuple[Observations, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One mission slot of every mission.

        Args:
            actions: (N, I) integers 0..4.

        Returns:
            Observations; rewards, terminated and truncated (N, I), the last two true in the step in
            which the UAV ends; info, with the other arrays of ``Outcome`` (``acted`` says which rows
            are transitions), ``active`` (N, I), ``replication`` (N,), and of missions that are over
            ``final_obs``, ``_final_obs`` and ``final_records``.

        Raises:
            InputError: If ``reset`` was not called first, or the actions are not allowed.
        """
        if not self.state.missions["active"].all():
            raise InputError("step: no missions are under way; call reset() first")
        out = self._lanes.step(_checked(actions, (self.num_envs, self._lanes.fleet)))
        info: dict[str, Any] = out._asdict()
        rewards, terminated, truncated = (info.pop(k) for k in ("reward", "terminated", "truncated"))
        over = self.state.missions["active"] == 0
        if over.any():
            done = np.nonzero(over)[0]
            info["final_obs"], info["_final_obs"] = self._lanes.observe(done, self.num_envs), over
            info["final_records"] = self._lanes.records(done)
            self._lanes.launch(done)
        observations = self._lanes.observe(self._lanes.all, self.num_envs)
        return observations, rewards, terminated, truncated, info | self._numbers()

    def view(self) -> View:
        """What the UAVs that must act see, as a policy is shown it."""
        return View(self.state, self.world, *acting_rows(self.state.missions, self.state.uavs, 1, 0))

    def close(self) -> None:
        """Nothing to close."""

    def _numbers(self) -> dict[str, np.ndarray]:
        return {
            "active": self.state.uavs["active"].copy(),
            "replication": self.state.missions["replication"].copy(),
        }


def _checked(actions: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Actions as an integer array of that shape, refused if they are none."""
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
