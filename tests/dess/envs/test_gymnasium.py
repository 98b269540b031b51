"""Gymnasium's conventions: names, an ``Env`` of one UAV, seeds, options and copies."""

import subprocess
import sys
import warnings
from copy import deepcopy
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import dess
from dess import InputError
from dess.envs.observations.observer import KINDS
from tests.dess.envs.episodes import PAPER

NAME = "dess.envs:dess/Paper-v0"


@pytest.mark.slow
@pytest.mark.brief
def test_gymnasium_finds_the_environments_by_their_name():
    """In a new process, which has imported nothing of dess."""
    script = f"import gymnasium; gymnasium.make('{NAME}'); gymnasium.make('dess/Paper-v0'); "
    script += f"print(gymnasium.make_vec('{NAME}', 2).num_envs, "
    script += f"gymnasium.make_vec('{NAME}', 3, scenario='fig4').num_envs)"
    done = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    assert done.stdout.split()[0].decode() == str(2 * PAPER.uavs[1])


@pytest.mark.parametrize("observation", [kind for kind in KINDS if kind != "sets"])
@pytest.mark.parametrize("scenario", ["paper", dess.load_scenario("paper", uavs=3)], ids=str)
def test_gymnasiums_check_env_passes_for_a_lone_uav(observation, scenario):
    options = {"scenario": scenario, "observation": observation, "render_mode": "rgb_array"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*(infinity|render modes)")
        check_env(gymnasium.make(NAME, **options).unwrapped)


def test_a_lone_uav_flies_the_mission_of_simulate():
    env = gymnasium.make(NAME, observation="state").unwrapped
    assert isinstance(env, dess.single_env)
    _, info = env.reset(seed=4, options={"replication": 2})
    over, reward = False, 0.0
    while not over:
        assert np.array_equal(env.action_masks(), info["action_mask"])
        _, gained, terminated, truncated, info = env.step(np.int64(4))
        over, reward = terminated or truncated, reward + gained

    class Hover:
        def act(self, view: Any) -> np.ndarray:
            return np.full(len(view), 4)

    record = dess.simulate(dess.load_scenario("paper", uavs=1), Hover(), 4, 2)
    assert env.mission.record().metrics == record.metrics and reward == record.reward


# --- seeds ---


def seeds_of(env: Any) -> list[int]:
    stepper = getattr(env, "_stepper", None) or env.unwrapped.mission._stepper
    return stepper.state.missions["seed"].tolist()


MADE: dict[str, Any] = {
    "parallel": partial(dess.parallel_env, "paper"),
    "vector": partial(dess.vector_env, "paper", 2),
    "single": partial(dess.single_env, "paper"),
    "make": partial(gymnasium.make, NAME),
}


@pytest.mark.parametrize("kind", MADE)
def test_copies_without_a_seed_play_missions_of_their_own(kind):
    original = MADE[kind]()
    copies = [original, deepcopy(original), deepcopy(original), MADE[kind]()]
    for _ in range(2):
        for env in copies:
            env.reset()
        assert len({tuple(seeds_of(env)) for env in copies}) == len(copies)
        copies += [deepcopy(copies[0])]
    for env in copies:
        env.reset(seed=7)
    assert {seed for env in copies for seed in seeds_of(env)} == {7}
    copies[0].reset()
    assert {*seeds_of(copies[0])} == {7}  # the numbering of a seed continues


@pytest.mark.parametrize("kind", MADE)
def test_a_seed_may_be_an_integer_of_numpy(kind):
    env = MADE[kind]()
    env.reset(seed=np.int64(3))
    assert {*seeds_of(env)} == {3}


@pytest.mark.parametrize("kind", MADE)
def test_copies_with_a_seed_play_the_same_missions(kind):
    original = MADE[kind](seed=3)
    for env in (original, deepcopy(original)):
        env.reset()
        assert {*seeds_of(env)} == {3}


def test_each_mission_of_a_vector_may_have_a_seed():
    env = dess.vector_env("paper", 3)
    alone = [dess.vector_env("paper", 1, seed) for seed in (1, 2, 3)]
    actions = np.full(env.num_envs, 4)
    for seeds in ([1, 2, 3], (1, 2, 3), np.array([1, 2, 3])):
        rows = [env.reset(seed=seeds)[0], *(env.step(actions)[0] for _ in range(200))]
        each = [one.reset(seed=seed) for one, seed in zip(alone, (1, 2, 3), strict=True)]
        parts = [np.concatenate([first for first, _ in each])]
        parts += [np.concatenate([one.step(actions[:3])[0] for one in alone]) for _ in range(200)]
        assert all(np.array_equal(*pair) for pair in zip(rows, parts, strict=True))
    assert (env.state.missions["replication"] > 0).all()  # each goes on with its own seed
    assert seeds_of(env) == [1, 2, 3]


REFUSED: dict[str, dict[str, Any]] = {
    "seed: there are 2; allowed: an integer, or a list of 3": {"seed": [1, 2]},
    "seed: None is of type NoneType; allowed: an integer": {"seed": [1, None, 2]},
    "seed: -4 is out of range; allowed": {"seed": [1, 2, -4]},
    "seed: 'x' is of type str; allowed: an integer": {"seed": "x"},
    "options: 'reset_mask' is unknown; allowed: replication": {"options": {"reset_mask": [1]}},
    "replication: 'x' is of type str; allowed: an integer": {"options": {"replication": "x"}},
}


@pytest.mark.parametrize("line", REFUSED)
def test_what_reset_does_not_honour_it_refuses(line):
    env = dess.vector_env("paper", np.int64(3), 1)  # type: ignore[arg-type]
    before = env.reset()[1]["replication"]
    with pytest.raises(InputError, match=f"^{line}"):
        env.reset(**REFUSED[line])
    assert np.array_equal(env._present()["replication"], before)  # the missions go on


@pytest.mark.parametrize(
    "action", [2.7, np.float32(2.7), "4", np.array([4]), None, np.nan, True, 5]
)
def test_a_lone_uav_takes_integers_alone(action):
    """What is no integer is not rounded or read as one; an array of a single integer is a list."""
    env = dess.single_env("paper")
    env.reset(seed=1)
    with pytest.raises(
        InputError, match=r"actions: .*; allowed: (0\.\.4|integers of shape \(1, 1\))"
    ):
        env.step(action)
    env.step(np.array(4))


@pytest.mark.parametrize(
    "make, options, line",
    [
        (dess.single_env, {"mask": "info"}, "'mask' is unknown; allowed: scenario, seed, render"),
        (dess.parallel_env, {"guard": True}, r"'guard' is unknown \(did you mean guarded\?\)"),
        (dess.vector_env, {"num_envs": 2, "ended": "stay"}, "'ended' is unknown; allowed: scen"),
    ],
)
def test_a_keyword_that_an_environment_lacks_is_refused_in_a_line(make, options, line):
    with pytest.raises(InputError, match=f"^options: {line}"):
        make("paper", **options)
    with pytest.raises(InputError, match="^options: 'mask' is unknown"):
        gymnasium.make("dess.envs:dess/Paper-v0", mask="info")


def test_a_list_in_the_place_of_an_action_is_refused():
    env = dess.parallel_env(dess.load_scenario("paper", uavs=2))
    env.reset(seed=1)
    with pytest.raises(InputError, match="actions: are not all integers; allowed: integers of"):
        env.step({"uav_0": 4, "uav_1": [4]})
