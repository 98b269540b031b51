"""stable-baselines3: its wrappers and PPO on the rows of ``vector_env``.

PPO has no masks of actions, so ``test_mask_is_respected`` checks what becomes of its actions where
the mask leaves them out.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
from dess import ScenarioSpace
from dess.state import HOVER
from policies.heuristics import Random

stable_baselines3 = pytest.importorskip("stable_baselines3")
vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
evaluation = pytest.importorskip("stable_baselines3.common.evaluation")
sb3 = pytest.importorskip("dess.integrations.sb3")

EXAMPLE = Path(__file__).parents[2] / "examples" / "sb3_ppo.py"
# Some UAVs fill their quota, others deplete their battery, others fly until max_slots.
QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], quota=60, max_slots=25)
MISSIONS, ROWS = 4, 12
NORTH = 0


def harvest(scenario=QUICK, **options):
    """A small environment."""
    return sb3.SB3VecEnv(dess.vector_env(scenario, MISSIONS, **options))


def episodes(env, steps: int, seed: int) -> list[tuple]:
    """All that an environment returns for random actions, illegal ones too."""
    generator = np.random.default_rng(3)
    env.seed(seed)
    story: list[tuple] = [(env.reset(),)]
    for _ in range(steps):
        story.append(env.step(generator.integers(0, 5, env.num_envs)))
    return story


def fleet_of(uavs: int) -> ScenarioSpace:
    """The small scenario with a fleet of fixed size."""
    return ScenarioSpace.of(QUICK, uavs=uavs)


def finals(story: list[tuple]) -> list[dict]:
    """The infos of the rows whose missions are over."""
    return [info for *_, over, infos in story[1:] for row, info in enumerate(infos) if over[row]]


def test_reset() -> None:
    env = harvest()
    observations = env.reset()
    assert observations.shape == (ROWS, *env.observation_space.shape)
    assert all(env.observation_space.contains(row) for row in observations)
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
        assert all(infos[row] == {} for row in np.flatnonzero(~over))
        over_in_all += over.sum()
    assert over_in_all
    # A rollout buffer reads an observation after the next step, so steps must not overwrite it.
    assert all(np.array_equal(held, copy) for held, copy in copies)


def test_mask_is_respected() -> None:
    env, refused = harvest(), 0
    env.reset()
    state = env.env.state
    for _ in range(20):
        before, masks = state.uavs.ravel().copy(), env.env.action_masks().copy()
        _, rewards, over, _ = env.step(np.full(ROWS, NORTH))
        flies = before["active"] & ~before["charging"] & ~over
        off, after = flies & ~masks[:, NORTH], state.uavs.ravel()
        assert after["overruled"][off].all()
        assert (after["y"][off] == before["y"][off]).all()
        assert (rewards[off] < 0).all()
        refused += off.sum()
    assert refused


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


def test_smaller_fleets() -> None:
    env = vec_env.VecMonitor(harvest())
    story = episodes(env, 100, seed=4)
    drawn = dess.simulate_batch(QUICK, Random(), 4, 100).missions["uavs"]
    flown = finals(story)
    counted = [info for info in flown if "is_success" in info]
    missions = len(flown) // 3
    assert missions > 8 and len(set(drawn[:missions])) == 3
    assert len(counted) == drawn[:missions].sum()
    fixed = finals(episodes(harvest(fleet_of(3)), 60, seed=4))
    assert fixed and all("episode" in info for info in fixed)


def test_training_step() -> None:
    model = runpy.run_path(str(EXAMPLE))["train"](steps=1, missions=2)
    assert model.num_timesteps == 32 * 6
    assert model._n_updates == 4
    env = harvest(fleet_of(3))
    rewards, slots = evaluation.evaluate_policy(model, env, 24, return_episode_rewards=True)
    assert len(rewards) == 24 and max(slots) <= QUICK.max_slots


def test_seeds_repeat_episodes() -> None:
    for wrap in (lambda env: env, vec_env.VecMonitor, vec_env.VecNormalize):
        stories = [episodes(wrap(harvest()), 40, seed) for seed in (7, 7, 8)]
        first, again, other = ([np.concatenate(step[:1]) for step in story] for story in stories)
        assert all(map(np.array_equal, first, again))
        assert not np.array_equal(first[0], other[0])
