"""The environments: PettingZoo's own tests, and parity with the engines and with each other."""

import runpy
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from hypothesis import given
from hypothesis import strategies as st
from pettingzoo.test import parallel_api_test, parallel_seed_test, seed_test
from pettingzoo.utils import parallel_to_aec

import dess
from dess import InputError, Scenario, ScenarioSpace
from dess.env.batch import BatchEnv
from dess.env.observation import observation_names
from dess.env.parallel import HarvestEnv
from dess.state import END_NAMES, HOVER, STEP_X, STEP_Y
from tests.drawn import Commuter, Recorder, Wanderer, replications, seeds, spaces

PAPER = dess.load_scenario("paper")
# Two nodes, no shadowing, no arrivals, and a zone in the corner: what happens can be told by hand.
SMALL: dict[str, Any] = {
    "grid": 5,
    "nodes": ((0, 0), (4, 4)),
    "zone": (3, 0, 2, 2),
    "shadowing_variance": 0.0,
    "arrival_rate": 0.0,
    "initial_data": 1e6,
    "uavs": 1,
    "flying_time": 50,
    "charge_start": 20,
    "charge_complete": 60,
}


def small(**values: Any) -> Scenario:
    """The small scenario with other values."""
    return Scenario.of(**(SMALL | values))


def play(env: HarvestEnv, actions_seed: int, **reset: Any) -> list[tuple]:
    """An episode of random legal actions: all that the environment returned."""
    generator = np.random.default_rng(actions_seed)
    observations, infos = env.reset(**reset)
    story: list[tuple] = [(observations, infos)]
    while env.agents:
        actions = {
            agent: generator.choice(np.nonzero(observations[agent]["action_mask"])[0])
            for agent in env.agents
        }
        observations, *rest = env.step(actions)
        story.append((observations, *rest))
    return story


# PettingZoo's own


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


# Seeds and replications


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


# Parity with the engines


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
        # A UAV that charges was not asked; whatever it is told, it hovers.
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


# Observations and masks


@given(spaces(), seeds)
def test_observations_lie_in_their_space_and_masks_name_the_moves_on_the_grid(
    space: ScenarioSpace, seed: int
) -> None:
    env = dess.parallel_env(space, seed)
    names = observation_names(space)
    edge = space.grid - 1
    for step in play(env, 0):
        for agent, observation in step[0].items():
            assert env.observation_space(agent).contains(observation)
            told = dict(zip(names, observation["observation"].tolist(), strict=True))
            x, y = round(told["x"] * edge), round(told["y"] * edge)
            inside = (np.clip(x + STEP_X, 0, edge) == x + STEP_X) & (
                np.clip(y + STEP_Y, 0, edge) == y + STEP_Y
            )
            held = told["charging"] or not told["active"]
            expected = np.arange(5) == HOVER if held else inside
            assert observation["action_mask"].tolist() == expected.tolist()


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


def test_an_observation_told_by_hand() -> None:
    # A zone of two cells, (3, 0) and (4, 0): the UAVs start there, 30 % is above C_S, below C_C.
    scenario = small(zone=(3, 0, 2, 1), uavs=2, flying_time=30, initial_data=[0, 8], quota=400)
    env = dess.parallel_env(scenario)
    observations, _ = env.reset()
    names = observation_names(scenario)
    left = min(env.agents, key=lambda a: observations[a]["observation"][names.index("x")])
    # West, out of the zone; the other one hovers: one slot, one percent, four communications.
    observations, *_ = env.step({agent: 3 if agent == left else HOVER for agent in env.agents})
    told = dict(zip(names, observations[left]["observation"].tolist(), strict=True))
    residual = [told.pop("residual_0"), told.pop("residual_1")]
    assert np.array(residual).sum() * 8 == pytest.approx(env.record().residual, rel=1e-6)
    assert told == pytest.approx(
        {
            "active": 1,
            "x": 2 / 4,
            "y": 0,
            "battery": 0.29,
            "quota": 4 / 400,
            "latch": 0,
            "charging": 0,
            "waiting": 0,
            "zone_dx": 1 / 4,
            "zone_dy": 0,
            "charge_start": 0.2,
            "charge_complete": 0.6,
            "slot": 1 / 500,
            "mate_1_active": 1,
            "mate_1_dx": 2 / 4,
            "mate_1_dy": 0,
            "mate_1_battery": 0.29,
            "mate_1_quota": 4 / 400,
            "mate_1_charging": 0,
        }
    )


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


# Ends


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


# The batch


def whim(replication: int, slot: int, uav: int) -> int:
    """An action 0..4 that depends on nothing but who is asked and when; hovers half of the time."""
    return int(np.random.default_rng([replication, slot, uav]).choice([0, 1, 2, 3, 4, 4, 4]))


def batch_actions(env: BatchEnv) -> np.ndarray:
    """The whims of all UAVs of a batch."""
    places = [(int(m["replication"]), int(m["slot"])) for m in env.state.missions]
    return np.array([[whim(*b, i) for i in range(env.state.uavs.shape[1])] for b in places])


QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], charge_start=[10, 50], max_slots=60)


def assert_same(told: dict, batch: dict, b: int) -> None:
    """The single environment's observations equal those in row ``b`` of the batch."""
    for agent, observation in told.items():
        row = (b, int(agent.removeprefix("uav_")))
        assert all(np.array_equal(observation[key], batch[key][row]) for key in batch)


@pytest.mark.parametrize("num_envs", [1, 3, 4])
def test_lanes_of_a_batch_are_single_episodes(num_envs: int) -> None:
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
            told, *expected, _ = single.step({f"uav_{i}": actions[b, i] for i in rows})
            assert_same(told, info["final_obs"] if over[b] else observations, b)
            for part, values in zip(outcome, expected, strict=True):
                assert part[b, rows].tolist() == list(values.values())
            assert over[b] == (not single.agents)
            if over[b]:
                metrics, uavs = (part[over[:b].sum()] for part in info["final_records"])
                assert single.record().metrics == metrics
                assert np.array_equal(single.record().uavs, uavs[: metrics["uavs"]])
                told, _ = single.reset(options={"replication": info["replication"][b]})
                assert_same(told, observations, b)
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


# Pictures


def test_a_picture_shows_the_mission() -> None:
    assert dess.parallel_env(PAPER).render() is None
    env = dess.parallel_env(small(), render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    assert before is not None and before.dtype == np.uint8
    assert before.shape[0] == before.shape[1] and before.shape[2] == 3
    cell = before.shape[0] // 5
    env.step({"uav_0": 3})
    changed = np.nonzero((env.render() != before).any(2))
    cells = {(int(x // cell), int(y // cell)) for y, x in zip(*changed, strict=True)}
    # The node that was served, and two neighbours: the UAV left one for the other.
    (west_x, west_y), (east_x, east_y) = sorted(cells - {(0, 0), (4, 4)})
    assert (east_x - west_x, east_y - west_y) == (1, 0)


# Bad input


def test_bad_input_is_refused_with_one_line() -> None:
    env, batch = dess.parallel_env(small()), dess.batch_env(small(), 2)
    with pytest.raises(InputError, match="call reset"):
        env.step({"uav_0": 0})
    with pytest.raises(InputError, match="call reset"):
        batch.step(np.zeros((2, 1), int))
    env.reset()
    batch.reset()
    for actions in ({}, {"uav_1": 0}, {"uav_0": 0, "uav_1": 0}):
        with pytest.raises(InputError, match="actions: of .*uav_0"):
            env.step(actions)
    for action in (5, -1):
        with pytest.raises(InputError, match="allowed: 0..4"):
            env.step({"uav_0": action})
        with pytest.raises(InputError, match="allowed: 0..4"):
            batch.step(np.array([[0], [action]]))
    for actions in (
        np.zeros((2, 1)),
        np.zeros(2, int),
        np.zeros((2, 2), int),
        [["north"], ["east"]],
    ):
        with pytest.raises(InputError, match=r"integers of shape \(2, 1\)"):
            batch.step(actions)
    for num_envs in (0, -1, 2.0):
        with pytest.raises(InputError, match="num_envs"):
            dess.batch_env(PAPER, num_envs)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="render_mode"):
        dess.parallel_env(PAPER, render_mode="human")
    with pytest.raises(InputError, match="seed"):
        env.reset(seed=-1)
    with pytest.raises(InputError, match="replication"):
        env.reset(options={"replication": 2**32})
    assert not env.record().success  # the mission under way is as it was
    env.step({"uav_0": HOVER})


def test_the_example_runs(capsys: pytest.CaptureFixture) -> None:
    example = Path(__file__).parents[3] / "examples" / "random_actions.py"
    runpy.run_path(str(example))
    assert "data units collected" in capsys.readouterr().out
