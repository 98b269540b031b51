"""The fluid model: what the engine collects where nothing is random, and hand-worked cases."""

import numpy as np
import pytest

from dess import Scenario, ScenarioSpace, load_scenario, simulate
from dess.env.stepper import MissionStepper
from dess.view import View, acting_rows
from policies.planner.fluid import (
    CHARGE,
    MOST_SLOTS,
    Plan,
    begin,
    empty_flight,
    empty_plan,
    fly,
    insert,
)
from policies.planner.rates import rates_of
from policies.planner.search import empty_workspace, improve

CALM = {"shadowing_variance": 0.0, "arrival_rate": 0.0}


def _view(scenario: Scenario | ScenarioSpace, seed: int = 1, replication: int = 0) -> View:
    """The first slot of a mission."""
    stepper = MissionStepper(scenario, 1, seed)
    stepper.start_at(seed, replication)
    stepper.launch(stepper.indices)
    state = stepper.state
    return View(state, stepper.world, *acting_rows(state.missions, state.uavs, 1, 0))


def _plan(uavs: int, *routes: list[tuple[int, int, int]]) -> Plan:
    """A plan of waypoints ``x, y, stay``."""
    plan = empty_plan(uavs)
    for i, route in enumerate(routes):
        for number, (x, y, stay) in enumerate(route):
            insert(plan, i, number, x, y, stay, 0)
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


def _flown(view: View, plan: Plan, slots: int) -> tuple[list[np.ndarray], float, float]:
    """The UAVs at the start of each slot of a flight, its value, and the data it collects."""
    (mission,), uavs, residual = view.state.missions, view.state.uavs[0], view.state.residual[0]
    flight, rates = empty_flight(MOST_SLOTS, len(uavs), len(residual)), rates_of(view)
    begin(mission, uavs, residual, rates, flight)
    crafts, value = [flight.team[0].copy()], 0.0
    for slot in range(1, slots + 1):
        value = fly(mission, rates, plan, flight, 0, flight, slot)
        crafts.append(flight.team[flight.last[0]].copy())
    return crafts, value, float(residual.sum() - flight.sea["base"][flight.last[0]].sum())


def _improved(view: View, plan: Plan, steps: int) -> float:
    state = view.state
    (mission,), uavs, residual = state.missions, state.uavs[0], state.residual[0]
    workspace = empty_workspace(int(mission["max_slots"]), len(uavs), len(residual))
    nodes, rates = view.world.nodes, rates_of(view)
    return improve(mission, uavs, residual, nodes, rates, plan, workspace, steps, 1.0)


@pytest.mark.parametrize("uavs", [1, 2, 3, 6])
def test_a_flight_is_the_engines_where_nothing_is_random(uavs: int) -> None:
    """Cells, batteries, the quota, charging, and the data that are collected."""
    scenario = ScenarioSpace.of(load_scenario("fig4"), uavs=uavs, quota=400, **CALM)
    view, plan = _view(scenario, 5), empty_plan(uavs)
    for i in range(uavs):
        insert(plan, i, 0, 26 + i % 4, 2 + i // 4, CHARGE, 0)
    _improved(view, plan, 3000)
    policy = _Follow(plan, 160)
    record = simulate(scenario, policy, 5, 0, events=True)
    assert record.events is not None
    assert record.metrics["success"] and (record.uavs["slots_charging"] > 0).all()
    assert record.metrics["collected"] == pytest.approx(policy.collected, rel=1e-9)
    assert policy.value == pytest.approx(policy.collected, rel=0.01)  # next to no penalty
    log = record.events.columns()
    for i in range(uavs):
        moves = (log["event"] == "move") & (log["uav"] == i)
        flown = [(v["x"][i], v["y"][i], v["battery"][i]) for v in policy.crafts[1:]]
        assert [*zip(log["x"][moves], log["y"][moves], log["value"][moves], strict=True)] == (
            flown[: moves.sum()]
        )
