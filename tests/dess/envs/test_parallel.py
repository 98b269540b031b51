"""The environment of one mission equals ``simulate``, and repeats its episodes."""

from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from hypothesis import given
from hypothesis import strategies as st

import dess
from dess.model.state import END_NAMES, HOVER
from tests.dess.envs.episodes import PAPER, masks_of, play, small
from tests.drawn import Commuter, Recorder, Script, Wanderer, replications, seeds, spaces


def test_a_seed_repeats_a_sequence_of_whole_episodes():
    env, other = dess.parallel_env(PAPER), dess.parallel_env(PAPER, seed=4)
    first = [play(env, 1, seed=3), play(env, 2)]
    assert data_equivalence(first, [play(other, 1, seed=3), play(other, 2)], exact=True)
    assert not data_equivalence(first[0], play(env, 1, seed=4))
    seen = []
    for reset in ({"seed": 7}, {}, {"options": {"replication": 40}}, {}, {"seed": 8}):
        env.reset(**reset)
        seen.append((env.record().seed, env.record().replication))
    assert seen == [(7, 0), (7, 1), (7, 40), (7, 41), (8, 0)]


# A third of the missions end on the ground, with a quota or without one.
ENDINGS = st.sampled_from([{}, {}, {}, {}, {"landing": True}, {"landing": True, "quota": 0}])


@given(
    ENDINGS.flatmap(lambda ending: spaces(**ending)),
    seeds,
    replications,
    st.sampled_from([Wanderer(), Commuter()]),
    st.integers(0, 9),
)
def test_the_same_actions_give_the_record_of_simulate(space, seed, replication, policy, whims):
    recorder = Recorder(policy)
    record = dess.simulate(space, recorder, seed, replication)
    env = dess.parallel_env(space, seed, observation="state")
    env.reset(options={"replication": replication})
    generator = np.random.default_rng(whims)
    rewards, ends = dict.fromkeys(env.agents, 0.0), {}
    slot, team_collected = 0, 0.0
    while env.agents:
        # A UAV that charges was not asked; whatever its action, it hovers.
        whim = int(generator.integers(5))
        actions = {a: recorder.asked.get((slot, int(a[4:])), whim) for a in env.agents}
        _, gained, terminated, truncated, infos = env.step(actions)
        for agent, info in infos.items():
            rewards[agent] += gained[agent]
            ends[agent] = END_NAMES[info["end"]]
            assert gained[agent] == sum(info["reward_terms"].tolist())
            assert terminated[agent] == (ends[agent] in ("quota", "battery", "landed"))
            assert truncated[agent] == (ends[agent] == "truncated")
        own = sum(info["collected"] for info in infos.values())
        assert {info["team_collected"] for info in infos.values()} == {info["team_collected"]}
        assert own == pytest.approx(info["team_collected"], abs=1e-9)
        team_collected += info["team_collected"]
        slot += 1
    assert env.record().metrics == record.metrics
    assert np.array_equal(env.record().uavs, record.uavs)
    assert list(rewards.values()) == record.uavs["reward"].tolist()
    assert list(ends.values()) == [END_NAMES[end] for end in record.uavs["end"]]
    assert team_collected == record.collected


@pytest.mark.parametrize("ended", ["leave", "stay"])
def test_the_step_of_the_last_uav_runs_the_mission_to_its_horizon(ended):
    """The record is that at the horizon, and the rewards are those until the last UAV ended."""
    scenario = small(landing=True, quota=0, max_slots=90, uavs=2, arrival_rate=0.4, flying_time=3)
    env, steps, rewards = dess.parallel_env(scenario, 6, ended=ended), 0, 0.0
    env.reset()
    while env.agents:
        _, gained, terminated, truncated, infos = env.step(dict.fromkeys(env.agents, 3))
        steps, rewards = steps + 1, rewards + sum(gained.values())
    assert steps <= 4 and all(terminated.values()) and not any(truncated.values())
    assert all(info["reward_terms"].sum() == gained[a] for a, info in infos.items())
    record = dess.simulate(scenario, Script("W" * 9, "W" * 9), 6)
    assert env.record().slots == 90 and env.record().metrics == record.metrics
    assert rewards == pytest.approx(record.reward)


@given(spaces(), seeds, st.integers(0, 9))
def test_who_stays_observes_zeros_and_changes_nothing(space, seed, whims):
    """With ``ended="stay"`` the mission is the same, and only flying UAVs have something in it."""
    kind: dict[str, Any] = {"mask": "info", "observation": "state"}
    leave = dess.parallel_env(space, seed, **kind)
    stay = dess.parallel_env(space, seed, **kind, ended="stay")
    (_, infos), (_, all_infos) = leave.reset(), stay.reset()
    generator, rewards = np.random.default_rng(whims), dict.fromkeys(stay.possible_agents, 0.0)
    while leave.agents:
        flying, everyone = {*leave.agents}, stay.agents
        assert everyone == stay.possible_agents
        for agent, mask in masks_of({}, all_infos).items():
            expected = infos[agent]["action_mask"] if agent in flying else np.arange(5) == HOVER
            assert np.array_equal(mask, expected)
        actions: dict[str, Any] = {agent: int(generator.integers(5)) for agent in leave.agents}
        surplus = {a: 7 for a in everyone if a not in flying and generator.random() < 0.5}
        observations, gained, _, _, infos = leave.step(actions)
        all_seen, all_gained, terminated, truncated, all_infos = stay.step(actions | surplus)
        for agent in everyone:
            rewards[agent] += all_gained[agent]
            assert all_infos[agent]["active"] == (agent in leave.agents)
            if agent in flying:
                both = all_seen, all_gained, all_infos
                for one, other in zip(both, (observations, gained, infos), strict=True):
                    assert data_equivalence(one[agent], other[agent], exact=True)
            else:
                assert not all_seen[agent].any() and all_gained[agent] == 0.0
                assert not all_infos[agent]["reward_terms"].any()
            assert (terminated[agent] or truncated[agent]) == (not leave.agents)
    assert stay.agents == [] and stay.step({}) == ({}, {}, {}, {}, {})  # as PettingZoo has it
    record = stay.record()
    assert data_equivalence(record.metrics, leave.record().metrics, exact=True)
    ends, fleet = [info["end"] for info in all_infos.values()], len(record.uavs)
    assert ends[:fleet] == record.uavs["end"].tolist()
    cut = [END_NAMES[end] == "truncated" for end in ends[:fleet]]
    assert [*truncated.values()][:fleet] == cut
    assert [*rewards.values()] == [*record.uavs["reward"], *[0.0] * (len(rewards) - fleet)]
