"""AgileRL: its MADDPG on ``parallel_env`` with masks in the infos, in one process.

``PzDummyVecEnv`` starts the next mission by itself, but hands over the infos of the last slot: so
in the first slot of a mission AgileRL knows only Hover to be allowed.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
from dess.envs.parallel import HarvestEnv
from dess.model.state import HOVER

agilerl = pytest.importorskip("agilerl")

from agilerl.vector import PzDummyVecEnv  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / "examples" / "agilerl_maddpg.py"
# Batteries of 7 to 11 % and 9 slots, so that UAVs end apart; the border of the grid forbids moves.
SHORT = {"flying_time": [7, 11], "max_slots": 9, "zone": [0, 0, 2, 2]}
UAVS = ["uav_0", "uav_1", "uav_2"]


def harvest(**design) -> HarvestEnv:
    """The environment in the form that AgileRL reads."""
    return dess.parallel_env(dess.load_scenario("paper", **design), mask="info", ended="stay")


def flown(env, slots, seed=1):
    """Slots with random legal actions: what the environment returned, and the actions."""
    draw, (observations, infos) = np.random.default_rng(seed), env.reset(seed=seed)
    for _ in range(slots):
        allowed = {uav: np.flatnonzero(infos[uav]["action_mask"]) for uav in UAVS}
        actions = {uav: draw.choice(own, 1) for uav, own in allowed.items()}
        observations, rewards, terminated, truncated, infos = env.step(actions)
        yield observations, rewards, terminated, truncated, infos


def test_contract(monkeypatch):
    """Ended UAVs wait for their mission's end; the example chooses only what the mask allows."""
    waits = 0
    env = PzDummyVecEnv(harvest(uavs=3, flying_time=[5, 30], max_slots=25))
    for observations, rewards, terminated, truncated, infos in flown(env, 300):
        over = [bool(terminated[uav][0] or truncated[uav][0]) for uav in UAVS]
        assert len(set(over)) == 1
        for uav in UAVS:
            assert rewards[uav] == pytest.approx(infos[uav]["reward_terms"].sum())
        ended = [uav for uav in UAVS if not infos[uav]["active"] and not over[0]]
        waits += len(ended)
        assert not any(observations[uav].any() for uav in ended if not rewards[uav][0])
        assert all(np.flatnonzero(infos[uav]["action_mask"]) == [HOVER] for uav in ended)
    assert waits

    chosen, reset, step = [], HarvestEnv.reset, HarvestEnv.step

    def watched_reset(env, *arguments, **options):
        observations, env.infos = reset(env, *arguments, **options)
        return observations, env.infos

    def watched_step(env, actions):
        chosen.extend((env.infos[uav]["action_mask"], actions[uav]) for uav in actions)
        *others, env.infos = step(env, actions)
        return *others, env.infos

    monkeypatch.setattr(HarvestEnv, "reset", watched_reset)
    monkeypatch.setattr(HarvestEnv, "step", watched_step)
    population = runpy.run_path(str(EXAMPLE))["train"](harvest(**SHORT), steps=256)
    masks, actions = (np.array(part) for part in zip(*chosen, strict=True))
    assert (masks[:, :HOVER] == 0).any() and len(set(actions.tolist())) > 1
    assert np.all(masks[np.arange(len(masks)), actions] == 1)
    assert all(np.isfinite(agent.fitness).all() and agent.fitness for agent in population)
    assert any(state for state in population[0].actor_optimizers["uav"].state.values())
