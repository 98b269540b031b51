"""PufferLib: its policy on the native environment ``HarvestPufferEnv``, in one process."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import dess
from dess.state import HOVER

pytest.importorskip("pufferlib")
torch = pytest.importorskip("torch")

from dess.integrations.pufferlib import HarvestPufferEnv, MaskedPolicy  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / "examples" / "pufferlib_ppo.py"
# Batteries of 7 to 11 % and 9 slots, so that UAVs end apart; the border of the grid forbids moves.
PAPER = dess.load_scenario("paper", flying_time=[7, 11], max_slots=9, zone=[0, 0, 2, 2])


def harvest(missions=4, **options) -> HarvestPufferEnv:
    """A small environment."""
    return HarvestPufferEnv(PAPER, missions, **options)


def flown(env, slots, seed=1):
    """Copies of the arrays before and after each slot, with random legal actions."""
    draw, _ = np.random.default_rng(seed), env.reset(seed=seed)
    for _ in range(slots):
        masks, acts = env.observations[:, -5:].copy(), env.masks.copy()
        env.step(np.array([draw.choice(np.flatnonzero(mask)) for mask in masks]))
        yield masks, acts, env.rewards.copy(), env.terminals | env.truncations


@pytest.fixture(scope="module")
def training():
    """The policy that the example trains, its first weights, and its actions with their masks."""
    chosen, step, names = [], HarvestPufferEnv.step, runpy.run_path(str(EXAMPLE))

    def watched(env, actions):
        chosen.extend(zip(env.observations[:, -5:].copy(), actions, strict=True))
        return step(env, actions)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(HarvestPufferEnv, "step", watched)
        torch.manual_seed(0)
        first = names["Policy"](MaskedPolicy(harvest()))
        return names["train"](harvest(), steps=1000), first, chosen


def test_step():
    env, ended = harvest(), []
    names = ("observations", "rewards", "terminals", "truncations", "masks", "actions")
    arrays = {name: np.zeros_like(getattr(env, name)) for name in names}
    inside = harvest(buf=SimpleNamespace(**arrays))
    for (*_, rewards, over), (*_, same, _) in zip(flown(env, 30), flown(inside, 30), strict=True):
        assert np.array_equal(rewards, same) and np.array_equal(arrays["rewards"], same)
        ended.append(over.sum())
    assert sum(ended) and np.array_equal(arrays["observations"], env.observations)


def test_agents_that_end():
    space = dess.load_scenario("paper", uavs=3, flying_time=[5, 30], max_slots=25)
    waits = 0
    for masks, acts, rewards, over in flown(HarvestPufferEnv(space, 4), 100):
        assert not rewards[~acts].any() and (masks[~acts] == np.eye(5)[HOVER]).all()
        assert all(len(set(mission)) == 1 for mission in over.reshape(4, 3).tolist())
        waits += (~acts).sum()
    assert waits


def test_training_step(training):
    trained, first, chosen = training
    masks, actions = (np.array(part) for part in zip(*chosen, strict=True))
    assert len(masks) >= 900 and (masks[:, :HOVER] == 0).any() and len(set(actions.tolist())) == 5
    assert np.all(masks[np.arange(len(masks)), actions] == 1)
    for after, before in zip(trained.parameters(), first.parameters(), strict=True):
        assert after.isfinite().all() and not torch.equal(after, before)
