"""``parallel_env``: one mission as a PettingZoo ``ParallelEnv``.

env = parallel_env(load_scenario("paper"), seed=1)
observations, _ = env.reset()
while env.agents:
    actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    observations, rewards, terminated, truncated, infos = env.step(actions)
"""

from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from dess.env.observation import (
    Observation,
    observation_bounds,
    observation_names,
    observation_space,
    observe,
)
from dess.env.render import draw
from dess.env.stepper import REWARD_TERMS, MissionStepper, Outcome, checked_actions
from dess.errors import InputError
from dess.record import MissionRecord
from dess.scenario import Scenario, ScenarioSpace
from dess.state import ACTION_NAMES, END_NAMES, HOVER


def parallel_env(
    scenario: Scenario | ScenarioSpace, seed: int = 0, render_mode: str | None = None
) -> "HarvestEnv":
    """A PettingZoo environment of one mission.

    Args:
        scenario: The scenario, or the space from which each episode draws its parameters.
        seed: Seed of the episodes, until ``reset`` is called with another seed.
        render_mode: None or ``"rgb_array"``.

    Raises:
        InputError: If the seed or the render mode is not allowed.
    """
    return HarvestEnv(scenario, seed, render_mode)


class HarvestEnv(ParallelEnv[str, Observation, int]):
    """One mission as a PettingZoo ``ParallelEnv``; each UAV is an agent, from ``uav_0`` on.

    ``reset(seed=s)`` starts replication 0 of seed s and each further ``reset()`` the next
    replication, so a seed gives a reproducible sequence of episodes. ``options={"replication": r}``
    starts replication r.

    In the step in which a UAV ends, its ``terminated`` is true (quota filled or battery depleted)
    or its ``truncated`` is true (``max_slots`` reached), and the UAV is removed from ``agents``.
    ``possible_agents`` is the largest fleet of the scenario; ``reset`` sets ``agents`` to the fleet
    of the episode.

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
        self._stepper = MissionStepper(scenario, 1, seed)
        fleet = self._stepper.space.uavs[1]
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
            seed: Start at replication 0 of this seed. If None, the numbering continues.
            options: ``{"replication": r}`` starts replication r; other keys are ignored.

        Raises:
            InputError: If the seed or the replication is out of range.
        """
        stepper, replication = self._stepper, (options or {}).get("replication")
        if seed is not None or replication is not None:
            stepper.start_at(stepper.seed if seed is None else seed, replication or 0)
        stepper.launch(stepper.indices)
        self.agents = self.possible_agents[: stepper.state.missions["uavs"][0]]
        return self._observations(), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, int]) -> tuple[dict, dict, dict, dict, dict]:
        """Run one mission slot.

        Args:
            actions: An action 0..4 for each of ``agents``.

        Returns:
            Observations, rewards, terminated, truncated and info of the agents that acted.

        Raises:
            InputError: If no episode is in progress, or the actions are not those of ``agents``.
        """
        acting = self.agents
        if not acting:
            raise InputError("step: no episode is in progress; call reset() first")
        if set(actions) != set(acting):
            raise InputError(f"actions: of {sorted(actions)}; allowed: one of each of {acting}")
        index = {agent: self.possible_agents.index(agent) for agent in acting}
        row = np.full((1, len(self.possible_agents)), HOVER)
        row[0, list(index.values())] = checked_actions([actions[a] for a in acting], (len(acting),))
        out = self._stepper.step(row)
        observations = self._observations()
        rewards = {a: float(out.reward[0, i]) for a, i in index.items()}
        terminated = {a: bool(out.terminated[0, i]) for a, i in index.items()}
        truncated = {a: bool(out.truncated[0, i]) for a, i in index.items()}
        self.agents = [a for a in acting if not (terminated[a] or truncated[a])]
        infos = {a: _info(out, i) for a, i in index.items()}
        return observations, rewards, terminated, truncated, infos

    def state(self) -> np.ndarray:
        """The concatenated observations of all possible agents, for a centralised critic."""
        return self._observe()["observation"].ravel()

    def record(self) -> MissionRecord:
        """The record of the episode up to the present slot."""
        records = self._stepper.records(self._stepper.indices)
        return MissionRecord(records.missions[0], records.uavs[0, : records.missions["uavs"][0]])

    def render(self) -> np.ndarray | None:
        """A picture (H, W, 3) of uint8; None without a ``render_mode``."""
        return draw(self._stepper.space, self._stepper.state) if self.render_mode else None

    def _observe(self) -> Observation:
        return observe(self._stepper.state, self._stepper.indices, self._components)

    def _observations(self) -> dict[str, Observation]:
        """The observations of the agents that act or acted in this step."""
        arrays = self._observe()
        rows = [self.possible_agents.index(agent) for agent in self.agents]
        return {self.possible_agents[i]: {key: arrays[key][0, i] for key in arrays} for i in rows}


def _info(out: Outcome, i: int) -> dict[str, Any]:
    """The outcome of a step for UAV ``i`` of a single mission, as plain values."""
    return {
        "reward_terms": dict(zip(REWARD_TERMS, out.reward_terms[0, i].tolist(), strict=True)),
        "collected": float(out.collected[0, i]),
        "team_collected": float(out.team_collected[0]),
        "end": END_NAMES[out.end[0, i]],
        "overruled": bool(out.overruled[0, i]),
    }
