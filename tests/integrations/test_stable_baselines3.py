"""stable-baselines3: its wrappers and PPO, which has no masks, on the rows of ``vector_env``."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
from dess import ScenarioSpace

stable_baselines3 = pytest.importorskip("stable_baselines3")
vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
evaluation = pytest.importorskip("stable_baselines3.common.evaluation")
env_util = pytest.importorskip("stable_baselines3.common.env_util")
sb3 = pytest.importorskip("dess.envs.integrations.sb3")

EXAMPLE = Path(__file__).parents[2] / "examples" / "sb3_ppo.py"
# Some UAVs fill their quota, others deplete their battery, others fly until max_slots.
QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], quota=60, max_slots=25)
MISSIONS, ROWS = 4, 12


def harvest(scenario=QUICK, **options):
    """A small environment."""
    return sb3.SB3VecEnv(dess.vector_env(scenario, MISSIONS, **options))


def test_contract():
    """Steps are those of ``vector_env``, and ends are told as its wrappers expect it."""
    env, plain = harvest(seed=0), dess.vector_env(QUICK, MISSIONS, seed=0)
    generator, copies = np.random.default_rng(1), []
    env.set_options({"replication": 5})
    fifth, _ = plain.reset(options={"replication": 5})
    assert np.array_equal(env.reset(), fifth)
    env = vec_env.VecMonitor(env)
    env.seed(2)
    copies.append((held := env.reset(), held.copy()))
    plain.reset(seed=2)
    over_in_all = 0
    for _ in range(60):
        actions = generator.integers(0, 5, ROWS)
        observations, rewards, over, infos = env.step(actions)
        copies.append((observations, observations.copy()))
        expected, gained, terminated, truncated, info = plain.step(actions)
        assert np.array_equal(observations, expected)
        assert np.array_equal(rewards, gained)
        assert np.array_equal(over, terminated | truncated)
        for row in np.flatnonzero(over):
            last = infos[row]["terminal_observation"]
            assert np.array_equal(last, info["final_obs"][row])
            assert infos[row]["TimeLimit.truncated"] == truncated[row]
            mission = info["final_info"]
            has_uav = row % 3 < mission["uavs"][row]
            assert infos[row].get("is_success") == (mission["success"][row] if has_uav else None)
        assert all(infos[row] == {} for row in np.flatnonzero(~over))
        over_in_all += over.sum()
    assert over_in_all
    # A rollout buffer reads an observation after the next step, so steps must not overwrite it.
    assert all(np.array_equal(held, copy) for held, copy in copies)

    model = runpy.run_path(str(EXAMPLE))["train"](steps=1, missions=2)
    assert (model.num_timesteps, model._n_updates) == (32 * 6, 4)
    fleet = harvest(ScenarioSpace.of(QUICK, uavs=3))
    rewards, slots = evaluation.evaluate_policy(model, fleet, 24, return_episode_rewards=True)
    assert len(rewards) == 24 and max(slots) <= QUICK.max_slots


def test_make_vec_env_makes_missions_of_a_lone_uav():
    env = env_util.make_vec_env(
        "dess.envs:dess/Paper-v0", 2, seed=1, env_kwargs={"scenario": QUICK}
    )
    model = stable_baselines3.PPO("MlpPolicy", env, n_steps=8, batch_size=8, n_epochs=1).learn(32)
    assert model.num_timesteps == 32
    assert all(masks.shape == (5,) for masks in env.env_method("action_masks"))
