"""Prices, and what missions cost by them."""

from typing import Any

import pytest

from analysis import load_study
from analysis.results.manifest import Manifest
from analysis.study.costs import PARTS, Costs
from dess.scenario import ScenarioSpace, load_scenario


def test_prices_change_no_key_of_a_mission() -> None:
    free = Manifest.of(load_study("table4", missions=2, policies=["greedy"]))
    study = load_study("table4", missions=2, policies=["greedy"], costs={"uav": 20_000})
    assert Manifest.of(study).cells == free.cells


def space(**fields: Any) -> ScenarioSpace:
    return load_scenario("paper", **fields)


def test_the_cost_of_missions_by_hand() -> None:
    # Point 0: 2 UAVs, 16 pads; point 1: 1 UAV, 3 pads, and batteries that gain 20 % in a slot.
    spaces = [space(uavs=2), space(uavs=1, pads=3, charge_rate=20)]
    missions = {"point": [1, 0], "uavs": [1, 2], "slots": [90, 30]}
    uavs = {"slots_charging": [4, 5, 3], "end": ["quota", "battery", "truncated"]}
    prices = Costs(uav=100, pad=10, charge=2, hour=60, lost_uav=50, missions=7, slot_seconds=120)
    parts = prices.parts(spaces, missions, uavs)
    assert [*parts] == [*PARTS]
    assert parts["purchase"].tolist() == [100 + 3 * 10, 2 * 100 + 16 * 10]
    assert parts["charging"] == pytest.approx([7 * 2 * 4 * 0.20, 7 * 2 * 8 * 0.10])
    assert parts["hours"] == pytest.approx([7 * 60 * 3, 7 * 60 * 1])
    assert parts["losses"].tolist() == [0, 7 * 50]
