"""Scenarios, states and episodes that the tests of environments and observations share."""

from typing import Any

import numpy as np

from dess.envs.parallel import HarvestEnv
from dess.envs.stepper import MissionStepper
from dess.model.state import State
from dess.physics.chart import Chart
from dess.scenario.scenario import Scenario, ScenarioSpace, load_scenario

PAPER = load_scenario("paper")
# Two nodes, no shadowing, no arrivals, a zone in the corner: simple enough to work out by hand.
SMALL: dict[str, Any] = {
    **{"grid": 5, "nodes": ((0, 0), (4, 4)), "zone": (3, 0, 2, 2), "uavs": 1},
    **{"shadowing_variance": 0.0, "arrival_rate": 0.0, "initial_data": 1e6},
    **{"flying_time": 50, "charge_start": 20, "charge_complete": 60},
}


def small(**values: Any) -> Scenario:
    """The small scenario with other values."""
    return Scenario.of(**(SMALL | values))


def placed(uavs: list[dict[str, Any]], **scenario: Any) -> tuple[State, Chart]:
    """One mission with UAVs in given states, 400 communications short of the quota."""
    stepper = MissionStepper(
        ScenarioSpace.of(**{"uavs": len(uavs), "charge_start": 30} | scenario), 1, 1
    )
    stepper.launch(stepper.indices)
    for u, values in zip(stepper.state.uavs[0], uavs, strict=True):
        for name, value in ({"battery": 60, "communications": 40} | values).items():
            u[name] = value
        u["zone"] = stepper.world.chart.zones[u["y"], u["x"]]
    return stepper.state, stepper.world.chart


def masks_of(observations: dict[str, Any], infos: dict[str, Any]) -> dict[str, np.ndarray]:
    """The mask of each agent, from the info or else from the observation."""
    holders = {agent: infos if "action_mask" in infos[agent] else observations for agent in infos}
    return {agent: holder[agent]["action_mask"] for agent, holder in holders.items()}


def play(env: HarvestEnv, actions_seed: int, **reset: Any) -> list[tuple]:
    """An episode of random legal actions: all that the environment returned.

    A UAV that flies receives the same actions whether the others have left or stay.
    """
    generator = np.random.default_rng(actions_seed)
    observations, infos = env.reset(**reset)
    story: list[tuple] = [(observations, infos)]
    while env.agents:
        draws = dict(zip(env.possible_agents, generator.random(100), strict=False))
        masks = masks_of(observations, infos)
        actions = {}
        for agent in env.agents:
            allowed = np.flatnonzero(masks[agent])
            actions[agent] = int(allowed[int(draws[agent] * len(allowed))])
        observations, *rest, infos = env.step(actions)
        story.append((observations, *rest, infos))
    return story
