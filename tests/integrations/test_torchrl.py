"""TorchRL: its wrappers of ``parallel_env`` and ``vector_env``, ``examples/torchrl_mappo.py``."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
from dess.state import HOVER

torch = pytest.importorskip("torch")
torchrl_envs = pytest.importorskip("torchrl.envs")

EXAMPLE = Path(__file__).parents[2] / "examples" / "torchrl_mappo.py"
DRAWN, FIXED = dess.load_scenario("paper"), dess.load_scenario("paper", uavs=3)
SHORT = dess.load_scenario("paper", max_slots=12)
fleets = pytest.mark.parametrize("scenario", [DRAWN, FIXED], ids=["drawn", "fixed"])


@pytest.fixture
def make():
    """Makes the environment for a scenario and a seed."""

    def made(scenario, seed=1):
        env = dess.parallel_env(scenario, seed, mask="info", ended="stay")
        return torchrl_envs.PettingZooWrapper(env)

    return made


def rows_of(scenario, seed=1):
    """Four missions in lockstep, with a row for each UAV."""
    env = torchrl_envs.GymWrapper(
        dess.vector_env(scenario, 4, seed), categorical_action_encoding=True
    )
    return torchrl_envs.TransformedEnv(env, torchrl_envs.ActionMask())


def flown(env, missions=1, seed=0):
    """Whole missions with random allowed actions, one after the other."""
    torch.manual_seed(seed)
    return torch.cat([env.rollout(1000) for _ in range(missions)])


@fleets
def test_reset(make, scenario):
    env = make(scenario)
    first = env.reset()
    assert env.observation_spec.is_in(first)
    assert not first["done"].any() and not first["uav", "done"].any()
    assert first["uav", "info", "active"].sum() == len(env._env.record().uavs)
    assert first["uav", "action_mask"].any(-1).all()


@fleets
def test_step(make, scenario):
    env = make(scenario)
    torchrl_envs.check_env_specs(env)
    mission = flown(env)
    after, record = mission["next", "uav"], env._env.record()
    assert len(mission) == record.slots
    terms = after["info", "reward_terms"].sum(-1, keepdim=True)
    torch.testing.assert_close(after["reward"], terms)
    assert float(after["reward"].sum()) == pytest.approx(record.reward, rel=1e-4)
    assert float(after["info", "collected"].sum()) == pytest.approx(record.collected, rel=1e-4)
    torchrl_envs.check_env_specs(rows_of(scenario))


@fleets
def test_mask_is_respected(make, scenario):
    torch.manual_seed(0)
    for flight in (make(scenario).rollout(1000)["uav"], rows_of(scenario).rollout(50)):
        allowed = flight["action_mask"]
        assert allowed.gather(-1, flight["action"].unsqueeze(-1)).all()
        assert not allowed.all() and (allowed.sum(-1) > 1).any()


def test_agents_that_end(make):
    mission = flown(make(FIXED), missions=3)
    uav, after = mission["uav"], mission["next", "uav"]
    ended = uav["info", "active"] == 0
    assert ended.any() and not ended.all(0).any()
    ended_before = ended[1:] & ended[:-1]  # the slot in which it ends gives a last observation
    assert ended_before.any() and not uav["observation"][1:][ended_before].any()
    assert not after["reward"][ended].any()
    only_hover = torch.arange(5) == HOVER
    assert (uav["action_mask"][ended] == only_hover).all()
    over = mission["next", "done"]
    assert int(over.sum()) == 3
    assert (after["done"] == over.unsqueeze(-1)).all()  # all UAVs are done at once


def test_smaller_fleets(make):
    env, sizes = make(SHORT), set()
    for _ in range(8):
        first = env.reset()["uav"]
        fleet = len(env._env.record().uavs)
        assert first["info", "active"].tolist() == [1.0] * fleet + [0.0] * (3 - fleet)
        assert first["observation"].any(-1).tolist() == [True] * fleet + [False] * (3 - fleet)
        assert first.shape == (3,)
        sizes.add(fleet)
    assert sizes == {1, 2, 3}


def test_training_step(tmp_path):
    example = runpy.run_path(str(EXAMPLE))
    short, long = (example["train"](SHORT, slots, per_batch=60) for slots in (60, 120))
    for before, after in zip(short.parameters(), long.parameters(), strict=True):
        assert after.isfinite().all() and (before != after).any()
    torch.save(long.state_dict(), tmp_path / "mappo.pt")
    policy = example["Mappo"](tmp_path / "mappo.pt")
    missions = dess.simulate_batch(SHORT, policy, 3, 4).missions
    assert np.array_equal(missions, dess.simulate_batch(SHORT, policy, 3, 4).missions)


def follow_vector_env(env):
    """Check that whole missions are those of a ``vector_env`` with the same seed and actions."""
    flight = env.rollout(
        200, auto_reset=False, tensordict=env.reset(seed=7), break_when_any_done=False
    )
    rows = dess.vector_env(DRAWN, 4)
    seen, _ = rows.reset(seed=7)
    for slot in flight.unbind(1):
        assert np.array_equal(slot["observation"], seen)
        seen, rewards, terminated, truncated, info = rows.step(slot["action"].numpy())
        last = seen.copy()
        if "final_obs" in info:
            last[info["_final_obs"]] = np.stack(info["final_obs"][info["_final_obs"]])
        assert np.array_equal(slot["next", "observation"], last)
        assert np.array_equal(slot["next", "done"][:, 0], terminated | truncated)
        assert np.array_equal(slot["next", "reward"][:, 0], rewards.astype(np.float32))
    assert flight["next", "done"].any()


def test_seeds_repeat_episodes(make):
    mission, again, other = (flown(make(SHORT, seed), missions=3) for seed in (1, 1, 2))
    assert (mission == again).all()
    assert not torch.equal(mission["uav", "observation"], other["uav", "observation"])
    env = make(SHORT)
    first, _ = dess.parallel_env(SHORT, mask="info", ended="stay").reset(seed=7)
    rows = torch.from_numpy(np.stack([*first.values()]))
    assert torch.equal(env.reset(seed=7)["uav", "observation"], rows)
    follow_vector_env(rows_of(DRAWN))
    env.set_seed(5)
    mission = env.rollout(3)["uav", "observation"][0]
    env.set_seed(5)
    assert torch.equal(env.rollout(3)["uav", "observation"][0], mission)
