"""A batch of missions equals single episodes, in any number of environments."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import flatten
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector as wrappers

import dess
from dess import InputError, ScenarioSpace
from dess.env.vector import HarvestVectorEnv
from dess.observations.observer import KINDS
from dess.record import MISSION_RECORD, UAV_RECORD
from dess.state import HOVER, TRUNCATED
from tests.dess.env.episodes import PAPER, small

QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], charge_start=[10, 50], max_slots=60)
FLEET = 3


def arbitrary_action(replication: int, slot: int, uav: int) -> int:
    """An action 0..4 that depends on its arguments alone; Hover in half of the cases."""
    return int(np.random.default_rng([replication, slot, uav]).choice([0, 1, 2, 3, 4, 4, 4]))


def arbitrary_actions(env: HarvestVectorEnv) -> np.ndarray:
    """Arbitrary actions of all rows."""
    times = [(int(m["replication"]), int(m["slot"])) for m in env.state.missions]
    return np.array([arbitrary_action(*time, i) for time in times for i in range(FLEET)])


def row_of(observations: Any, row: int) -> Any:
    """One row of observations, which are an array or a dictionary of arrays."""
    if isinstance(observations, dict):
        return {name: part[row] for name, part in observations.items()}
    return observations[row]


def assert_same(observed: dict[str, Any], rows: Any, first: int) -> None:
    """The observations of a single environment equal those in the rows from ``first`` on."""
    for agent, seen in observed.items():
        row = row_of(rows, first + int(agent.removeprefix("uav_")))
        assert data_equivalence(seen["observation"], row, exact=True)


@pytest.mark.parametrize("num_envs", [1, 3])
@pytest.mark.parametrize("observation", KINDS)
def test_a_batch_equals_single_episodes(num_envs: int, observation: str) -> None:
    guarded = num_envs == 3
    kind: dict[str, Any] = {"seed": 5, "observation": observation, "guarded": guarded}
    batch = dess.vector_env(QUICK, num_envs, **kind)
    singles = [dess.parallel_env(QUICK, **kind) for _ in range(num_envs)]
    rows, info = batch.reset()
    for b, single in enumerate(singles):
        assert_same(single.reset(options={"replication": b})[0], rows, b * FLEET)
    finished = 0
    for _ in range(120):
        actions = arbitrary_actions(batch)
        rows, rewards, terminated, truncated, info = batch.step(actions)
        over = (terminated | truncated).reshape(num_envs, FLEET)
        for b, single in enumerate(singles):
            first = b * FLEET
            agents, uavs = single.agents, [int(agent[4:]) for agent in single.agents]
            assert info["acted"][first : first + FLEET].nonzero()[0].tolist() == uavs
            observed, *expected, infos = single.step({f"uav_{i}": actions[first + i] for i in uavs})
            assert over[b].all() == over[b].any() == (not single.agents)
            assert_same(observed, info["final_obs"] if over[b].all() else rows, first)
            for i in range(FLEET):
                assert rewards[first + i] == expected[0].get(f"uav_{i}", 0.0)
            for agent, i in zip(agents, uavs, strict=True):
                for name in ("reward_terms", "end", "overruled", "collected", "team_collected"):
                    assert np.array_equal(info[name][first + i], infos[agent][name]), name
                if not over[b].all():
                    mask = info["action_mask"][first + i]
                    assert mask.tolist() == observed[agent]["action_mask"].tolist()
                    assert info["active"][first + i] == infos[agent]["active"]
            if over[b].all():
                assert_same_record(single.record(), info["final_info"], first)
                ends = single.record().uavs["end"]
                whole = truncated[first : first + len(ends)]
                assert whole.tolist() == (ends == TRUNCATED).tolist()
                replication = {"replication": info["replication"][first]}
                assert_same(single.reset(options=replication)[0], rows, first)
                finished += 1
    assert finished > num_envs


def assert_same_record(record: Any, final: dict[str, Any], first: int) -> None:
    """The record equals the one in ``info["final_info"]`` from row ``first`` on."""
    for i in range(FLEET):
        for name in MISSION_RECORD.names or ():
            assert final[name][first + i] == record.metrics[name], name
    for name in UAV_RECORD.names or ():
        of_uavs = final["uav"][name][first : first + len(record.uavs)]
        assert np.array_equal(of_uavs, record.uavs[name]), name


@pytest.mark.parametrize("observation", KINDS)
def test_rows_without_a_uav_are_zeros_that_may_only_hover(observation: str) -> None:
    """And what was returned is never overwritten: another environment returns the same."""
    env, again = (dess.vector_env(QUICK, 5, 2, observation) for _ in range(2))
    (rows, info), idle, steps = env.reset(), np.zeros(1), []
    acted = info["active"]
    for _ in range(60):
        idle = ~(acted | info["active"])
        for row in idle.nonzero()[0]:
            assert not flatten(env.single_observation_space, row_of(rows, row)).any()
        assert (info["action_mask"][~info["active"]] == (np.arange(5) == HOVER)).all()
        assert info["action_mask"].any(1).all()
        assert info["action_mask"] is env.action_masks()
        steps.append(env.step(arbitrary_actions(env)))
        rows, rewards, terminated, truncated, info = steps[-1]
        assert env.observation_space.contains(rows)
        assert not (terminated & truncated).any()
        acted = info["acted"]
        assert not rewards[~acted].any()
    assert idle.any()
    again.reset()
    for step in steps:
        assert data_equivalence(step, again.step(arbitrary_actions(again)), exact=True)


@pytest.mark.parametrize("num_envs", [1, 3])
def test_missions_are_numbered_as_they_start(num_envs: int) -> None:
    env = dess.vector_env(QUICK, num_envs, seed=1)
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert (env.missions, env.num_envs) == (num_envs, num_envs * FLEET)

    def numbers(info: dict[str, Any]) -> np.ndarray:
        of_rows = info["replication"].reshape(num_envs, FLEET)
        assert (of_rows == of_rows[:, :1]).all()
        return of_rows[:, 0]

    started = numbers(env.reset()[1]).tolist()
    assert started == list(range(num_envs))
    before = np.array(started)
    for _ in range(80):
        *_, info = env.step(arbitrary_actions(env))
        now = numbers(info)
        started += now[now != before].tolist()
        before = now
        assert info["active"].reshape(num_envs, FLEET).any(1).all()
    assert started == list(range(len(started)))
    assert len(started) > num_envs
    _, info = env.reset()  # goes on
    assert numbers(info).tolist() == [len(started) + b for b in range(num_envs)]
    _, info = env.reset(options={"replication": 40})
    assert numbers(info).tolist() == [40 + b for b in range(num_envs)]
    again, info = env.reset(seed=1)
    assert numbers(info).tolist() == list(range(num_envs))
    fresh, _ = dess.vector_env(QUICK, num_envs, seed=1).reset()
    assert data_equivalence(again, fresh, exact=True)


def test_gymnasium_makes_it_from_a_name_with_options() -> None:
    env = gymnasium.make_vec("dess.env.vector:dess/Paper-v0", num_envs=64)
    assert env.num_envs == 64 * PAPER.uavs[1]
    small_vision = gymnasium.make_vec(
        "dess.env.vector:dess/Paper-v0", 2, observation="maps", guarded=True
    )
    assert set(small_vision.single_observation_space.keys()) == {"local", "global", "battery"}


def test_the_returns_that_gymnasium_counts_are_those_of_the_records() -> None:
    env = wrappers.RecordEpisodeStatistics(dess.vector_env(QUICK, 4, 3))
    env.reset()
    ended = 0
    for _ in range(120):
        *_, info = env.step(arbitrary_actions(env.unwrapped))
        if "episode" in info:
            over, final = info["_episode"], info["final_info"]
            assert np.array_equal(over, info["_final_info"])
            returns = info["episode"]["r"][over]
            assert returns == pytest.approx(final["uav"]["reward"][over], abs=1e-9)
            assert (info["episode"]["l"][over] == final["slots"][over]).all()
            ended += over.sum()
    assert ended >= 4 * FLEET


NEXT_STEP = AutoresetMode.NEXT_STEP


def test_the_next_mission_can_start_in_the_next_step() -> None:
    env = dess.vector_env(QUICK, 4, seed=3, autoreset_mode="NextStep")
    plain = dess.vector_env(QUICK, 1, seed=3)
    assert env.metadata["autoreset_mode"] is NEXT_STEP
    rows, info = env.reset()
    expected, _ = plain.reset()
    waited = 0
    for _ in range(60):  # of the first environment, until its second mission
        actions = arbitrary_actions(env)
        rows, rewards, terminated, truncated, info = env.step(actions)
        over = terminated | truncated
        if waited:
            assert not over[:FLEET].any() and not rewards[:FLEET].any()
            assert not info["acted"][:FLEET].any() and info["active"][:FLEET].any()
            break
        *_, gained, ended, cut, last = plain.step(actions[:FLEET])
        assert np.array_equal(rewards[:FLEET], gained)
        assert np.array_equal(over[:FLEET], ended | cut)
        if over[:FLEET].any():
            waited += 1
            assert np.array_equal(rows[:FLEET], np.stack(last["final_obs"]))
            assert env.action_masks()[:FLEET].sum() == FLEET
            slots = info["final_info"]["slots"][:FLEET], last["final_info"]["slots"]
            assert np.array_equal(*slots)
    assert waited and "final_obs" not in info


def test_it_refuses_other_modes_of_reset() -> None:
    for mode in ("Disabled", AutoresetMode.DISABLED, "soon"):
        with pytest.raises(InputError, match="autoreset_mode.*SameStep or NextStep"):
            dess.vector_env(QUICK, 2, autoreset_mode=mode)


def test_bad_input_is_refused_with_one_line() -> None:
    env = dess.vector_env(small(), 2)
    with pytest.raises(InputError, match=r"allowed: reset\(\) first"):
        env.step(np.zeros(2, int))
    env.reset()
    for action in (5, -1):
        with pytest.raises(InputError, match="allowed: 0..4"):
            env.step(np.array([0, action]))
    for actions in (np.zeros(2), np.zeros(3, int), np.zeros((2, 1), int), ["north", "east"]):
        with pytest.raises(InputError, match=r"integers of shape \(2,\)"):
            env.step(actions)  # type: ignore[arg-type]
    for num_envs in (0, -1, 2.0):
        with pytest.raises(InputError, match="num_envs"):
            dess.vector_env(PAPER, num_envs)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="observation: 'pixels' is unknown.*maps"):
        dess.vector_env(PAPER, 2, observation="pixels")
    with pytest.raises(InputError, match="seed"):
        env.reset(seed=-1)
