"""Configs of a training: what is refused, by name."""

from pathlib import Path
from typing import Any

import pytest

from dess import InputError, policies
from dess.policies.learner.config import (
    config_names,
    learner_identifier,
    load_config,
    resume_command,
)
from dess.scenario.scenario import load_scenario
from tests.policies.learner.tiny import PHASES, TINY, tiny, tiny_on_seas, write_config

PHASE = PHASES[0]
BAD: list[tuple[dict[str, Any], str]] = [
    ({"phases": [PHASE | {"epsilon": [0.5, 2]}]}, "phases.0.epsilon.1: "),
    ({"phases": [PHASE, PHASE]}, "phases: ['harvest', 'harvest'] are not distinct"),
    ({"n_step": 60}, "learning_starts: 60 is too few; allowed: more than n_step 60"),
    ({"replay": 4, "n_step": 3}, "replay: 4 is too few; allowed: n_step 3 + 2 or more"),
    ({"uavs": [2, 3]}, "uavs is a field of the scenario; allowed: --set 'uavs=[2, 3]', or uavs in"),
    ({"set": {"batch": 3}}, "batch is a setting of the training, not a field of the scenario; "),
    ({"set": {"uvs": 3}}, "scenario: scenario paper: uvs: unknown key (did you mean uavs?)"),
    ({"phases": [PHASE | {"ticks": 10**8}]}, "evaluate_every: 25 makes more than 50,000 evalu"),
    ({"observation": "sets"}, "low_battery_starts: 0.2 has no effect with the observation sets"),
    ({"short_ranges": 0.5}, "short_ranges: 0.5 has no effect with the observation vector; allow"),
    ({"phases": [PHASE | {"temperature": 1e-320}]}, "phases.0: temperature: 1e-320 is too low"),
    ({"name": "\x1b[2J"}, "name: '\\x1b[2J' has control characters; allowed: printable"),
]


@pytest.mark.parametrize(("changes", "complaint"), BAD, ids=[complaint for _, complaint in BAD])
def test_what_is_wrong_is_named(changes, complaint, tmp_path):
    path = write_config(tmp_path, **changes)
    with pytest.raises(InputError) as error:
        load_config(path)
    assert str(error.value).startswith(f"{path}: {complaint}")
    assert "\n" not in str(error.value)


def test_a_policy_for_any_sea_needs_chance_to_learn():
    with pytest.raises(InputError, match="tiny: phases: harvest has no temperature; allowed: "):
        tiny_on_seas(phases=[PHASE])


def test_a_file_holds_what_it_says(tmp_path):
    config = load_config(write_config(tmp_path))
    assert config == tiny()
    assert config.model_dump(mode="json", include=set(TINY) - {"phases"}) == {
        key: value for key, value in TINY.items() if key != "phases"
    }
    assert [phase.ticks for phase in config.phases] == [80, 80]
    assert config.ticks == 160
    assert config.phases[1].epsilon == (0.5, 0.01)


def test_overrides_come_last(tmp_path):
    path = write_config(tmp_path)
    assert load_config(path, seed=5, num_envs=4) == tiny(seed=5, num_envs=4)
    with pytest.raises(InputError, match="seed: "):
        load_config(path, seed=-5)


def test_fields_of_the_scenario_are_set(tmp_path):
    path = write_config(tmp_path, set={"uavs": 2, "quota": 400})
    assert load_config(path).space == load_scenario("paper", uavs=2, quota=400)
    config = load_config(path, {"uavs": 1})
    assert config.space == load_scenario("paper", uavs=1, quota=400)
    command = f"dess train {path} --out out --set uavs=1 --resume"
    assert resume_command(config, str(path), Path("out")) == command
    assert (
        learner_identifier(config)
        != learner_identifier(load_config(path))
        != learner_identifier(tiny())
    )


def test_the_shipped_policies_keep_the_identity_of_their_learner():
    assert learner_identifier(load_config("ddqn")) == "ddqn 99eea6f9"
    names = ["ddqn", "ddqn-2", "ddqn-3"]
    assert {policies.load(name).learner for name in names} == {
        learner_identifier(load_config("ddqn"))
    }


def test_the_shipped_configs_load():
    for name in config_names():
        config = load_config(name)
        assert config.description
        assert config.ticks > 0
