"""Speed of the environments on the paper's scenario, in steps of agents per second.

An agent's step is a mission slot in which it is active; its observation and mask are included, and
the choice of a random allowed action. Missions that end are followed by the next.

The environment of the paper's ref. 12 is measured too if the environment variable ``DESS_UDH`` has
the path of a clone of https://github.com/hbayerlein/uav_data_harvesting.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dess import load_scenario, parallel_env, vector_env
from dess.envs.observations import observer
from dess.envs.vector import HarvestVectorEnv

SCENARIO, SEED = load_scenario("paper"), 5
STEPS = {1: 2000, 64: 400, 1024: 60}  # of all missions, per round, by the number of missions
ROUNDS, WARM_UP = 8, 50  # in the warm-up the first missions become of different ages


def chosen(masks: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """A random allowed action for each row of masks."""
    return np.where(masks, generator.random(masks.shape, np.float32), -1.0).argmax(1)


def measure(benchmark: Any, play: Callable[[], int]) -> None:
    """Measure a function that plays some steps and returns how many steps agents made."""
    counts = []
    benchmark.pedantic(lambda: counts.append(play()), rounds=ROUNDS, warmup_rounds=1)
    # Rounds differ a little in how many agents act.
    benchmark.extra_info["uav_slots"] = sum(counts) // len(counts)


def steps_of(env: HarvestVectorEnv, steps: int) -> Callable[[], int]:
    """A function that makes steps in an environment and counts those of agents."""
    generator = np.random.default_rng(SEED)
    env.reset()

    def play(steps: int = steps) -> int:
        agents = 0
        for _ in range(steps):
            *_, info = env.step(chosen(env.action_masks(), generator))
            agents += int(np.count_nonzero(info["acted"]))
        return agents

    play(WARM_UP)
    return play


@pytest.mark.parametrize("num_envs", STEPS)
@pytest.mark.parametrize("observation", observer.KINDS)
def test_vector_env(benchmark, observation: str, num_envs: int) -> None:
    """Many missions in one process, without threads."""
    if num_envs == 1 and observation != "vector":
        pytest.skip("is the time of Python, as with the vector")
    env = vector_env(SCENARIO, num_envs, SEED, observation)
    measure(benchmark, steps_of(env, STEPS[num_envs]))


def test_choice_of_actions(benchmark) -> None:
    """The part of the time that the choice of the actions takes, with 1024 missions."""
    env, generator = vector_env(SCENARIO, 1024, SEED), np.random.default_rng(SEED)
    _, info = env.reset()
    masks, active = env.action_masks(), int(info["active"].sum())
    benchmark.extra_info["uav_slots"] = active
    benchmark(chosen, masks, generator)


def test_physics(benchmark) -> None:
    """The missions alone, 1024 of them, with random actions on the grid."""
    env, generator = vector_env(SCENARIO, 1024, SEED), np.random.default_rng(SEED)
    steps_of(env, 1)
    missions, shape = env._stepper, env.state.uavs.shape

    def play() -> int:
        agents = 0
        for _ in range(STEPS[1024]):
            outcome = missions.step(generator.integers(0, 5, shape))
            agents += int(np.count_nonzero(outcome["acted"]))
            missions.launch(np.flatnonzero(env.state.missions["active"] == 0))
        return agents

    measure(benchmark, play)


@pytest.mark.parametrize("observation", observer.KINDS)
def test_observation(benchmark, observation: str) -> None:
    """The observations and masks alone, of 1024 missions."""
    env = vector_env(SCENARIO, 1024, SEED, observation)
    steps_of(env, 1)
    shown = env.state.uavs["active"].copy()
    benchmark.extra_info["uav_slots"] = int(np.count_nonzero(shown))
    benchmark(env._observer.observe_all, env.state, shown)


@pytest.mark.parametrize("ended", ["leave", "stay"])
def test_parallel_env(benchmark, ended: str) -> None:
    """One mission, with dictionaries."""
    env = parallel_env(SCENARIO, SEED, ended=ended)
    generator = np.random.default_rng(SEED)
    observations, infos = env.reset()

    def play() -> int:
        nonlocal observations, infos
        agents = 0
        for _ in range(STEPS[1]):
            if not env.agents:
                observations, infos = env.reset()
            agents += sum(info["active"] for info in infos.values())
            masks = np.array([observations[agent]["action_mask"] for agent in env.agents])
            actions = dict(zip(env.agents, chosen(masks, generator).tolist(), strict=True))
            observations, _, _, _, infos = env.step(actions)
        return agents

    measure(benchmark, play)


@pytest.mark.parametrize("num_envs", STEPS)
def test_stable_baselines3(benchmark, num_envs: int) -> None:
    """``vector_env`` as a ``VecEnv`` of stable-baselines3, with its masks."""
    pytest.importorskip("stable_baselines3")
    from dess.envs.integrations.sb3 import SB3VecEnv

    inner = vector_env(SCENARIO, num_envs, SEED)
    env, generator = SB3VecEnv(inner), np.random.default_rng(SEED)
    env.reset()

    def play() -> int:
        agents = 0
        for _ in range(STEPS[num_envs]):
            masks = np.stack(env.env_method("action_masks"))
            agents += int(np.count_nonzero(inner.state.uavs["active"]))
            env.step(chosen(masks, generator))
        return agents

    measure(benchmark, play)


def test_environment_of_ref_12(benchmark, monkeypatch) -> None:
    """The environment of the paper's ref. 12, with the maps that its network takes."""
    if "DESS_UDH" not in os.environ:
        pytest.skip("DESS_UDH is not set")
    pytest.importorskip("tensorflow")  # which all its modules import
    folder = Path(os.environ["DESS_UDH"])
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    from src.base.GridActions import GridActions  # type: ignore[import-not-found]
    from src.Environment import Environment  # type: ignore[import-not-found]
    from utils import read_config  # type: ignore[import-not-found]

    env = Environment(read_config("config/manhattan32.json"))
    state = env.init_episode()

    def play() -> int:
        nonlocal state
        agents = 0
        for _ in range(STEPS[1]):
            if state.all_terminal:
                state = env.init_episode()
            for agent in range(state.num_agents):
                state.active_agent = agent
                if not state.terminal:
                    state.get_boolean_map(), state.get_float_map(), state.get_scalars()
                    state = env.physics.step(GridActions(env.agent.get_random_action()))
                    agents += 1
        return agents

    measure(benchmark, play)
