"""A batch of missions equals single episodes, in any number of environments."""

import numpy as np
import pytest
from dess.env.batch import BatchEnv
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

import dess
from dess import InputError, ScenarioSpace
from dess.state import HOVER
from tests.dess.env.episodes import PAPER, small
from tests.drawn import Commuter


def arbitrary_action(replication: int, slot: int, uav: int) -> int:
    """An action 0..4 that depends on its arguments alone; Hover in half of the cases."""
    return int(np.random.default_rng([replication, slot, uav]).choice([0, 1, 2, 3, 4, 4, 4]))


def batch_actions(env: BatchEnv) -> np.ndarray:
    """Arbitrary actions of all UAVs of a batch."""
    fleet = range(env.state.uavs.shape[1])
    times = [(int(m["replication"]), int(m["slot"])) for m in env.state.missions]
    return np.array([[arbitrary_action(*time, i) for i in fleet] for time in times])


QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], charge_start=[10, 50], max_slots=60)


def assert_same(observed: dict, batch: dict, b: int) -> None:
    """The single environment's observations equal those in row ``b`` of the batch."""
    for agent, observation in observed.items():
        row = (b, int(agent.removeprefix("uav_")))
        assert all(np.array_equal(observation[key], batch[key][row]) for key in batch)


@pytest.mark.parametrize("num_envs", [1, 3, 4])
def test_a_batch_equals_single_episodes(num_envs: int) -> None:
    batch = dess.batch_env(QUICK, num_envs, seed=5)
    singles = [dess.parallel_env(QUICK, seed=5) for _ in range(num_envs)]
    observations, info = batch.reset()
    for b, single in enumerate(singles):
        assert_same(single.reset(options={"replication": b})[0], observations, b)
    finished = 0
    for _ in range(180):
        actions = batch_actions(batch)
        observations, *outcome, info = batch.step(actions)
        over = info.get("_final_obs", np.zeros(num_envs, bool))
        for b, single in enumerate(singles):
            rows = [single.possible_agents.index(agent) for agent in single.agents]
            assert info["acted"][b].nonzero()[0].tolist() == rows
            assert all(not part[b][~info["acted"][b]].any() for part in outcome)
            observed, *expected, _ = single.step({f"uav_{i}": actions[b, i] for i in rows})
            assert_same(observed, info["final_obs"] if over[b] else observations, b)
            for part, values in zip(outcome, expected, strict=True):
                assert part[b, rows].tolist() == list(values.values())
            assert over[b] == (not single.agents)
            if over[b]:
                metrics, uavs = (part[over[:b].sum()] for part in info["final_records"])
                assert single.record().metrics == metrics
                assert np.array_equal(single.record().uavs, uavs[: metrics["uavs"]])
                observed, _ = single.reset(options={"replication": info["replication"][b]})
                assert_same(observed, observations, b)
                finished += 1
    assert finished > num_envs


@pytest.mark.parametrize("num_envs", [1, 2, 5])
def test_missions_are_numbered_as_they_start(num_envs: int) -> None:
    env = dess.batch_env(QUICK, num_envs, seed=1)
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    _, info = env.reset()
    started = info["replication"].tolist()
    assert started == list(range(num_envs))
    for _ in range(80):
        before = info["replication"]
        *_, info = env.step(batch_actions(env))
        started += info["replication"][info["replication"] != before].tolist()
        assert (info["active"].any(1)).all()
    assert started == list(range(len(started)))
    assert len(started) > num_envs
    _, info = env.reset()  # goes on
    assert info["replication"].tolist() == [len(started) + b for b in range(num_envs)]
    again, info = env.reset(seed=1)
    assert info["replication"].tolist() == list(range(num_envs))
    fresh, _ = dess.batch_env(QUICK, num_envs, seed=1).reset()
    assert data_equivalence(again, fresh, exact=True)


def test_a_policy_can_play_the_batch() -> None:
    env = dess.batch_env(QUICK, 4, seed=2)
    env.reset()
    records = []
    while len(records) < 8:
        view = env.view()
        actions = np.full(env.action_space.shape, HOVER)
        actions[view.mission, view.uav] = Commuter().act(view)
        *_, info = env.step(actions)
        if "final_records" in info:
            records += list(info["final_records"].missions)
    expected = dess.simulate_batch(QUICK, Commuter(), 2, 100).missions
    assert all(record == expected[record["replication"]] for record in records)


def test_bad_input_is_refused_with_one_line() -> None:
    env = dess.batch_env(small(), 2)
    with pytest.raises(InputError, match="call reset"):
        env.step(np.zeros((2, 1), int))
    env.reset()
    for action in (5, -1):
        with pytest.raises(InputError, match="allowed: 0..4"):
            env.step(np.array([[0], [action]]))
    for actions in (
        np.zeros((2, 1)),
        np.zeros(2, int),
        np.zeros((2, 2), int),
        [["north"], ["east"]],
    ):
        with pytest.raises(InputError, match=r"integers of shape \(2, 1\)"):
            env.step(actions)
    for num_envs in (0, -1, 2.0):
        with pytest.raises(InputError, match="num_envs"):
            dess.batch_env(PAPER, num_envs)  # type: ignore[arg-type]
