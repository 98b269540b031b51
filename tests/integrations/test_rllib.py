"""RLlib: its PPO with masked actions on ``HarvestMultiAgentEnv``, in one process."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess

ray = pytest.importorskip("ray")

from dess.envs.integrations.rllib import HarvestMultiAgentEnv  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / "examples" / "rllib_ppo.py"
# Batteries of 7 to 11 % and 9 slots, so that UAVs end apart; the border of the grid forbids moves.
SHORT = {"flying_time": [7, 11], "max_slots": 9, "zone": [0, 0, 2, 2]}


def test_missions():
    """Whole missions with random legal actions: who has ended observes nothing any more."""
    paper, draw, both = dess.load_scenario("paper", uavs=3, **SHORT), np.random.default_rng(0), 0
    env = HarvestMultiAgentEnv({"scenario": paper})
    for number in range(50):
        observations, infos = env.reset(seed=0 if number == 0 else None)
        assert list(observations) == list(infos) == env.possible_agents
        over, terminated = set(), {"__all__": False}
        while not terminated["__all__"]:
            for agent, observation in observations.items():
                assert env.get_observation_space(agent).contains(observation)
            masks = {agent: observations[agent]["action_mask"] for agent in env.env.agents}
            actions = {a: draw.choice(np.flatnonzero(mask)) for a, mask in masks.items()}
            observations, rewards, terminated, truncated, infos = env.step(actions)
            assert observations.keys() == rewards.keys() == infos.keys()
            assert terminated.keys() == truncated.keys() == {*rewards, "__all__"}
            assert rewards == pytest.approx({a: i["reward_terms"].sum() for a, i in infos.items()})
            assert not over & observations.keys()
            over |= {a for a in observations if terminated[a] or truncated[a]}
            assert terminated["__all__"] == (len(over) == 3)
        both += any(truncated.values()) and sum(terminated.values()) > 1  # a UAV and "__all__"
    assert both  # in the last slot, one UAV is terminated and another one truncated


def test_contract(monkeypatch):
    """The example makes an update, from actions that the masks allow."""
    chosen, step, reset = [], HarvestMultiAgentEnv.step, HarvestMultiAgentEnv.reset

    def watched_reset(env, **options):
        env.seen, infos = reset(env, **options)
        return env.seen, infos

    def watched_step(env, actions):
        chosen.extend((env.seen[agent]["action_mask"], a) for agent, a in actions.items())
        env.seen, *others = step(env, actions)
        return env.seen, *others

    monkeypatch.setattr(HarvestMultiAgentEnv, "reset", watched_reset)
    monkeypatch.setattr(HarvestMultiAgentEnv, "step", watched_step)
    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False)
    learner = runpy.run_path(str(EXAMPLE))["learner"]("paper", batch=200, **SHORT)
    chosen.clear()  # RLlib has tried the environment with any actions
    before, result = learner.get_module("uav").get_state(), learner.train()
    after = learner.get_module("uav").get_state()
    assert result["env_runners"]["num_env_steps_sampled"] >= 200
    assert any(not np.array_equal(before[name], after[name]) for name in before)
    masks, actions = (np.array(part) for part in zip(*chosen, strict=True))
    assert len(masks) >= 200 and (masks == 0).any()
    assert np.all(masks[np.arange(len(masks)), actions] == 1)
    learner.stop()
    ray.shutdown()
