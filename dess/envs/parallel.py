"""``parallel_env``: one mission as a PettingZoo ``ParallelEnv``.

>>> env = parallel_env(load_scenario("paper"), seed=1)
>>> observations, _ = env.reset()
>>> while env.agents:
...     actions = {agent: env.action_space(agent).sample() for agent in env.agents}
...     observations, rewards, terminated, truncated, infos = env.step(actions)
"""

from collections.abc import Iterator, Sequence
from copy import deepcopy
from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from dess.base.errors import InputError, check_known
from dess.envs.observations.components import Components, component_bounds
from dess.envs.observations.observer import Observer, rows_of
from dess.envs.options import with_known_options
from dess.envs.render import Window, draw
from dess.envs.stepper import OUTCOME, MissionStepper, checked_actions
from dess.model.record import MissionRecord
from dess.model.state import ACTION_NAMES, HOVER, TRUNCATED
from dess.scenario.scenario import AnyScenario

_MODES = ("rgb_array", "human")
_CHOICES = {"render_mode": _MODES, "mask": ("observation", "info"), "ended": ("leave", "stay")}


class HarvestEnv(ParallelEnv[str, Any, int]):
    """One mission as a PettingZoo ``ParallelEnv``; each UAV is an agent, from ``uav_0`` on.

    ``reset(seed=s)`` starts replication 0 of seed s and each further ``reset()`` the next
    replication, so a seed gives a reproducible sequence of episodes. ``options={"replication": r}``
    starts replication r. ``possible_agents`` is the largest fleet of the scenario.

    With ``ended="leave"``, ``reset`` sets ``agents`` to the fleet of the episode. In the step in
    which a UAV ends, its ``terminated`` is true (quota filled or battery depleted) or its
    ``truncated`` is true (``max_slots`` reached), and the UAV is removed from ``agents``. Without
    a quota, the step in which the last UAV ends also runs the rest of the mission.

    With ``ended="stay"``, ``agents`` are all possible agents until the mission is over; then all of
    them are terminated or truncated at once, each as it has ended. A UAV that has ended before, or
    that a smaller fleet does not have, observes zeros, has reward 0 and may only hover; whatever
    action it is given is ignored.

    ``info`` holds numbers and arrays, per agent: ``active``, whether the UAV acts next;
    ``reward_terms`` (7,), named by ``stepper.REWARD_TERMS``, of which the reward is the sum;
    ``collected`` and ``team_collected`` (data units of the slot); ``end``, an index of
    ``state.END_NAMES``; ``overruled``; and with ``mask="info"`` the ``action_mask`` (5,).
    """

    metadata: dict[str, Any] = {
        "name": "dess_harvest_v0",
        "render_modes": list(_MODES),
        "render_fps": 4,
        "is_parallelizable": True,
    }

    @with_known_options
    def __init__(
        self,
        scenario: AnyScenario,
        seed: int | None = None,
        render_mode: str | None = None,
        observation: str = "vector",
        mask: str = "observation",
        ended: str = "leave",
        guarded: bool = False,
    ):
        """Make an environment.

        Args:
            scenario: The scenario, or the space from which each episode draws its parameters; or
                what ``load_scenario`` takes.
            seed: Seed of the episodes, until ``reset`` is called with another seed. Without one,
                each ``reset`` draws one.
            render_mode: None, ``"rgb_array"``, or ``"human"`` for a window (needs matplotlib).
            observation: ``vector`` or ``maps``, the observations of the shipped learner,
                or ``state``, the components that
                ``dess.envs.observations.components.component_names`` lists.
            mask: Where the mask of the allowed actions is: in the ``observation``, a dictionary of
                ``observation`` and ``action_mask``, or in the ``info``.
            ended: Whether UAVs that have ended ``leave`` the agents, or ``stay`` until the mission
                is over.
            guarded: Whether the masks leave out what the return guard does not allow, as for the
                shipped learner.

        Raises:
            InputError: If one of the arguments is not allowed.
        """
        chosen = {"render_mode": render_mode or _MODES[0], "mask": mask, "ended": ended}
        for name, value in chosen.items():
            check_known(name, value, _CHOICES[name])
        self.render_mode = render_mode
        self._mask_in_info = mask == "info"
        self._stay = ended == "stay"
        self._stepper = MissionStepper(scenario, 1, seed)
        self._observer = Observer(self._stepper.space, observation, guarded)
        self._components = Components(self._stepper.space)
        self._window = None
        if render_mode == "human":
            self._window = Window()
        fleet = self._stepper.space.uavs[1]
        self.possible_agents = [f"uav_{i}" for i in range(fleet)]
        space = self._observer.space
        if not self._mask_in_info:
            allowed = spaces.MultiBinary(len(ACTION_NAMES))
            space = spaces.Dict({"observation": space, "action_mask": allowed})
        self._gather()
        self.observation_spaces = {agent: deepcopy(space) for agent in self.possible_agents}
        self.action_spaces = {a: spaces.Discrete(len(ACTION_NAMES)) for a in self.possible_agents}
        low, high = (np.tile(bound, fleet) for bound in component_bounds(self._stepper.space))
        self.state_space = spaces.Box(low, high, dtype=np.float32)

    def observation_space(self, agent: str) -> spaces.Space:
        """The observation space of an agent: the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space:
        """The action space of an agent: the same object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Start the next episode.

        Args:
            seed: Start at replication 0 of this seed. If None, the numbering continues.
            options: ``{"replication": r}`` starts replication r; other keys are ignored.

        Raises:
            InputError: If the seed or the replication is out of range.
        """
        self._stepper.start(seed, options)
        self._gather()
        if self._window:
            self.render()
        active = self._stepper.state.uavs["active"]
        return self._seen(np.zeros(active.shape, OUTCOME), active)

    def step(self, actions: dict[str, int]) -> tuple[dict, dict, dict, dict, dict]:
        """Run one mission slot.

        Args:
            actions: An action 0..4 for each of ``agents``.

        Returns:
            Observations, rewards, terminated, truncated and info of the agents that acted. They are
            empty if there are no agents and no actions, as PettingZoo's wrappers expect it.

        Raises:
            InputError: If no episode is in progress, or the actions are not those of ``agents``.
        """
        if not self.agents and not actions:
            return {}, {}, {}, {}, {}
        if not self._flying:
            raise InputError("step", "no episode is in progress", "reset() first")
        if not self._flying.keys() <= actions.keys() <= self._here.keys():
            pilots = list(self._flying)
            raise InputError("actions", f"of {sorted(actions)}", f"one of each of {pilots}")
        chosen = [HOVER] * len(self.possible_agents)
        for agent, i in self._flying.items():
            chosen[i] = actions[agent]
        outcome = self._stepper.step(checked_actions([chosen], (1, len(chosen))))
        observations, infos = self._seen(outcome, outcome["acted"])
        rewards = self._of_agents(outcome["reward"][0].tolist())
        terminated, truncated = map(self._of_agents, self._ends(outcome))
        self._gather()
        if self._window:
            self.render()
        return observations, rewards, terminated, truncated, infos

    def state(self) -> np.ndarray:
        """The state of all possible agents as one vector, for a centralised critic.

        It has the components of ``dess.envs.observations.components`` for one UAV after the other;
        those of UAVs that a smaller fleet does not have are zeros.
        """
        fleet = self._stepper.state.missions["uavs"][0]
        vector = np.zeros(self.state_space.shape, np.float32)
        (rows,) = self._components.encode(
            self._stepper.state, np.zeros(fleet, np.int64), np.arange(fleet)
        )
        vector[: rows.size] = rows.ravel()
        return vector

    def record(self) -> MissionRecord:
        """The record of the episode up to the present slot."""
        return self._stepper.records(self._stepper.indices).mission(0)

    def render(self) -> np.ndarray | None:
        """A picture (H, W, 3) of uint8, or None if it is shown in a window or not asked for."""
        if self.render_mode is None:
            return None
        picture = draw(self._stepper.space, self._stepper.state)
        if self._window:
            self._window.show(picture, 1 / self.metadata["render_fps"])
            return None
        return picture

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window:
            self._window.close()

    def _gather(self) -> None:
        """Set the agents of the next step: those who fly, or all until the mission is over."""
        active = self._stepper.state.uavs["active"][0].tolist()
        uavs = {agent: i for i, agent in enumerate(self.possible_agents)}
        self._flying = {agent: i for agent, i in uavs.items() if active[i]}
        self._here = uavs if self._stay and self._flying else self._flying
        self.agents = list(self._here)

    def _of_agents(self, values: Sequence[Any]) -> dict[str, Any]:
        """The values, one for each UAV, of those who are agents in this step."""
        return {agent: values[i] for agent, i in self._here.items()}

    def _ends(self, outcome: np.ndarray) -> tuple[list[bool], list[bool]]:
        """Who is terminated, and who is truncated."""
        if not self._stay:
            return outcome["terminated"][0].tolist(), outcome["truncated"][0].tolist()
        over = not self._stepper.state.missions["active"][0]
        truncated = [over and end == TRUNCATED for end in outcome["end"][0].tolist()]
        return [over and not cut for cut in truncated], truncated

    def _seen(
        self, outcome: np.ndarray, shown: np.ndarray
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """The observations and infos of the agents, after a slot."""
        state = self._stepper.state
        rows, masks = self._observer.observe_all(state, shown)
        masks = masks.view(np.int8)
        observed = rows_of(rows)
        infos = list(_infos(outcome, state.uavs["active"][0]))
        if self._mask_in_info:
            for info, mask in zip(infos, masks, strict=True):
                info["action_mask"] = mask
        else:
            observed = [
                {"observation": observation, "action_mask": mask}
                for observation, mask in zip(observed, masks, strict=True)
            ]
        return self._of_agents(observed), self._of_agents(infos)


parallel_env = HarvestEnv


def _infos(outcome: np.ndarray, active: np.ndarray) -> Iterator[dict[str, Any]]:
    """What ``info`` says of each UAV of a single mission, but for the mask."""
    names = ["collected", "team_collected", "end", "overruled"]
    rows = zip(active.tolist(), outcome[0]["reward_terms"], outcome[0][names].tolist(), strict=True)
    for flies, terms, values in rows:
        yield {"active": flies, "reward_terms": terms} | dict(zip(names, values, strict=True))
