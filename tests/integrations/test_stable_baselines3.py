"""stable-baselines3: its wrappers and PPO, which has no masks, on the rows of ``vector_env``."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
from dess import ScenarioSpace
from dess.state import HOVER

stable_baselines3 = pytest.importorskip("stable_baselines3")
vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
evaluation = pytest.importorskip("stable_baselines3.common.evaluation")
sb3 = pytest.importorskip("dess.integrations.sb3")

EXAMPLE = Path(__file__).parents[2] / "examples" / "sb3_ppo.py"
# Some UAVs fill their quota, others deplete their battery, others fly until max_slots.
QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], quota=60, max_slots=25)
MISSIONS, ROWS = 4, 12


def harvest(scenario=QUICK, **options):
    """A small environment."""
    return sb3.SB3VecEnv(dess.vector_env(scenario, MISSIONS, **options))


def fleet_of(uavs: int) -> ScenarioSpace:
    """The small scenario with a fleet of fixed size."""
    return ScenarioSpace.of(QUICK, uavs=uavs)


def test_reset() -> None:
    env = harvest()
    env.set_options({"replication": 5})
    fifth = env.reset()
    expected, _ = dess.vector_env(QUICK, MISSIONS).reset(options={"replication": 5})
    assert np.array_equal(fifth, expected)
    assert not np.array_equal(env.reset(), fifth)  # an option holds for one reset


def test_step() -> None:
    env, plain = vec_env.VecMonitor(harvest()), dess.vector_env(QUICK, MISSIONS)
    generator, copies = np.random.default_rng(1), []
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


def test_agents_that_end() -> None:
    env, waits = harvest(fleet_of(3)), 0
    env.reset()
    generator, totals = np.random.default_rng(1), np.zeros(ROWS)
    for _ in range(60):
        waiting = ~env.env.state.uavs["active"].ravel()
        masks = np.stack(env.env_method("action_masks"))
        assert (masks[waiting] == np.eye(5, dtype=bool)[HOVER]).all()
        observations, rewards, over, infos = env.step(generator.integers(0, 5, ROWS))
        assert not rewards[waiting].any()
        assert not observations[waiting & ~over].any()
        totals += rewards
        for row in np.flatnonzero(over):
            assert infos[row]["episode"]["r"] == pytest.approx(totals[row])
        totals[over] = 0.0
        waits += waiting.sum()
    assert waits


def test_training_step() -> None:
    model = runpy.run_path(str(EXAMPLE))["train"](steps=1, missions=2)
    assert model.num_timesteps == 32 * 6
    assert model._n_updates == 4
    env = harvest(fleet_of(3))
    rewards, slots = evaluation.evaluate_policy(model, env, 24, return_episode_rewards=True)
    assert len(rewards) == 24 and max(slots) <= QUICK.max_slots
