"""The fluid model: what the engine collects where nothing is random, and hand-worked cases."""

import numpy as np
import pytest

from dess import Scenario, ScenarioSpace, load_scenario, simulate
from dess.model.view import View
from dess.policies.planner.fluid import (
    MOST_SLOTS,
    begin_flight,
    empty_flight,
    simulate_flight,
)
from dess.policies.planner.rates import RATES_PART, Rates, load_rates
from dess.policies.planner.search import BEST, TRIED, empty_workspace, improve_plan
from dess.policies.planner.waypoints import CHARGE, NEVER, Plan, empty_plan, insert_waypoint
from tests.dess.model.flights import first_view

DEPLETED = 100.0  # the penalty for an empty battery [data units]
CALM = {"shadowing_variance": 0.0, "arrival_rate": 0.0}


def _plan(uavs: int, *routes: list[tuple[int, int, int]]) -> Plan:
    """A plan of waypoints ``x, y, stay``."""
    plan = empty_plan(uavs)
    for i, route in enumerate(routes):
        for number, (x, y, stay) in enumerate(route):
            insert_waypoint(plan, i, number, x, y, stay, 0)
    return plan


class _Follow:
    """A policy that does in each slot what the fluid model does with a plan."""

    name = "follow"

    def __init__(self, plan: Plan, slots: int):
        self.plan, self.slots = plan, slots
        self.crafts: list[np.ndarray] = []
        self.value, self.collected = 0.0, 0.0

    def act(self, view: View) -> np.ndarray:
        slot = int(view.constants["slot"][0])
        if slot == 0:
            self.crafts, self.value, self.collected = _flown(view, self.plan, self.slots)
        return np.array([self.crafts[slot + 1]["action"][i] for i in view.uav])


def _rates(view: View) -> Rates:
    part, _ = next(view.rows_by(RATES_PART))
    return load_rates(view.world, part)


def _flown(view: View, plan: Plan, slots: int) -> tuple[list[np.ndarray], float, float]:
    """The UAVs at the start of each slot of a flight, its value, and the data it collects."""
    (mission,), uavs, residual = view.state.missions, view.state.uavs[0], view.state.residual[0]
    flight, rates = empty_flight(MOST_SLOTS, len(uavs), len(residual)), _rates(view)
    begin_flight(mission, uavs, residual, flight)
    crafts, value = [flight.team[0].copy()], 0.0
    for slot in range(1, slots + 1):
        value = simulate_flight(mission, rates, plan, flight, 0, flight, slot, np.inf)
        crafts.append(flight.team[flight.last[0]].copy())
    return crafts, value, float(residual.sum() - flight.sea["base"][flight.last[0]].sum())


def _improved(view: View, plan: Plan, steps: int, most: int = 10_000) -> float:
    state = view.state
    (mission,), uavs, residual = state.missions, state.uavs[0], state.residual[0]
    workspace = empty_workspace(int(mission["max_slots"]), len(uavs), len(residual))
    nodes, rates = view.world.nodes, _rates(view)
    arguments = mission, uavs, residual, nodes, rates, plan, workspace, steps, 1.0
    improve_plan(*arguments, most)
    while workspace.course[TRIED]:
        improve_plan(*arguments, most)
    return workspace.course[BEST]


@pytest.mark.parametrize(("uavs", "quota"), [(1, 400), (2, 400), (3, 380), (6, 340)])
def test_a_flight_is_the_engines_where_nothing_is_random(uavs, quota):
    """Cells, batteries, the quota, charging; data within 2 %, as rates are means of a slot."""
    scenario = ScenarioSpace.of(load_scenario("fig4"), uavs=uavs, quota=quota, **CALM)
    view, plan = first_view(scenario, 5), empty_plan(uavs)
    for i in range(uavs):
        insert_waypoint(plan, i, 0, 26 + i % 4, 2 + i // 4, CHARGE, 0)
    _improved(view, plan, 3000)
    policy = _Follow(plan, 160)
    record = simulate(scenario, policy, 5, 0, events=True)
    assert record.events is not None
    assert record.metrics["success"] and (record.uavs["slots_charging"] > 0).all()
    assert record.metrics["collected"] == pytest.approx(policy.collected, rel=0.02)
    assert policy.value == pytest.approx(policy.collected, rel=0.02)  # next to no penalty
    log = record.events.columns()
    for i in range(uavs):
        moves = (log["event"] == "move") & (log["uav"] == i)
        flown = [(v["x"][i], v["y"][i], v["battery"][i] / 1000) for v in policy.crafts[1:]]
        assert [*zip(log["x"][moves], log["y"][moves], log["value"][moves], strict=True)] == (
            flown[: moves.sum()]
        )


@pytest.mark.parametrize("flying_time", [11, 12, 14])
def test_a_charge_adds_what_the_engines_add_whenever_it_begins(flying_time):
    """At 0.7 % a slot, which slots of a charge add 1 % depends on when it began."""
    fields = {"flying_time": flying_time, "charge_rate": 0.7, "quota": 400, "max_slots": 60}
    scenario = ScenarioSpace.of(**ALONE | CALM | fields)
    policy = _Follow(_plan(1, [(2, 2, CHARGE)]), 60)
    record = simulate(scenario, policy, 5, 0, events=True)
    assert record.events is not None
    battery = [event.battery for event in record.events if event.event == "move"]
    assert battery[:60] == [craft["battery"][0] / 1000 for craft in policy.crafts[1:]]
    assert battery[59] > 40


def test_without_a_quota_an_empty_battery_costs_the_same_however_much_was_sent():
    """No communications are lacking, and none are too many."""
    scenario = ScenarioSpace.of(**ALONE | CALM | {"quota": 0, "landing": True, "max_slots": 60})
    view = first_view(scenario, 5)
    for field, value in {"x": 7, "y": 7, "battery": 3}.items():  # too far from the zone
        view.state.uavs[0][field] = value
    _, value, collected = _flown(view, empty_plan(1), 60)
    assert collected > 0
    assert collected - value == pytest.approx(DEPLETED)


@pytest.mark.parametrize("replication", range(4))
def test_more_search_is_never_worse(replication):
    """The value that is returned is that of the plan, and each search keeps the best it finds."""
    view = first_view(load_scenario("paper"), 777001, replication)
    plan, values = empty_plan(view.state.uavs.shape[1]), []
    for i in range(int(view.state.missions[0]["uavs"])):
        insert_waypoint(plan, i, 0, 26 + i, 5, CHARGE, 0)
    for steps in (0, 1, 10, 100, 1000, 1000):
        values.append(_improved(view, plan, steps))
        assert values[-1] == _flown(view, plan, 400)[1]
    assert values == sorted(values) and values[-1] > values[0] + 100


def test_a_search_in_pieces_is_the_whole_search():
    view, found = first_view(load_scenario("paper"), 777001, 1), []
    for most in (10_000, 700, 333):
        plan = empty_plan(view.state.uavs.shape[1])
        value = _improved(view, plan, 1000, most)
        found.append((value, plan.waypoints.tobytes(), plan.lengths.tobytes()))
    assert found[0] == found[1] == found[2]


# --- hand-worked: a lone UAV at a single node ---

ALONE = {
    **{"grid": 8, "zone": [2, 2, 1, 1], "nodes": [[2, 2]], "uavs": 1, "quota": 40},
    **{"initial_data": 10.0, "charge_start": 10, "charge_complete": 60, "flying_time": 30},
}


def test_an_emptied_node_has_data_again_when_half_a_packet_has_gathered():
    scenario = Scenario.of(**ALONE, shadowing_variance=0.0, arrival_rate=0.1)
    view = first_view(scenario)
    empty = empty_plan(1)
    _, value, _ = _flown(view, empty, 1)
    assert value == pytest.approx(10.0 * 10.0 / 10.1)  # it hovers at the node and empties it
    taken = [_flown(view, empty, slots)[2] for slots in range(1, 8)]
    # Emptied in slot 0; in slot 5, five slots of 0.1 data units are there.
    assert taken == pytest.approx([10.0] * 5 + [10.5] * 2)


@pytest.mark.parametrize("rate", [0.0, 5e-324, 1e-300])
def test_where_next_to_nothing_arrives_an_empty_node_stays_empty(rate):
    view = first_view(Scenario.of(**ALONE, arrival_rate=rate))
    (mission,), uavs = view.state.missions, view.state.uavs[0]
    flight = empty_flight(MOST_SLOTS, 1, 1)
    begin_flight(mission, uavs, np.zeros(1), flight)
    assert flight.sea["since"][0].tolist() == [NEVER]


def test_a_uav_charges_at_its_waypoint_once_its_latch_is_set():
    scenario = Scenario.of(**ALONE, **CALM)
    plan = _plan(1, [(2, 2, CHARGE), (4, 2, 0)])
    crafts, _, _ = _flown(first_view(scenario), plan, 28)
    batteries = [craft["battery"][0] / 1000 for craft in crafts]
    # 20 slots until C_S = 10, five slots to C_C = 60, and then two cells to the east.
    assert batteries == [*range(30, 9, -1), 20, 30, 40, 50, 60, 59, 58, 57]
    assert [int(craft["x"][0]) for craft in crafts[-4:]] == [2, 3, 4, 4]
