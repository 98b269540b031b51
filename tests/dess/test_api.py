"""The functions of ``import dess`` take names, and former names of modules can be imported."""

import sys
from importlib import import_module

import pytest

import dess
from dess import policies
from dess.model import batch, mission


@pytest.mark.parametrize("team", ["greedy", "greedy,tour", ["greedy", "tour"]])
def test_a_name_stands_for_the_policies_that_it_loads(team):
    names = team if isinstance(team, str) else ",".join(team)
    loaded = policies.load_team(names)
    space = dess.load_scenario("paper", uavs=2)
    named = dess.simulate(space, team, seed=3)
    assert named.metrics == mission.simulate(space, loaded, seed=3).metrics
    records = dess.simulate_batch(space, team, seed=3, replications=2)
    same = batch.simulate_batch(space, loaded, seed=3, replications=2)
    assert records.missions.tobytes() == same.missions.tobytes()


def test_the_model_takes_no_names():
    with pytest.raises(dess.InputError, match="policy: 'greedy' is of type str"):
        mission.simulate(dess.load_scenario("paper"), "greedy")


@pytest.mark.parametrize(
    ("former", "now", "name"),
    [
        ("dess.env.stepper", "dess.envs.stepper", "REWARD_TERMS"),
        ("dess.guard", "dess.model.guard", "guard"),
        ("dess.integrations", "dess.envs.integrations", "__doc__"),
        (
            "dess.observations.components",
            "dess.envs.observations.components",
            "component_names",
        ),
    ],
)
def test_former_names_warn_and_give_what_the_new_names_give(monkeypatch, former, now, name):
    package = ".".join(former.split(".")[:2])
    for module in [m for m in sys.modules if m == package or m.startswith(f"{package}.")]:
        monkeypatch.delitem(sys.modules, module)
    with pytest.warns(DeprecationWarning, match=f"{package} has become dess"):
        import_module(former)
    assert hasattr(sys.modules[former], name)
    assert sys.modules[former].__file__ == import_module(now).__file__
