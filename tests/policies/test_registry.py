"""From names to policies, the shipped ones and those of outside packages."""

import sys
from pathlib import Path

import numpy as np
import pytest

import policies
from dess.errors import InputError
from dess.mission import simulate
from dess.scenario import Scenario
from policies.base import Policy
from policies.registry import SHIPPED

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


@pytest.mark.usefixtures("outside")
def test_outside_packages_add_policies() -> None:
    assert policies.names()[len(SHIPPED) :] == ["absent", "broken", "nothing", "still"]
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
