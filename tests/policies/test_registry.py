"""From names to policies, the shipped ones and those of outside packages."""

import sys
from pathlib import Path

import numpy as np
import pytest

import policies
from dess import InputError
from dess.mission import simulate
from dess.scenario import Scenario, load_scenario
from policies import registry
from policies.base import Policy
from policies.ddqn.checkpoint import save_policy
from policies.ddqn.config import config_of
from policies.ddqn.observations.states import layout_of
from policies.ddqn.training import build
from policies.registry import SHIPPED, trained_names

OUTSIDE = """
import numpy as np

class Still:
    name = "still"

    def act(self, view):
        return np.full(len(view), 4)

class Broken:
    def __init__(self):
        raise RuntimeError("no weights")

class Nothing:
    pass
"""

ENTRY_POINTS = """
[dess.policies]
still = outside_policies:Still
broken = outside_policies:Broken
nothing = outside_policies:Nothing
absent = outside_policies:Absent
"""


@pytest.fixture
def outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An installed package that adds policies through entry points."""
    (tmp_path / "outside_policies.py").write_text(OUTSIDE)
    metadata = tmp_path / "outside_policies-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: outside-policies\nVersion: 1")
    (metadata / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "outside_policies", raising=False)


def test_shipped_policies_load_by_name() -> None:
    assert {"random", "nearest", "greedy", "tour"} <= set(SHIPPED)
    assert policies.names()[: len(SHIPPED)] == list(SHIPPED)
    for name in SHIPPED:
        policy = policies.load(name)
        assert isinstance(policy, Policy)
        assert policy.name == name


def test_a_team_is_a_list_of_names() -> None:
    assert [policy.name for policy in policies.load_team("greedy")] == ["greedy"]
    team = policies.load_team("greedy, tour,greedy")
    assert [policy.name for policy in team] == ["greedy", "tour", "greedy"]


@pytest.mark.parametrize("text", ["gredy", "", "greedy,", "greedy,,tour", "Greedy"])
def test_unknown_names_are_refused(text: str) -> None:
    with pytest.raises(InputError) as error:
        policies.load_team(text)
    line = str(error.value)
    assert line.startswith("policy: ")
    assert "\n" not in line
    assert all(name in line for name in SHIPPED)


def _trained(folder: Path) -> Path:
    """The folder of a policy that is called ``novice`` and has learned nothing."""
    settings = {"name": "novice", "hidden": [8], "phases": [{"name": "none", "ticks": 1}]}
    config, space = config_of(settings, "here"), load_scenario("paper")
    _, network = build(config, layout_of(space))
    save_policy(folder, network.state_dict(), config, space)
    return folder


def test_a_trained_policy_loads_from_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = _trained(tmp_path / "runs" / "first")
    for name in (folder, str(folder)):
        policy = policies.load(name)
        assert isinstance(policy, Policy)
        assert policy.name == "novice"
    monkeypatch.chdir(tmp_path)
    team = policies.load_team("runs/first, greedy,./runs/first/")
    assert [policy.name for policy in team] == ["novice", "greedy", "novice"]
    assert np.isfinite(simulate(Scenario.of(uavs=3), team, 0).reward)


def test_a_shipped_trained_policy_loads_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _trained(tmp_path / "novice")
    (tmp_path / "no-policy").mkdir()
    monkeypatch.setattr(registry, "TRAINED", tmp_path)
    assert policies.names()[: len(SHIPPED) + 1] == [*SHIPPED, "novice"]
    assert policies.load("novice").name == "novice"
    with pytest.raises(InputError, match="'no-policy' is unknown; allowed: .*novice"):
        policies.load("no-policy")


def test_a_folder_without_a_policy_is_unknown(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none"):
        with pytest.raises(InputError, match="or the folder of a trained policy$"):
            policies.load(path)


def test_a_damaged_trained_policy_is_named(tmp_path: Path) -> None:
    folder = _trained(tmp_path / "first")
    (folder / "model.safetensors").write_bytes(b"")
    with pytest.raises(InputError, match=f"^{folder / 'model.safetensors'}: "):
        policies.load(folder)


@pytest.mark.usefixtures("outside")
def test_outside_packages_add_policies() -> None:
    shipped = len(SHIPPED) + len(trained_names())
    assert policies.names()[shipped:] == ["absent", "broken", "nothing", "still"]
    record = simulate(Scenario.of(uavs=1), policies.load("still"), 0)
    assert np.isfinite(record.reward)


@pytest.mark.usefixtures("outside")
@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("broken", "cannot be loaded: no weights"),
        ("absent", "cannot be loaded: .*Absent"),
        ("nothing", "has no name and act"),
    ],
)
def test_broken_outside_policies_are_named(name: str, complaint: str) -> None:
    with pytest.raises(InputError, match=f"policy: {name} of outside_policies:.*{complaint}"):
        policies.load(name)
