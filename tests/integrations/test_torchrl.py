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


def test_agents_that_end(make):
    mission = flown(make(FIXED), missions=3)
    uav, after = mission["uav"], mission["next", "uav"]
    assert uav["action_mask"].gather(-1, uav["action"].unsqueeze(-1)).all()
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


def test_training_step(tmp_path):
    example = runpy.run_path(str(EXAMPLE))
    short, long = (example["train"](SHORT, slots, per_batch=60) for slots in (60, 120))
    for before, after in zip(short.parameters(), long.parameters(), strict=True):
        assert after.isfinite().all() and (before != after).any()
    torch.save(long.state_dict(), tmp_path / "mappo.pt")
    policy = example["Mappo"](tmp_path / "mappo.pt")
    missions = dess.simulate_batch(SHORT, policy, 3, 4).missions
    assert np.array_equal(missions, dess.simulate_batch(SHORT, policy, 3, 4).missions)
