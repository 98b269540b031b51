"""Missions that end on the ground: what standing costs, when a UAV lands, what the guard does."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from dess import InputError, load_scenario, policies, simulate, simulate_batch
from dess.model.state import BATTERY, LANDED
from dess.scenario.families import FAMILIES
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.flights import flown
from tests.drawn import (
    Commuter,
    Script,
    Wanderer,
    continuous_spaces,
    extended_spaces,
    replications,
    seeds,
)

# A zone of two cells, and one node with data without end beside it.
SEA = {
    **{"grid": 8, "zone": [2, 2, 2, 1], "uavs": 1, "nodes": [[2, 6]], "initial_data": 1e6},
    **{"shadowing_variance": 0.0, "arrival_rate": 0.0, "charge_start": 10, "charge_complete": 60},
    **{"flying_time": 30, "charge_rate": 5, "landing": True},
}


def _flight(route: str, **values: object) -> list[tuple[str, float, int]]:
    """What happens to a lone UAV that flies a route, with its time and battery."""
    events = simulate(ScenarioSpace.of(**SEA | values), Script(route), 1, events=True).events
    return [(e.event, e.time, e.battery) for e in events if e.uav == 0 and e.event != "move"]


def _only(flight: list[tuple[str, float, int]], *names: str) -> list[tuple[str, float, int]]:
    return [row for row in flight if row[0] in names]


def test_a_uav_on_the_ground_spends_and_serves_nothing_and_waits_for_a_pad_for_nothing():
    space = ScenarioSpace.of(**SEA | {"uavs": 2, "pads": 1, "quota": 4, "max_slots": 12})
    record = simulate(space, Script("", ""), 1, events=True)
    events = record.events
    first, second = ([e for e in events if e.uav == i] for i in (0, 1))
    # One charges from 30 to 60 in six slots; the other waits with its battery of 30.
    assert [e.time for e in first if e.event == "charge_end"] == [6.0]
    assert [e.battery for e in second if e.event == "move"][:6] == [30] * 6
    assert not [e for e in events if e.event == "communication"]
    assert record.uavs["slots_flying"].tolist() == [0, 0]
    assert record.uavs["slots_waiting"].tolist() == [0, 6]
    assert [row["end"] for row in record.uav_rows()] == ["truncated", "truncated"]


def test_a_uav_lands_in_the_slot_in_which_it_hovers_in_a_zone_with_its_quota_filled():
    # Two slots south, two back: the quota of 12 is filled in the third, it hovers in the fifth.
    flight = _flight("SSNN.", quota=12, max_slots=50)
    named = _only(flight, "quota_filled", "charge_request", "landing", "mission_end")
    assert named == [("quota_filled", 3.0, 27), ("landing", 5.0, 26), ("mission_end", 5.0, 26)]
    # Over the sea it does not land, but goes on serving.
    away = _flight("SS", quota=12, max_slots=6)
    assert len(_only(away, "communication")) == 24 and not _only(away, "landing")


@pytest.mark.parametrize("route, end", [("SSNN..", "landed"), ("SSNNSS", "truncated")])
def test_without_a_quota_a_uav_works_to_the_last_slot_and_must_be_on_the_ground_then(route, end):
    space = ScenarioSpace.of(**SEA | {"quota": 0, "max_slots": 6})
    record = simulate(space, Script(route), 1)
    assert record.slots == 6 and record.uav_rows()[0]["end"] == end
    assert record.success == (end == "landed")


LOSING: list[tuple[dict[str, Any], list[str], str]] = [
    # An empty battery in the fourth slot, a failure at the end of the first one.
    ({"flying_time": 4}, ["SSSS"], "battery"),
    ({"failures": {"uav_rate": 1.0, "node_rate": 0.3, "node_repair": 2.0}}, ["SSSS"], "lost"),
]


@pytest.mark.parametrize(("values", "routes", "end"), LOSING)
def test_without_a_quota_a_mission_whose_uavs_are_lost_lasts_until_its_horizon(values, routes, end):
    """By hand: the node is never emptied, so its age grows from 0 to 40, and is 20 on average."""
    sea = SEA | {"quota": 0, "max_slots": 40, "arrival_rate": 0.5, "age": {"measured": True}}
    record, log = flown(ScenarioSpace.of(**sea | values), *routes)
    assert [row["end"] for row in record.uav_rows()] == [end] and record.slots == 40
    assert (record.age, record.age_p99) == (20.0, pytest.approx(39.6))
    arrivals = log["value"][log["event"] == "arrival"]
    assert record.arrived == arrivals.sum() and max(log["time"][log["event"] == "arrival"]) > 30
    # It is what arrives while a UAV stands in the zone to the end.
    assert record.arrived == simulate(ScenarioSpace.of(**sea), Script(""), 0).arrived
    # What a silent node has at the end of the mission is left over.
    left = record.initial + record.arrived - record.collected
    assert record.residual == pytest.approx(left) and record.uav_slots <= 4


def test_a_fleet_that_is_lost_early_does_not_have_younger_data_than_one_that_works():
    values = {"landing": True, "quota": 0, "max_slots": 480, "age": {"measured": True}}
    space = load_scenario("bay", **values)
    drowned, working = (
        simulate_batch(space, policies.load(name), 1, 10) for name in ("random-unguarded", "greedy")
    )
    slots_flown = drowned.uavs["slots_flying"].max()
    assert not drowned.missions["home"].any() and slots_flown < 200
    assert (drowned.missions["slots"] == 480).all()
    assert drowned.operations["age"].min() > 200 > working.operations["age"].max()


@given(
    extended_spaces(landing=True, quota=0) | continuous_spaces(landing=True, quota=0),
    seeds,
    replications,
)
def test_without_a_quota_all_policies_meet_the_same_data_until_the_horizon(space, seed, number):
    one, other = (simulate(space, flown_by, seed, number) for flown_by in (Wanderer(), Commuter()))
    assert one.slots == other.slots == space.max_slots
    assert (one.initial, one.arrived) == (other.initial, other.arrived)


def test_an_empty_battery_in_the_air_ends_a_mission_and_the_quota_is_paid_on_landing():
    depleted = ScenarioSpace.of(**SEA | {"quota": 12, "flying_time": 4})
    record = simulate(depleted, Script("SSSS"), 1)
    assert record.uavs["end"].tolist() == [BATTERY] and record.success == 0
    plain = {"reward_data": 0.0, "reward_step": 0.0, "reward_quota": 7.0, "reward_depleted": -3.0}
    landed = ScenarioSpace.of(**SEA | plain | {"quota": 12})
    assert simulate(landed, Script("SSNN."), 1).reward == 7.0
    assert simulate(ScenarioSpace.of(depleted, **plain), Script("SSSS"), 1).reward == -3.0


def test_no_quota_without_landing_is_refused():
    with pytest.raises(InputError, match="quota: 0 needs landing; allowed: "):
        ScenarioSpace.of(quota=0)


def test_missions_without_landing_are_stored_as_before():
    space = load_scenario("paper")
    assert "landing" not in space.model_dump() and not space.is_extended
    assert ScenarioSpace.of(space, landing=True).model_dump()["landing"] is True


@pytest.mark.parametrize("quota", [None, 0])
@pytest.mark.parametrize("family", FAMILIES)
def test_guarded_uavs_end_on_the_ground(family, quota):
    values = {"landing": True, "max_slots": 250} | ({} if quota is None else {"quota": quota})
    space = load_scenario(f"{family}:3", **values)
    space = ScenarioSpace.of(space, pads=max(space.uavs[1] // 2, 1))
    ends = simulate_batch(space, policies.load("greedy"), 7, 40).uavs["end"]
    assert np.isin(ends[ends > 0], [LANDED]).mean() > 0.99


def test_uavs_land_beside_those_that_stand_in_their_way_at_the_end():
    """Three pads in a zone of two rows: who comes last has to fly around those who stand."""
    space = load_scenario("scattered:2177", landing=True, quota=0, max_slots=500)
    space = ScenarioSpace.of(space, pads=3)
    ends = simulate_batch(space, policies.load("greedy"), 1_400_000, 8).uavs["end"]
    assert np.isin(ends[ends > 0], [LANDED]).all()


def test_one_more_uav_does_not_collect_less():
    """With a margin of two slots for each teammate, the fourth UAV collected 1 % less."""
    ratios = []
    for uavs in (2, 3, 4):
        space = load_scenario("bay", landing=True, quota=0, uavs=uavs)
        records = simulate_batch(space, policies.load("greedy"), 5, 60)
        ratios.append(records.missions["collection_ratio"])
    assert (ratios[1] - ratios[0]).mean() > 0 and (ratios[2] - ratios[1]).mean() > 0


def test_no_uav_with_time_takes_the_cell_to_which_one_with_less_battery_comes():
    """The one changed between two cells of the zone, and so did the plan of the other."""
    space = load_scenario("bay", landing=True, quota=0, uavs=2)
    records = simulate_batch(space, policies.load("greedy"), 11, [60, 334])
    assert records.missions["success"].all()
