"""The environment of one mission: PettingZoo's own tests, and parity with the SimPy engine."""

import runpy
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from hypothesis import given
from hypothesis import strategies as st
from pettingzoo.test import parallel_api_test, parallel_seed_test, seed_test
from pettingzoo.utils import parallel_to_aec

import dess
from dess import InputError, ScenarioSpace
from dess.state import END_NAMES, HOVER
from tests.dess.env.episodes import PAPER, play, small
from tests.drawn import Commuter, Recorder, Wanderer, replications, seeds, spaces


@pytest.mark.parametrize("scenario", [PAPER, dess.load_scenario("paper", uavs=3)])
def test_it_passes_pettingzoos_api_test(scenario: ScenarioSpace) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # The fleet of an episode can be smaller than the largest one.
        warnings.filterwarnings("ignore", "No agents present but not all possible_agents")
        parallel_api_test(dess.parallel_env(scenario), num_cycles=600)


def test_it_passes_pettingzoos_seed_tests() -> None:
    parallel_seed_test(lambda: dess.parallel_env(PAPER))
    seed_test(lambda: parallel_to_aec(dess.parallel_env(PAPER)))  # plays a whole episode


def test_a_seed_repeats_a_sequence_of_whole_episodes() -> None:
    env, other = dess.parallel_env(PAPER), dess.parallel_env(PAPER, seed=4)
    first = [play(env, 1, seed=3), play(env, 2)]
    assert data_equivalence(first, [play(other, 1, seed=3), play(other, 2)], exact=True)
    assert data_equivalence(first, [play(env, 1, seed=3), play(env, 2)], exact=True)
    assert not data_equivalence(first[0], play(env, 1, seed=4))


def test_reset_counts_replications() -> None:
    env = dess.parallel_env(PAPER, seed=7)

    def started() -> tuple[int, int]:
        record = env.record()
        return record.seed, record.replication

    seen = []
    for reset in ({}, {}, {"options": {"replication": 40}}, {}, {"seed": 8}, {"options": {}}):
        env.reset(**reset)
        seen.append(started())
    assert seen == [(7, 0), (7, 1), (7, 40), (7, 41), (8, 0), (8, 1)]


@given(spaces(), seeds, replications, st.sampled_from([Wanderer(), Commuter()]), st.integers(0, 9))
def test_the_same_actions_give_the_record_of_simulate(
    space: ScenarioSpace, seed: int, replication: int, policy: Any, whims: int
) -> None:
    recorder = Recorder(policy)
    record = dess.simulate(space, recorder, seed, replication)
    env = dess.parallel_env(space, seed)
    env.reset(options={"replication": replication})
    generator = np.random.default_rng(whims)
    rewards, ends = dict.fromkeys(env.agents, 0.0), {}
    slot, team_collected = 0, 0.0
    while env.agents:
        # A UAV that charges was not asked; whatever its action, it hovers.
        actions = {
            agent: recorder.asked.get((slot, i), int(generator.integers(5)))
            for i, agent in enumerate(env.possible_agents)
            if agent in env.agents
        }
        _, gained, terminated, truncated, infos = env.step(actions)
        for agent, info in infos.items():
            rewards[agent] += gained[agent]
            assert gained[agent] == sum(info["reward_terms"].values())
            assert info["team_collected"] == next(iter(infos.values()))["team_collected"]
            assert terminated[agent] == (info["end"] in ("quota", "battery"))
            assert truncated[agent] == (info["end"] == "truncated")
            ends[agent] = info["end"]
        own = sum(info["collected"] for info in infos.values())
        assert own == pytest.approx(info["team_collected"], abs=1e-9)
        team_collected += info["team_collected"]
        slot += 1
    assert env.record().metrics == record.metrics
    assert np.array_equal(env.record().uavs, record.uavs)
    assert list(rewards.values()) == record.uavs["reward"].tolist()
    assert list(ends.values()) == [END_NAMES[end] for end in record.uavs["end"]]
    assert team_collected == record.collected


def test_a_lone_uav_is_overruled_when_its_action_is_masked_and_only_then() -> None:
    env = dess.parallel_env(small())
    generator = np.random.default_rng(0)
    observations, _ = env.reset(seed=0)
    overruled = 0
    while env.agents:
        mask = observations["uav_0"]["action_mask"]
        action = int(generator.integers(5))
        observations, _, _, _, infos = env.step({"uav_0": action})
        if not observations["uav_0"]["observation"][6]:  # not charging
            assert infos["uav_0"]["overruled"] == (not mask[action])
            overruled += infos["uav_0"]["overruled"]
    assert overruled > 0


def test_the_state_is_the_observations_of_all_possible_agents() -> None:
    env = dess.parallel_env(dess.load_scenario("paper", uavs=[2, 3]), seed=0)
    fleets = set()
    for _ in range(10):
        observations, _ = env.reset()
        fleets.add(len(env.agents))
        rows = [observations[agent]["observation"] for agent in env.agents]
        absent = np.zeros((3 - len(rows), len(rows[0])), np.float32)
        assert np.array_equal(env.state(), np.concatenate([*rows, *absent]))
        assert env.state_space.contains(env.state())
    assert fleets == {2, 3}


@pytest.mark.parametrize(
    ("values", "end", "slots", "term"),
    [
        ({"max_slots": 3}, "truncated", 3, 0.0),
        ({"flying_time": 2, "charge_start": 10}, "battery", 2, -300.0),
        ({"quota": 7}, "quota", 2, 100.0),  # overshot by one
        ({"quota": 8, "flying_time": 2}, "quota", 2, 100.0),  # filled on the last percent
        ({"quota": 8, "max_slots": 2}, "quota", 2, 100.0),  # filled in the last slot
    ],
)
def test_terminated_is_not_truncated(values: dict, end: str, slots: int, term: float) -> None:
    env = dess.parallel_env(small(**values))
    env.reset()
    # To the west, out of the zone, so that nobody charges.
    steps = []
    while env.agents:
        steps.append(env.step({"uav_0": 3}))
    observations, _, terminated, truncated, infos = steps[-1]
    assert env.observation_space("uav_0").contains(observations["uav_0"])
    assert (len(steps), infos["uav_0"]["end"]) == (slots, end)
    assert terminated["uav_0"] == (end != "truncated")
    assert truncated["uav_0"] == (end == "truncated")
    terms = infos["uav_0"]["reward_terms"]
    assert terms["quota"] + terms["depleted"] == term
    assert all(not step[2]["uav_0"] and not step[3]["uav_0"] for step in steps[:-1])


def test_bad_input_is_refused_with_one_line() -> None:
    env = dess.parallel_env(small())
    with pytest.raises(InputError, match="call reset"):
        env.step({"uav_0": 0})
    env.reset()
    for actions in ({}, {"uav_1": 0}, {"uav_0": 0, "uav_1": 0}):
        with pytest.raises(InputError, match="actions: of .*uav_0"):
            env.step(actions)
    for action in (5, -1):
        with pytest.raises(InputError, match="allowed: 0..4"):
            env.step({"uav_0": action})
    with pytest.raises(InputError, match="render_mode"):
        dess.parallel_env(PAPER, render_mode="human")
    with pytest.raises(InputError, match="seed"):
        env.reset(seed=-1)
    with pytest.raises(InputError, match="replication"):
        env.reset(options={"replication": 2**32})
    assert not env.record().success  # the episode is unchanged
    env.step({"uav_0": HOVER})


def test_the_example_runs(capsys: pytest.CaptureFixture) -> None:
    example = Path(__file__).parents[3] / "examples" / "random_actions.py"
    runpy.run_path(str(example))
    assert "data units collected" in capsys.readouterr().out
