"""Scenarios: all constants of the model, and the ranges from which missions draw parameters.

space = load_scenario("paper", uavs=3)             # Table II, with three UAVs
space = ScenarioSpace.of(space, quota=200)         # the same with another quota
scenario = Scenario.of(uavs=2, forbid_swaps=True)  # a single scenario; Table III for the rest
"""

from dess.scenario.constants import EXTENSIONS, MOST_CELLS, MOST_NODES, MOST_SLOTS, MOST_UAVS
from dess.scenario.fields import dotted, fields_of, merged
from dess.scenario.limits import SAMPLED
from dess.scenario.loading import load_scenario, scenario_description, scenario_names
from dess.scenario.space import Scenario, ScenarioSpace
from dess.sections.section import Integer, Number

__all__ = [
    "EXTENSIONS",
    "MOST_CELLS",
    "MOST_NODES",
    "MOST_SLOTS",
    "MOST_UAVS",
    "SAMPLED",
    "Integer",
    "Number",
    "Scenario",
    "ScenarioSpace",
    "dotted",
    "fields_of",
    "load_scenario",
    "merged",
    "scenario_description",
    "scenario_names",
]
