"""Answers name the nodes that are hardly served, and fleets can be required to serve all."""

import numpy as np
import pytest

from dess import InputError
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.settings.ranking import rank_settings
from dess.analysis.ask.answer import sweep
from dess.analysis.ask.limit_search import find_limits
from dess.analysis.ask.limits import limits_of
from dess.analysis.ask.question import sweep_question
from dess.analysis.metrics import LEAST, NODE_RATIOS, PRODUCT
from tests.analysis.small import SHEET, found_of, write_scenario

PRICES = {"uav": 1000, "pad": 10}
# Two nodes near the zone, and one in the other corner, where no UAV can serve it and come home.
FAR = {"nodes": [[5, 3], [6, 4], [39, 39]], "grid": 40}


@pytest.fixture(scope="module")
def neglecting(tmp_path_factory):
    """A sweep of a sea with a node that has nearly all of the data left."""
    folder = tmp_path_factory.mktemp("far")
    return write_scenario(folder, **SHEET, **FAR), folder


def test_an_answer_names_the_nodes_that_are_hardly_served(neglecting):
    scenario, folder = neglecting
    answer = sweep(scenario, ["greedy"], 12, folder=folder, progress=False, uavs=[1, 2])
    rows = rank_settings(answer.results, PRODUCT)
    missions = answer.results.missions.query(f"point == {rows['point'][0]}")
    ratios = np.mean([*missions[NODE_RATIOS]], axis=0)
    assert (ratios < 0.1).tolist() == [False, False, True]  # or this test says little
    found = found_of(answer.facts())
    assert found["measured in"] == "12 missions"
    assert found["hardly served"] == "[39, 39] (0.0 % of its data)"


def test_a_fleet_that_meets_the_ratio_may_neglect_a_node_until_it_is_required(neglecting):
    scenario, folder = neglecting
    asked = {"prices": PRICES, "folder": folder, "progress": False, "uavs": [1, 2]}
    found = sweep(scenario, ["greedy"], 20, requirements={"ratio": 0.2}, **asked)
    assert found.headline().startswith("Buy ")
    assert found_of(found.facts())["hardly served"].startswith("[39, 39]")
    required = sweep(scenario, ["greedy"], 20, requirements={"ratio": 0.2, "least": 0.5}, **asked)
    assert search_of(required.results).best.fleet == "none"
    closest = found_of(required.facts())["closest (missed)"]
    assert "collection ratio of the worst node 0.0 % [0.0," in closest


def test_the_worst_node_and_the_oldest_age_are_requirements_like_others(tmp_path):
    scenario = write_scenario(tmp_path, **SHEET)
    requirements = {"least": 0.2, "oldest": "60 min"}
    asked = {"prices": PRICES, "folder": tmp_path, "progress": False, "uavs": [1, 2]}
    answer = sweep(scenario, ["greedy"], 40, requirements=requirements, **asked)
    best = search_of(answer.results).best
    assert best.points
    row = best.estimates(LEAST)
    checks = answer.results.checks.query("point == @best.points[0]")
    assert row[LEAST] == pytest.approx(np.mean([*checks[NODE_RATIOS]], axis=0).min())
    facts = {fact.label: fact for fact in answer.facts()}
    assert facts["collection ratio of the worst node"].required == "at least 20 %"
    assert "at most 60 min" in [fact.required for fact in facts.values()]
    assert "hardly served" not in facts
    assert "at least 0.195 and a mean age of the oldest node of" in answer.guarantee
    find_limits(answer.results, str(scenario), missions=10)
    assert limits_of(answer.results) is not None


REFUSED = {
    "least=1.5": "least: 1.5 is out of range",
    "least=30 min": "least is '30 min'; allowed: a number, or of an age a time",
    "oldest=3 km": "oldest: '3 km' has a unit of another kind",
    "oldest=9 h": "in the horizon of 1.995 h",
}


@pytest.mark.parametrize("given", REFUSED)
def test_what_a_node_cannot_have_is_refused(given, tmp_path):
    metric, _, text = given.partition("=")
    value = float(text) if text == "1.5" else text
    scenario = write_scenario(tmp_path, **SHEET)
    with pytest.raises(InputError, match=REFUSED[given]):
        sweep_question({"uavs": (1, 2)}, scenario, prices=PRICES, requirements={metric: value})


def test_nodes_have_no_record_without_a_data_sheet():
    with pytest.raises(InputError, match="least: is not measured; allowed: a scenario with a data"):
        sweep_question({"uavs": (1, 2)}, prices=PRICES, requirements={"least": 0.5})
