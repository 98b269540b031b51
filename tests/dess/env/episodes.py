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


def play(env: HarvestEnv, actions_seed: int, **reset: Any) -> list[tuple]:
    """An episode of random legal actions: all that the environment returned."""
    generator = np.random.default_rng(actions_seed)
    observations, infos = env.reset(**reset)
    story: list[tuple] = [(observations, infos)]
    while env.agents:
        actions = {
            agent: generator.choice(np.nonzero(observations[agent]["action_mask"])[0])
            for agent in env.agents
        }
        observations, *rest = env.step(actions)
        story.append((observations, *rest))
    return story
