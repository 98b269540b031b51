"""The functions of ``import dess`` take names."""

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
