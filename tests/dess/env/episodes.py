"""Scenarios and episodes that the tests of the environments share."""

from typing import Any

import numpy as np

from dess.env.parallel import HarvestEnv
from dess.scenario import Scenario, load_scenario

PAPER = load_scenario("paper")
# Two nodes, no shadowing, no arrivals, a zone in the corner: simple enough to work out by hand.
SMALL: dict[str, Any] = {
    "grid": 5,
    "nodes": ((0, 0), (4, 4)),
    "zone": (3, 0, 2, 2),
    "shadowing_variance": 0.0,
    "arrival_rate": 0.0,
    "initial_data": 1e6,
    "uavs": 1,
    "flying_time": 50,
    "charge_start": 20,
    "charge_complete": 60,
}


def small(**values: Any) -> Scenario:
    """The small scenario with other values."""
    return Scenario.of(**(SMALL | values))


def masks_of(observations: dict[str, Any], infos: dict[str, Any]) -> dict[str, np.ndarray]:
    """The mask of each agent, from the info or else from the observation."""
    return {
        agent: info["action_mask"] if "action_mask" in info else observations[agent]["action_mask"]
        for agent, info in infos.items()
    }


def play(env: HarvestEnv, actions_seed: int, **reset: Any) -> list[tuple]:
    """An episode of random legal actions: all that the environment returned.

    A UAV that flies receives the same actions whether the others have left or stay.
    """
    generator = np.random.default_rng(actions_seed)
    observations, infos = env.reset(**reset)
    story: list[tuple] = [(observations, infos)]
    while env.agents:
        draws = dict(
            zip(env.possible_agents, generator.random(len(env.possible_agents)), strict=True)
        )
        masks = masks_of(observations, infos)
        actions = {}
        for agent in env.agents:
            allowed = np.flatnonzero(masks[agent])
            actions[agent] = int(allowed[int(draws[agent] * len(allowed))])
        observations, *rest, infos = env.step(actions)
        story.append((observations, *rest, infos))
    return story
