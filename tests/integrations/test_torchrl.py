"""TorchRL: its wrappers of ``parallel_env`` and ``vector_env``, ``examples/torchrl_mappo.py``."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
from dess.model.state import HOVER

torch = pytest.importorskip("torch")
torchrl_envs = pytest.importorskip("torchrl.envs")

EXAMPLE = Path(__file__).parents[2] / "examples" / "torchrl_mappo.py"
DRAWN, FIXED = dess.load_scenario("paper"), dess.load_scenario("paper", uavs=3)
SHORT = dess.load_scenario("paper", max_slots=12)
fleets = pytest.mark.parametrize("scenario", [DRAWN, FIXED], ids=["drawn", "fixed"])


def test_rows():
    """Four missions in lockstep, with a row for each UAV."""
    torch.manual_seed(0)
    env = torchrl_envs.GymWrapper(dess.vector_env(DRAWN, 4, 1), categorical_action_encoding=True)
    env = torchrl_envs.TransformedEnv(env, torchrl_envs.ActionMask())
    torchrl_envs.check_env_specs(env)
    flight = env.rollout(50)
    allowed = flight["action_mask"]
    assert allowed.gather(-1, flight["action"].unsqueeze(-1)).all() and not allowed.all()


@fleets
def test_contract(tmp_path, scenario):
    """Random allowed actions in whole missions, and the example as a policy."""
    torch.manual_seed(0)
    plain = dess.parallel_env(scenario, 1, mask="info", ended="stay")
    env = torchrl_envs.PettingZooWrapper(plain)
    torchrl_envs.check_env_specs(env)
    ends, waits = 0, 0
    for _ in range(3):
        mission = env.rollout(1000)
        uav, after, record = mission["uav"], mission["next", "uav"], env._env.record()
        assert len(mission) == record.slots
        terms = after["info", "reward_terms"].sum(-1, keepdim=True)
        torch.testing.assert_close(after["reward"], terms)
        assert float(after["reward"].sum()) == pytest.approx(record.reward, rel=1e-4)
        assert float(after["info", "collected"].sum()) == pytest.approx(record.collected, rel=1e-4)
        allowed, ended = uav["action_mask"], uav["info", "active"] == 0
        assert allowed.gather(-1, uav["action"].unsqueeze(-1)).all() and not allowed.all()
        ended_before = ended[1:] & ended[:-1]  # the slot in which it ends gives an observation
        assert not uav["observation"][1:][ended_before].any() and not after["reward"][ended].any()
        assert (allowed[ended] == (torch.arange(5) == HOVER)).all()
        over = mission["next", "done"]
        assert (after["done"] == over.unsqueeze(-1)).all()  # all UAVs are done at once
        ends, waits = ends + int(over.sum()), waits + int(ended_before.sum())
    assert ends == 3 and waits

    example = runpy.run_path(str(EXAMPLE))
    flown = ~ended.squeeze(-1) if ended.dim() > 2 else ~ended
    expected = after["reward"].squeeze(-1)[flown].mean()
    torch.testing.assert_close(example["mean_reward"](mission), expected)
    short, long = (example["train"](SHORT, slots, per_batch=60) for slots in (60, 120))
    for before, later in zip(short.parameters(), long.parameters(), strict=True):
        assert later.isfinite().all() and (before != later).any()
    torch.save(long.state_dict(), tmp_path / "mappo.pt")
    policy = example["Mappo"](tmp_path / "mappo.pt")
    missions = dess.simulate_batch(SHORT, policy, 3, 4).missions
    assert np.array_equal(missions, dess.simulate_batch(SHORT, policy, 3, 4).missions)
