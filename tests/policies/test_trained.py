"""Trained policies by name: listed with what they are for, and never in the way of another one."""

import json
from pathlib import Path

import pytest

import policies
from dess import InputError
from policies import registry
from policies.heuristics import Greedy


def write_config(folder: Path, description: str) -> None:
    """A folder that is taken for a trained policy, without weights."""
    folder.mkdir()
    content = json.loads((registry.TRAINED / "ddqn" / "config.json").read_text("utf-8"))
    content["training"] |= {"name": folder.name, "description": description}
    (folder / "config.json").write_text(json.dumps(content))


def test_a_folder_does_not_hide_the_shipped_policy_of_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_config(tmp_path / "greedy", "another one")
    monkeypatch.chdir(tmp_path)
    assert isinstance(policies.load("greedy"), Greedy)


def test_no_name_is_not_the_working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_config(tmp_path / "here", "of the working folder")
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(InputError, match="policy: '' is unknown"):
        policies.load_team("greedy,")


@pytest.mark.parametrize("name", registry.trained_names())
def test_what_is_shipped_loads_by_its_own_name_and_says_what_it_is_for(name: str) -> None:
    assert policies.load(name).name == name
    assert registry.descriptions()[name]


@pytest.mark.parametrize("name", [n for n in registry.trained_names() if n[-1].isdigit()])
def test_a_repetition_differs_in_its_seed_alone(name: str) -> None:
    first, _, seed = name.rpartition("-")
    assert registry.descriptions()[name] == f"{first} trained once more, with seed {seed}"
    assert policies.load(name).learner == policies.load(first).learner
    assert policies.load(name).weights != policies.load(first).weights
