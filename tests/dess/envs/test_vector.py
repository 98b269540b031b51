"""A batch of missions equals single episodes, in any number of environments."""

from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import flatten
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

import dess
from dess import InputError, ScenarioSpace
from dess.envs.observations.observer import KINDS
from dess.envs.vector import HarvestVectorEnv
from dess.model.record import MISSION_RECORD, UAV_RECORD
from dess.model.state import HOVER, TRUNCATED
from tests.dess.envs.episodes import PAPER, small

QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], charge_start=[10, 50], max_slots=60)
FLEET = 3


def arbitrary_actions(env: HarvestVectorEnv) -> np.ndarray:
    """Actions of all rows that depend on their mission and its slot alone; half of them Hover."""
    times = [(int(m["replication"]), int(m["slot"])) for m in env.state.missions]
    draws = [np.random.default_rng(time).choice([0, 1, 2, 3, 4, 4, 4], FLEET) for time in times]
    return np.concatenate(draws)


def row_of(observations: Any, row: int) -> Any:
    """One row of observations, which are an array or a dictionary of arrays."""
    if isinstance(observations, dict):
        return {name: part[row] for name, part in observations.items()}
    return observations[row]


def assert_same(observed: dict[str, Any], rows: Any, first: int) -> None:
    """The observations of a single environment equal those in the rows from ``first`` on."""
    for agent, seen in observed.items():
        row = row_of(rows, first + int(agent[4:]))
        assert data_equivalence(seen["observation"], row, exact=True)


def assert_same_record(record: Any, final: dict[str, Any], first: int) -> None:
    """The record equals the one in ``info["final_info"]`` from row ``first`` on."""
    for name in MISSION_RECORD.names or ():
        assert (final[name][first : first + FLEET] == record.metrics[name]).all(), name
    for name in UAV_RECORD.names or ():
        of_uavs = final["uav"][name][first : first + len(record.uavs)]
        assert np.array_equal(of_uavs, record.uavs[name]), name


@pytest.mark.parametrize("num_envs", [1, 3])
@pytest.mark.parametrize("observation", KINDS)
def test_a_batch_equals_single_episodes(num_envs, observation):
    kind: dict[str, Any] = {"seed": 5, "observation": observation, "guarded": num_envs == 3}
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
            first, agents = b * FLEET, single.agents
            uavs = [int(agent[4:]) for agent in agents]
            assert info["acted"][first : first + FLEET].nonzero()[0].tolist() == uavs
            observed, *expected, infos = single.step({f"uav_{i}": actions[first + i] for i in uavs})
            assert over[b].all() == over[b].any() == (not single.agents)
            assert_same(observed, info["final_obs"] if over[b].all() else rows, first)
            gained = [expected[0].get(f"uav_{i}", 0.0) for i in range(FLEET)]
            assert rewards[first : first + FLEET].tolist() == gained
            shown = ("reward_terms", "end", "overruled", "collected", "team_collected")
            for agent, i in zip(agents, uavs, strict=True):
                for name in (*shown, *([] if over[b].all() else ["active"])):
                    assert np.array_equal(info[name][first + i], infos[agent][name]), name
                if not over[b].all():
                    mask = info["action_mask"][first + i]
                    assert mask.tolist() == observed[agent]["action_mask"].tolist()
            if over[b].all():
                assert_same_record(single.record(), info["final_info"], first)
                cut = single.record().uavs["end"] == TRUNCATED
                assert truncated[first : first + len(cut)].tolist() == cut.tolist()
                replication = {"replication": info["replication"][first]}
                assert_same(single.reset(options=replication)[0], rows, first)
                finished += 1
    assert finished > num_envs


@pytest.mark.parametrize("observation", KINDS)
def test_rows_without_a_uav_are_zeros_that_may_only_hover(observation):
    """And what was returned is never overwritten: another environment returns the same."""
    env, again = (dess.vector_env(QUICK, 5, 2, observation) for _ in range(2))
    (rows, info), idle, steps = env.reset(), np.zeros(1), []
    acted = info["active"]
    for _ in range(60):
        idle = ~(acted | info["active"])
        for row in idle.nonzero()[0]:
            assert not flatten(env.single_observation_space, row_of(rows, row)).any()
        assert (info["action_mask"][~info["active"]] == (np.arange(5) == HOVER)).all()
        assert info["action_mask"].any(1).all() and info["action_mask"] is env.action_masks()
        steps.append(env.step(arbitrary_actions(env)))
        rows, rewards, terminated, truncated, info = steps[-1]
        assert env.observation_space.contains(rows) and not (terminated & truncated).any()
        acted = info["acted"]
        assert not rewards[~acted].any()
    assert idle.any()
    again.reset()
    for step in steps:
        assert data_equivalence(step, again.step(arbitrary_actions(again)), exact=True)


@pytest.mark.parametrize("num_envs", [1, 3])
def test_missions_are_numbered_as_they_start(num_envs):
    env = dess.vector_env(QUICK, num_envs, seed=1)

    def numbers(info: dict[str, Any]) -> list[int]:
        of_rows = info["replication"].reshape(num_envs, FLEET)
        assert (of_rows == of_rows[:, :1]).all()
        return of_rows[:, 0].tolist()

    first, info = env.reset()
    started = before = numbers(info)
    for _ in range(80):
        *_, info = env.step(arbitrary_actions(env))
        now = numbers(info)
        started = started + [n for n, was in zip(now, before, strict=True) if n != was]
        before = now
        assert info["active"].reshape(num_envs, FLEET).any(1).all()
    assert started == [*range(len(started))] and len(started) > num_envs
    for reset, low in (({}, len(started)), ({"options": {"replication": 40}}, 40)):
        assert numbers(env.reset(**reset)[1]) == [low + b for b in range(num_envs)]  # type: ignore
    assert data_equivalence(env.reset(seed=1)[0], first, exact=True)


def test_the_next_mission_can_start_in_the_next_step():
    env = dess.vector_env(QUICK, 4, seed=3, autoreset_mode="NextStep")
    plain = dess.vector_env(QUICK, 1, seed=3)
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    env.reset(), plain.reset()
    own, over = slice(0, FLEET), np.zeros(1, bool)  # the first environment, to its second mission
    while not over[own].any():
        actions = arbitrary_actions(env)
        rows, rewards, terminated, truncated, info = env.step(actions)
        over = terminated | truncated
        *_, gained, ended, cut, last = plain.step(actions[own])
        assert np.array_equal(rewards[own], gained)
        assert np.array_equal(over[own], ended | cut)
    assert np.array_equal(rows[own], np.stack(last["final_obs"]))
    assert env.action_masks()[own].sum() == FLEET and "final_obs" not in info
    slots = info["final_info"]["slots"][own], last["final_info"]["slots"]
    assert np.array_equal(*slots)
    _, rewards, terminated, truncated, info = env.step(arbitrary_actions(env))
    assert not (terminated | truncated)[own].any() and not rewards[own].any()
    assert not info["acted"][own].any() and info["active"][own].any()


REFUSED: dict[str, Any] = {
    "num_envs: 0": lambda: dess.vector_env(PAPER, 0),
    "num_envs: 2.0": lambda: dess.vector_env(PAPER, 2.0),  # type: ignore[arg-type]
    "autoreset_mode": lambda: dess.vector_env(PAPER, 2, autoreset_mode="Disabled"),
    "observation: 'pixels' is unknown": lambda: dess.vector_env(PAPER, 2, observation="pixels"),
    "mask: 'x' is unknown": lambda: dess.parallel_env(PAPER, mask="x"),
    "ended: 'x' is unknown": lambda: dess.parallel_env(PAPER, ended="x"),
    "render_mode: 'x' is unknown": lambda: dess.parallel_env(PAPER, render_mode="x"),
    "step: no episode": lambda: dess.parallel_env(PAPER).step({"uav_0": 0}),
    "step: no mission": lambda: dess.vector_env(PAPER, 1).step(np.zeros(FLEET, int)),
}


@pytest.mark.parametrize("line", REFUSED)
def test_bad_arguments_are_refused(line):
    with pytest.raises(InputError, match=f"^{line}.*; allowed: .*$"):
        REFUSED[line]()


def test_bad_actions_and_seeds_are_refused():
    batch, single = dess.vector_env(small(), 2), dess.parallel_env(small())
    batch.reset(), single.reset()
    shapes: list[Any] = [np.zeros(2), np.zeros(3, int), np.zeros((2, 1), int), ["north", "east"]]
    for actions in (*shapes, np.array([0, 5]), np.array([0, -1])):
        with pytest.raises(InputError, match="allowed: (0..4|integers of shape)"):
            batch.step(actions)
    wrong: list[dict[str, int]] = [{}, {"uav_1": 0}, {"uav_0": 0, "uav_1": 0}, {"uav_0": 5}]
    for asked in wrong:
        with pytest.raises(InputError, match="^actions: "):
            single.step(asked)
    for reset in ({"seed": -1}, {"options": {"replication": 2**32}}):
        for env in (batch, single):
            with pytest.raises(InputError, match="seed|replication"):
                env.reset(**reset)  # type: ignore[arg-type]
    single.step({"uav_0": HOVER})  # the episode goes on
