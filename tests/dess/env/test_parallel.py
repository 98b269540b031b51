"""The environment of one mission equals ``simulate``, and repeats its episodes."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from hypothesis import given
from hypothesis import strategies as st

import dess
from dess import InputError, ScenarioSpace
from dess.observations.observer import ENCODERS
from dess.observations.states import compact_states, layout_of, masks
from dess.state import END_NAMES, HOVER, spaces_of
from tests.dess.env.episodes import PAPER, masks_of, play, small
from tests.drawn import Commuter, Recorder, Wanderer, replications, seeds, spaces

# The arrays of an observation, in the order of the inputs of the shipped learner's network.
NAMES = {"nodes": ("vector", "nodes"), "maps": ("local", "global", "battery")}


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
            assert gained[agent] == sum(info["reward_terms"].tolist())
            assert info["team_collected"] == next(iter(infos.values()))["team_collected"]
            end = END_NAMES[info["end"]]
            assert terminated[agent] == (end in ("quota", "battery"))
            assert truncated[agent] == (end == "truncated")
            ends[agent] = end
        own = sum(info["collected"] for info in infos.values())
        assert own == pytest.approx(info["team_collected"], abs=1e-9)
        team_collected += info["team_collected"]
        slot += 1
    assert env.record().metrics == record.metrics
    assert np.array_equal(env.record().uavs, record.uavs)
    assert list(rewards.values()) == record.uavs["reward"].tolist()
    assert list(ends.values()) == [END_NAMES[end] for end in record.uavs["end"]]
    assert team_collected == record.collected


@pytest.mark.parametrize("ended", ["leave", "stay"])
@pytest.mark.parametrize("guarded", [False, True])
@pytest.mark.parametrize("kind", list(ENCODERS))
def test_observations_and_masks_are_those_of_the_shipped_learner(
    kind: str, guarded: bool, ended: str
) -> None:
    space = spaces_of([PAPER])[0]
    encoder = ENCODERS[kind](layout_of(space))
    env = dess.parallel_env(space, observation=kind, guarded=guarded, ended=ended)
    mission = dess.vector_env(space, 1)  # shows the view of the same moment
    mission.reset(seed=5)
    observations, _ = env.reset(seed=5)
    generator = np.random.default_rng(0)
    for _ in range(60):
        view = mission.view()
        states = compact_states(view.state, guarded)
        parts = encoder.encode(states, view.mission, view.uav)
        allowed = masks(states, view.mission, view.uav)
        actions = {agent: HOVER for agent in env.agents}
        for row, i in enumerate(view.uav):
            agent = env.possible_agents[i]
            own = observations[agent]["observation"]
            seen = [own[name] for name in NAMES[kind]] if kind in NAMES else [own]
            assert all(np.array_equal(a, b[row]) for a, b in zip(seen, parts, strict=True))
            assert np.array_equal(observations[agent]["action_mask"], allowed[row])
            actions[agent] = int(generator.choice(np.flatnonzero(allowed[row])))
        mission.step(np.array([actions.get(agent, HOVER) for agent in env.possible_agents]))
        observations, *_ = env.step(actions)


@given(spaces(), seeds, st.integers(0, 9))
def test_who_stays_observes_zeros_and_changes_nothing(
    space: ScenarioSpace, seed: int, whims: int
) -> None:
    """With ``ended="stay"`` the mission is the same, and only flying UAVs have something in it."""
    leave = dess.parallel_env(space, seed, mask="info")
    stay = dess.parallel_env(space, seed, mask="info", ended="stay")
    (_, first), (_, other) = leave.reset(), stay.reset()
    generator, rewards = np.random.default_rng(whims), dict.fromkeys(stay.possible_agents, 0.0)
    flying = set(leave.agents)
    masks, stayed = masks_of({}, first), masks_of({}, other)
    while leave.agents:
        assert stay.agents == stay.possible_agents
        for agent in stay.agents:
            if agent in flying:
                assert np.array_equal(masks[agent], stayed[agent])
            else:
                assert np.flatnonzero(stayed[agent]).tolist() == [HOVER]
        actions: dict[str, Any] = {agent: int(generator.integers(5)) for agent in leave.agents}
        observations, gained, _, _, infos = leave.step(actions)
        surplus = {
            a: 7 for a in stay.possible_agents if a not in flying and generator.random() < 0.5
        }
        all_seen, all_gained, terminated, truncated, all_infos = stay.step(actions | surplus)
        for agent in stay.possible_agents:
            rewards[agent] += all_gained[agent]
            assert all_infos[agent]["active"] == (agent in leave.agents)
            if agent in flying:
                assert data_equivalence(all_seen[agent], observations[agent], exact=True)
                assert all_gained[agent] == gained[agent]
                assert data_equivalence(all_infos[agent], infos[agent], exact=True)
            else:
                assert not all_seen[agent].any() and all_gained[agent] == 0.0
                assert not all_infos[agent]["reward_terms"].any()
            over = terminated[agent] or truncated[agent]
            assert over == (not leave.agents)
        masks, stayed, flying = masks_of({}, infos), masks_of({}, all_infos), set(leave.agents)
    assert stay.agents == []
    record = stay.record()
    assert data_equivalence(record.metrics, leave.record().metrics, exact=True)
    ends = [END_NAMES[info["end"]] for info in all_infos.values()]
    fleet = len(record.uavs)
    assert ends[:fleet] == [END_NAMES[end] for end in record.uavs["end"]]
    assert [*truncated.values()][:fleet] == [end == "truncated" for end in ends[:fleet]]
    assert [*rewards.values()] == [*record.uavs["reward"], *[0.0] * (len(rewards) - fleet)]


def test_bad_input_is_refused_with_one_line() -> None:
    env = dess.parallel_env(small())
    with pytest.raises(InputError, match=r"allowed: reset\(\) first"):
        env.step({"uav_0": 0})
    assert env.step({}) == ({}, {}, {}, {}, {})  # as PettingZoo has it
    env.reset()
    for actions in ({}, {"uav_1": 0}, {"uav_0": 0, "uav_1": 0}):
        with pytest.raises(InputError, match="actions: of .*uav_0"):
            env.step(actions)
    for action in (5, -1):
        with pytest.raises(InputError, match="allowed: 0..4"):
            env.step({"uav_0": action})
    for name in ("observation", "mask", "ended", "render_mode"):
        with pytest.raises(InputError, match=f"{name}: 'x' is unknown"):
            dess.parallel_env(PAPER, **{name: "x"})
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
