"""What is known of the values of a metric before a mission is flown."""

import pytest

from dess import ScenarioSpace
from dess.analysis.metric_ranges import longest_wait, metric_in_missions, metric_in_space
from tests.analysis.small import SHEET, grid

MEASURED = {"charging.measured": True, "failures.uav_rate": 0.01, "age.measured": True}


@pytest.mark.parametrize("column", ["age", "slots", "slots_grounded", "uav_slots", "waiting"])
@pytest.mark.parametrize("uavs", [2, [1, 3]])
def test_a_scenario_has_the_ranges_of_its_missions(studied, uavs, column):
    results = studied(missions=20, policies=["greedy"], set={**MEASURED, "uavs": uavs, "pads": 1})
    space = results.scenario()
    assert metric_in_space(column, space) == metric_in_missions(results.missions, column)


def test_a_sea_in_units_has_its_ranges_in_hours(studied):
    results = studied(missions=4, policies=["greedy"], set=SHEET | {"uavs": 2})
    space = results.scenario()
    for column in ("age_h", "uav_slots_h"):
        found = metric_in_missions(results.missions, column)
        assert metric_in_space(column, space).range == pytest.approx(found.range)
    assert metric_in_space("age_h", space).most == pytest.approx(1.0, rel=0.01)  # half of 2 h
    # Nothing and all of the data, which are 2 MB and more at each of three nodes.
    assert metric_in_missions(results.missions, "collected_MB").most >= 6


def test_nobody_waits_where_each_zone_has_pads_for_all_uavs():
    few = {"uavs": 3, "pads": 3, "zones": [{"cells": [0, 6, 2, 2], "pads": 2}]}
    base = {"grid": 8, "nodes": [[1, 1]], "zone": [5, 0, 3, 2]}
    assert longest_wait(ScenarioSpace.of(**base, uavs=3)) == 0
    assert longest_wait(ScenarioSpace.of(**base, **few)) > 0
    failing = {"pad_rate": 0.01, "pad_repair": 5.0}
    assert longest_wait(ScenarioSpace.of(**base, uavs=3, failures=failing)) > 0


def test_a_design_point_without_waits_does_not_hide_those_of_another(studied):
    results = studied(missions=5, policies=["greedy"], design=grid(pads=[1, 6]))
    assert metric_in_missions(results.missions, "waiting_per_uav").most > 0
    of_point = results.missions[results.missions["point"] == 1]
    assert metric_in_missions(of_point, "waiting_per_uav").range == (0, 0)
