"""The courses of UAVs that a planner has planned during a mission.

>>> plans = plan_of(load_scenario("paper"), seed=1, replication=0)
>>> plans[20][0].waypoints[:2]     # of UAV 0, as planned in slot 20; ``path`` has its cells
array([[ 3, 11],
       [22, 16]])
"""

from typing import NamedTuple

import numpy as np

from dess.model.mission import Mission, simulate
from dess.model.view import View, decide
from dess.policies.planner.fluid import (
    MOST_SLOTS,
    begin_flight,
    empty_flight,
    simulate_flight,
)
from dess.policies.planner.policy import Planner, recall_plans
from dess.policies.planner.rates import RATES_PART, load_rates
from dess.policies.planner.waypoints import Plan
from dess.scenario.scenario import Scenario, ScenarioSpace


class Course(NamedTuple):
    """What a plan has a UAV do, from the present slot on.

    Attributes:
        waypoints: (W, 2) the cells that it flies to, one after another.
        stays: (W,) for how many slots it hovers at each; -1 where it charges.
        path: (T + 1, 2) the cell in which the fluid model expects it, now and after each slot until
            its quota is filled.
    """

    waypoints: np.ndarray
    stays: np.ndarray
    path: np.ndarray


def plan_of(
    scenario: Scenario | ScenarioSpace,
    seed: int = 0,
    replication: int = 0,
    planner: Planner | None = None,
) -> dict[int, list[Course]]:
    """The plans of a planner in each slot of a mission in which it decides.

    Args:
        scenario: The scenario.
        seed: Seed of the mission.
        replication: Number of the replication.
        planner: The planner; without one, ``planner``.

    Returns:
        The plan for the team by mission slot: a course per UAV, empty for UAVs that have ended.

    Raises:
        InputError: If the seed or the replication is out of range.
    """
    watched = _Watched(planner or Planner())
    simulate(scenario, watched, seed, replication)
    return watched.plans


def first_plan(
    scenario: ScenarioSpace, seed: int = 0, replication: int = 0, planner: Planner | None = None
) -> list[Course]:
    """The plan in the first slot of a mission, without simulating the mission.

    Args:
        scenario: The scenario.
        seed: Seed of the mission.
        replication: Number of the replication.
        planner: The planner; without one, ``planner``.

    Returns:
        A course per UAV.
    """
    watched = _Watched(planner or Planner())
    model = Mission(scenario, [watched], seed, replication)
    decide(model.policies, model.state, model.shown_world, model.ways)
    return watched.plans[0]


class _Watched:
    """A planner whose plans for a mission are kept."""

    def __init__(self, planner: Planner):
        self.planner = planner
        self.name = planner.name
        self.plans: dict[int, list[Course]] = {}

    def act(self, view: View) -> np.ndarray:
        actions = self.planner.act(view)
        self.plans[int(view.constants["slot"][0])] = _predict_courses(view, self.planner)
        return actions


def _predict_courses(view: View, planner: Planner) -> list[Course]:
    """The courses of a planner's present plan for the mission of a view."""
    state = view.state
    part, _ = next(view.rows_by(RATES_PART))
    rates = load_rates(view.world, part)
    mission = state.missions[0]
    uavs = state.uavs[0]
    residual = state.residual[0]
    memory = recall_plans(state, planner.budget)
    plan = Plan(memory.waypoints[0].copy(), memory.lengths[0].copy())
    flight = empty_flight(MOST_SLOTS, len(uavs), len(residual))
    begin_flight(mission, uavs, residual, flight)
    crafts = [flight.team[0].copy()]
    slots = min(mission["max_slots"] - mission["slot"], MOST_SLOTS)
    for slot in range(1, int(slots) + 1):
        simulate_flight(mission, rates, plan, flight, 0, flight, slot, np.inf)
        if flight.last[1] < slot:
            break
        crafts.append(flight.team[flight.last[0]].copy())
    return [
        _course_of(plan.waypoints[i, : plan.lengths[i]], np.stack(crafts)[:, i])
        for i in range(mission["uavs"])
    ]


def _course_of(waypoints: np.ndarray, crafts: np.ndarray) -> Course:
    """The course of a UAV from its waypoints and its states in all slots."""
    cells = np.stack([crafts["x"], crafts["y"]], 1)
    slots = int(crafts["active"].sum())  # it is active until its last slot
    return Course(
        np.stack([waypoints["x"], waypoints["y"]], 1), waypoints["stay"].copy(), cells[: slots + 1]
    )
