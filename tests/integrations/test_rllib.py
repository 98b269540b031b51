"""RLlib: its PPO with masked actions on ``HarvestMultiAgentEnv``, in one process."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess

ray = pytest.importorskip("ray")
torch = pytest.importorskip("torch")

from ray.rllib.core.columns import Columns  # noqa: E402

from dess.integrations.rllib import HarvestMultiAgentEnv  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / "examples" / "rllib_ppo.py"
# Batteries of 7 to 11 % and 9 slots, so that UAVs end apart; the border of the grid forbids moves.
SHORT = {"flying_time": [7, 11], "max_slots": 9, "zone": [0, 0, 2, 2]}


def missions(design, count, seed=0):
    """All slots of some missions with random legal actions: what the environment returned."""
    env = HarvestMultiAgentEnv({"scenario": dess.load_scenario("paper", **design)})
    draw, flown = np.random.default_rng(seed), []
    for number in range(count):
        observations, infos = env.reset(seed=seed if number == 0 else None)
        slots = [(observations, {}, {"__all__": False}, {"__all__": False}, infos)]
        while not slots[-1][2]["__all__"]:
            acting = {agent: slots[-1][0][agent]["action_mask"] for agent in env.env.agents}
            slots.append(env.step({a: draw.choice(np.flatnonzero(m)) for a, m in acting.items()}))
        flown.append(slots)
    return flown


@pytest.fixture(scope="module")
def training():
    """A learner, its weights before and after one update, and the actions with their masks."""
    actions, step, reset = [], HarvestMultiAgentEnv.step, HarvestMultiAgentEnv.reset

    def watched_reset(env, **options):
        env.seen, infos = reset(env, **options)
        return env.seen, infos

    def watched_step(env, chosen):
        actions.extend((env.seen[agent]["action_mask"], a) for agent, a in chosen.items())
        env.seen, *others = step(env, chosen)
        return env.seen, *others

    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(HarvestMultiAgentEnv, "reset", watched_reset)
        patch.setattr(HarvestMultiAgentEnv, "step", watched_step)
        learner = runpy.run_path(str(EXAMPLE))["learner"]("paper", batch=200, **SHORT)
        actions.clear()  # RLlib has tried the environment with any actions
        before = learner.get_module("uav").get_state()
        result = learner.train()
        yield learner, before, learner.get_module("uav").get_state(), actions, result
    learner.stop()
    ray.shutdown()


def test_agents_that_end():
    both = 0
    for slots in missions({"uavs": 3} | SHORT, count=50):
        over = set()
        for observations, _, terminated, truncated, _ in slots:
            assert not over & observations.keys()
            over |= {a for a in observations if terminated.get(a) or truncated.get(a)}
            assert terminated["__all__"] == (len(over) == 3)
        both += any(truncated.values()) and sum(terminated.values()) > 1  # a UAV and "__all__"
    assert both  # in the last slot, one UAV is terminated and another one truncated


def test_training_step(training):
    learner, before, after, actions, result = training
    masks, chosen = (np.array(part) for part in zip(*actions, strict=True))
    assert len(masks) >= 200 and (masks == 0).any()
    assert np.all(masks[np.arange(len(masks)), chosen] == 1)
    assert result["env_runners"]["num_env_steps_sampled"] >= 200
    assert any(not np.array_equal(before[name], after[name]) for name in before)
    module = learner.get_module("uav")
    mask = np.array([[1, 0, 1, 0, 0]], np.float32)
    space = learner.env_runner.env.envs[0].unwrapped.get_observation_space("uav_0")
    observation = np.zeros((1, *space["observations"].shape), np.float32)
    batch = {"observations": torch.from_numpy(observation), "action_mask": torch.from_numpy(mask)}
    logits = module.forward_inference({Columns.OBS: batch})[Columns.ACTION_DIST_INPUTS][0]
    assert (logits < -1e30).tolist() == [False, True, False, True, True]
