"""PufferLib: its policy on the native environment ``HarvestPufferEnv``, in one process."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
from dess.model.state import HOVER

pytest.importorskip("pufferlib")
torch = pytest.importorskip("torch")
vector = pytest.importorskip("pufferlib.vector")

from dess.envs.integrations.pufferlib import HarvestPufferEnv, MaskedPolicy  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / "examples" / "pufferlib_ppo.py"
# Batteries of 7 to 11 % and 9 slots, so that UAVs end apart; the border of the grid forbids moves.
PAPER = dess.load_scenario("paper", flying_time=[7, 11], max_slots=9, zone=[0, 0, 2, 2])


def harvest(missions=4, **options) -> HarvestPufferEnv:
    """A small environment."""
    return HarvestPufferEnv(PAPER, missions, **options)


def test_contract(monkeypatch):
    """The environment is ``vector_env`` with the masks; the example keeps to them."""
    space = dess.load_scenario("paper", uavs=3, flying_time=[5, 30], max_slots=25)
    assert vector.make(harvest).reset(seed=1)[1] == []
    env, plain = HarvestPufferEnv(space, 4), dess.vector_env(space, 4)
    observations, _ = env.reset(seed=1)
    seen, info = plain.reset(seed=1)
    assert observations is env.observations
    assert np.array_equal(observations, np.hstack([seen, info["action_mask"]]))
    assert np.array_equal(env.masks, info["active"])

    draw, waits, ended = np.random.default_rng(1), 0, 0
    for _ in range(100):
        masks, acts = env.observations[:, -5:].copy(), env.masks.copy()
        actions = np.array([draw.choice(np.flatnonzero(mask)) for mask in masks])
        env.step(actions)
        _, rewards, terminated, truncated, _ = plain.step(actions)
        assert np.allclose(env.rewards, rewards)
        over = env.terminals | env.truncations
        assert np.array_equal(over, terminated | truncated)
        assert not env.rewards[~acts].any() and (masks[~acts] == np.eye(5)[HOVER]).all()
        assert all(len(set(mission)) == 1 for mission in over.reshape(4, 3).tolist())
        waits, ended = waits + (~acts).sum(), ended + over.sum()
    assert waits and ended

    chosen, step, names = [], HarvestPufferEnv.step, runpy.run_path(str(EXAMPLE))

    def watched(env, actions):
        chosen.extend(zip(env.observations[:, -5:].copy(), actions, strict=True))
        return step(env, actions)

    monkeypatch.setattr(HarvestPufferEnv, "step", watched)
    torch.manual_seed(0)
    first, trained = names["Policy"](MaskedPolicy(harvest())), names["train"](harvest(), steps=1000)
    masks, actions = (np.array(part) for part in zip(*chosen, strict=True))
    assert len(actions) >= 900 and (masks[:, :HOVER] == 0).any()
    assert np.all(masks[np.arange(len(masks)), actions] == 1)
    for after, before in zip(trained.parameters(), first.parameters(), strict=True):
        assert after.isfinite().all() and not torch.equal(after, before)
