"""From names to policies, the shipped ones and those of outside packages."""

import math
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

import dess
from dess import InputError, policies
from dess.analysis.results import provenance
from dess.base import sources
from dess.model.mission import simulate
from dess.policies import registry, shipped
from dess.policies.heuristics import Greedy
from dess.policies.learner.config import validate_config
from dess.policies.learner.trained import expected_weights, make_observation, save_policy
from dess.policies.registry import CLASSES, Policy, describe_policy
from dess.scenario.scenario import Scenario, ScenarioSpace, load_scenario, scenario_names
from tests.outside import install_package
from tests.policies.learner.tiny import refusal_of

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


@pytest.fixture
def outside(tmp_path, monkeypatch):
    """An installed package that adds policies through entry points."""
    names = ("still", "broken", "nothing", "absent")
    classes = {name: f"outside_policies:{name.title()}" for name in names}
    install_package(tmp_path, monkeypatch, "outside_policies", OUTSIDE, **classes)


def test_every_shipped_policy_has_a_row_in_the_table():
    assert {*shipped.SHIPPED} == {*registry.CLASSES, *registry.trained_names()}


@pytest.mark.parametrize("text", ["gredy", "", "greedy,,tour", "Greedy"])
def test_unknown_names_are_refused(text):
    line = refusal_of(policies.load_team, text)
    assert line.startswith("policy: ")
    assert all(name in line for name in CLASSES) or "others" in line
    assert "FILE.py:CLASS" in line and "entry point dess.policies" in line


def _trained(folder: Path) -> Path:
    """The folder of a policy that is called ``novice`` and has learned nothing."""
    settings = {"name": "novice", "hidden": [8], "phases": [{"name": "none", "ticks": 1}]}
    config, space = validate_config(settings, "here"), load_scenario("paper")
    weights = expected_weights(config, make_observation(config, space)[1])
    save_policy(folder, weights, config, space)
    return folder


def test_a_trained_policy_loads_from_its_folder(tmp_path, monkeypatch):
    folder = _trained(tmp_path / "runs" / "first")
    assert policies.load(folder).name == "novice"
    monkeypatch.chdir(tmp_path)
    team = policies.load_team("runs/first, greedy,./runs/first/")
    assert [policy.name for policy in team] == ["novice", "greedy", "novice"]
    assert np.isfinite(simulate(Scenario.of(uavs=3), team, 0).reward)
    _trained(tmp_path / "greedy")  # a folder does not hide the shipped policy of its name
    assert isinstance(policies.load("greedy"), Greedy)
    monkeypatch.chdir(folder)  # no name is not the working folder
    with pytest.raises(InputError, match="policy: '' is unknown"):
        policies.load_team("greedy,")


@pytest.mark.parametrize("name", registry.trained_names())
def test_what_is_shipped_loads_by_its_own_name_and_says_what_it_is_for(name):
    policy = policies.load(name)
    assert policy.name == name
    first, _, seed = name.rpartition("-")
    if seed.isdigit():  # a repetition differs in its seed alone
        assert registry.describe_policies()[name] == f"{first} trained once more, with seed {seed}"
        original = policies.load(first)
        assert (policy.learner, policy.weights != original.weights) == (original.learner, True)  # type: ignore[attr-defined]
    assert registry.describe_policies()[name]


@pytest.mark.usefixtures("outside")
def test_the_list_says_which_outside_policies_cannot_be_loaded():
    described = registry.describe_policies()
    assert [*described] == policies.names()
    assert described["still"] == "of the package outside-policies 1"
    problem = "cannot be loaded: RuntimeError: no weights (of the package outside-policies 1)"
    assert described["broken"] == problem
    assert described["nothing"].startswith("has no name and act(view)")
    assert "AttributeError" in described["absent"]
    with pytest.raises(InputError, match="policy: broken of outside_policies:.*no weights"):
        policies.load("broken")
    assert np.isfinite(simulate(Scenario.of(uavs=1), policies.load("still"), 0).reward)


FILE = """
import numpy as np
import beside_it

class Eager:
    name = "eager"

    def act(self, view):
        return np.full(len(view), beside_it.HOVER)

class Nameless:
    def act(self, view):
        pass
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    """A Python file with policies, which imports another file of its folder."""
    path = tmp_path / "in_a_file.py"
    path.write_text(FILE)
    (tmp_path / "beside_it.py").write_text("HOVER = 4")
    monkeypatch.setattr(sys, "path", [*sys.path])
    for module in ("in_a_file", "beside_it"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    return path


def test_a_policy_loads_from_a_file(file, monkeypatch):
    monkeypatch.chdir(file.parent)
    team = policies.load_team(f"{file}:Eager,greedy,in_a_file.py:Eager")
    assert [policy.name for policy in team] == ["eager", "greedy", "eager"]
    assert type(team[0]) is type(team[2])
    assert isinstance(pickle.loads(pickle.dumps(team[0])), Policy)
    assert np.isfinite(simulate(Scenario.of(uavs=3), team, 0).reward)


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("in_a_file.py:Eger", r"'Eger' is no class of it \(did you mean Eager\?\)"),
        ("in_a_file.py:Nameless", "policy: Nameless of .*in_a_file.py has no name and act"),
        ("none.py:Eager", "policy: .*none.py: no such file; allowed: FILE.py:CLASS"),
        ("in_a_file.py", "is unknown; allowed: .*FILE.py:CLASS"),
        ("json.py:Eager", "another module has its name; allowed: another file name"),
        ("wrong.py:Eager", "policy: Eager of .*wrong.py cannot be loaded: SyntaxError"),
    ],
)
def test_files_without_such_a_policy_are_named(file, name, complaint):
    (file.parent / "json.py").write_text(FILE)
    (file.parent / "wrong.py").write_text("class Eager(")
    with pytest.raises(InputError, match=complaint):
        policies.load(file.parent / name)


def test_an_edited_file_has_another_fingerprint(file, monkeypatch):
    """Also if only a file has been edited that it imports."""
    # Python itself misses a change within the second in which it wrote its bytecode.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def identity() -> tuple[str, str, str]:
        """As of a process that has imported neither of the files."""
        for module in ("in_a_file", "beside_it"):
            sys.modules.pop(module, None)
        for cached in (sources.read, provenance._code_hashes):
            cached.cache_clear()
        (member,) = provenance.members_of(f"{file}:Eager", run_files=True)
        return member.name, member.class_, member.code

    first = identity()
    assert first[:2] == ("eager", "in_a_file:Eager")
    file.write_text(FILE.replace("len(view)", "len(view) + 0"))
    edited = identity()
    (file.parent / "beside_it.py").write_text("HOVER = 3")
    assert len({first, edited, identity()}) == 3


def test_what_a_policy_is_and_can_simulate(file):
    ddqn, greedy = describe_policy("ddqn"), describe_policy("greedy")
    assert (ddqn.scenarios, greedy.scenarios) == (["fig4", "paper"], scenario_names())
    assert (ddqn.requires["grid"], ddqn.trained_on["uavs"]) == (32, [1, 3])
    assert (greedy.requires, greedy.trained_on) == ({}, {})
    assert ddqn.card.startswith("# ddqn")
    assert greedy.code == "dess.policies.heuristics:Greedy"
    assert greedy.origin == f"shipped with dess {dess.__version__}"
    assert describe_policy(f"{file}:Eager", run_files=True).origin == f"the file {file}"


def test_which_policies_are_python_files_is_known_without_running_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trap.py").write_text("raise SystemExit('this code ran')")
    _trained(tmp_path / "data.py:Trap")  # a folder, whatever its name: it holds only data
    for team in ("trap.py:Trap", "greedy, trap.py:Trap", "no_such_file.py:X"):
        assert registry.python_files_in(team) == [team.rpartition(" ")[2]]
        for named in (["another.py:X", "greedy"], []):
            assert not registry.is_confirmed(team, named)
        with pytest.raises(InputError, match=r"is a Python file.*; allowed: --policy"):
            registry.load_team(team)
        assert registry.is_confirmed(team, [f"greedy, {team}"])
    for team in ("greedy", "ddqn,tour", "data.py:Trap", "greedy, ./data.py:Trap", "unknown", ""):
        assert registry.python_files_in(team) == []
    assert "trap" not in sys.modules


def test_snrs_are_compared_at_the_same_distance():
    """The SNR of the paper at 1 km, given there, at 2 km, and 10 dB more than that."""
    at_1_km = -25 + 22.7 * math.log10(math.sqrt(2) / 2 * 32 * 0.8)
    for anchor, snr, is_told in (
        (1000.0, at_1_km, False),
        (2000.0, at_1_km - 22.7 * math.log10(2), False),
        (2000.0, at_1_km - 22.7 * math.log10(2) + 10, True),
        (1000.0, -25.0, True),  # that of the paper, but 18 km away
    ):
        space = ScenarioSpace.of(edge_snr=snr, radio={"anchor": anchor})
        lines = registry.list_departures(["generalist", "ddqn"], [space])
        assert bool(lines) is is_told
        assert all(": SNR at 1 km" in line for line in lines)
    [line] = registry.list_departures(["ddqn"], [space])
    assert line.endswith("its training: SNR at 1 km [dB] -25 (trained on 3.6)")


def test_a_rate_in_steps_is_outside_of_every_training():
    plain, steps = (ScenarioSpace.of(radio={"steps": s}) for s in ([], [[-7.5, 0.04], [0, 0.4]]))
    assert not any("steps" in line for line in registry.list_departures(["generalist"], [plain]))
    [line] = registry.list_departures(["generalist", "greedy"], [plain, steps])
    assert (
        line.startswith("generalist acts outside") and "a rate in steps (trained on eq. 9)" in line
    )


def test_a_former_name_is_taken():
    assert registry.load("any").name == "generalist"
    assert [policy.name for policy in registry.load_team("greedy, any")] == ["greedy", "generalist"]
    assert registry.describe_policy("any").name == "generalist"
    assert "any" not in registry.names()
