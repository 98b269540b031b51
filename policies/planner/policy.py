"""The planner as a policy: it plans for the whole team, and each UAV takes its first action.

In slot 0 a plan is searched for from scratch. It is followed until the mission departs from it;
then it is improved from what has really happened. The return guard has the last word on every
action.

A plan must depend on nothing but its mission, so the policy itself keeps nothing. Plans belong to
the arrays in which an engine or an environment holds its missions: row b of a memory to mission b.
They go when these arrays go. In slot 0 every mission is planned from scratch.
"""

import weakref
from functools import partial
from typing import NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.model.guard import guard
from dess.model.guard.battery import must_charge
from dess.model.state import HOVER, STEP_X, State
from dess.model.view import View
from dess.physics.landing import lands
from dess.policies.choices import step_towards
from dess.policies.planner import fluid
from dess.policies.planner.rates import RATES_PART, load_rates
from dess.policies.planner.search import TRIED, empty_workspace, improve_plan
from dess.policies.planner.waypoints import (
    CHARGE,
    MOST_WAYPOINTS,
    WAYPOINT,
    Plan,
    insert_waypoint,
    remove_waypoint,
)

# The temperature of the first step of a search [data units]: for a new plan, and for one that is
# improved.
_NEW, _AGAIN = 2.0, 1.0
# The mission departs from a plan if a node has so many data units more or less than expected.
_TOLERANCE = 1.5
# The most work of a call of compiled code, as UAVs times their teammates and communication slots in
# all slots that are planned. Ctrl-C waits until it is done.
_WORK = 2**25


class Budget(NamedTuple):
    """How many edits of a plan a search tries for a lone UAV.

    A team of n UAVs gets the n-th part, since each of its edits takes n times as long.

    Attributes:
        new: For a new plan.
        again: Each time that the mission departs from the plan.
    """

    new: int
    again: int


class Memory(NamedTuple):
    """The plans of B missions with up to I UAVs.

    Attributes:
        made: (B, 3) the seed, replication and slot + 1 that each plan was made for; 0 for none.
        waypoints, lengths: (B, ...) as in ``Plan``.
        first: (B, I) ``CRAFT`` records: the UAVs after the slot, if it goes as planned.
        sea: (B, K) the residual data after the slot, if it goes as planned, without what arrives
            in it [data units].
        surplus: (B, K) by how much the data of the slots since the last search were more than
            planned [data units].
    """

    made: np.ndarray
    waypoints: np.ndarray
    lengths: np.ndarray
    first: np.ndarray
    sea: np.ndarray
    surplus: np.ndarray


# The memories by the identity of the arrays that they belong to, and the budget of the search.
_MEMORIES: dict[tuple[int, Budget], tuple[weakref.ref, Memory]] = {}


class Planner:
    """Plan for the whole team by simulated annealing in a fluid model of the mission.

    The plan is improved whenever the mission departs from it. It works for any fleet on any sea.

    Attributes:
        budget: How long it searches.
        chunk: How many missions a study computes at a time, so that an interruption loses little.
    """

    name, chunk = "planner", 10
    budget = Budget(45_000, 3_000)

    def act(self, view: View) -> np.ndarray:
        """Choose the (R,) actions for the rows of the view."""
        state = view.state
        slots = int(state.missions["max_slots"].max())
        safe = guard(view)
        memory = recall_plans(state, self.budget)
        fleet = state.uavs.shape[1]
        m = int(state.missions["communication_slots"][0])
        edits = max(_WORK // (min(slots, fluid.MOST_SLOTS) * fleet * (fleet + m)), 1)
        workspace = empty_workspace(slots, fleet, state.residual.shape[1])
        actions = np.empty(len(view), np.int64)
        for part, rows in view.rows_by(RATES_PART):
            rates = load_rates(view.world, part)
            chosen = np.empty(len(rows), np.int64)
            decided = 0
            while decided < len(rows):
                decided = _choose_actions(
                    state.missions, state.uavs, state.residual, view.world.nodes, rates,
                    memory, workspace, view.mission[rows], view.uav[rows], safe[rows],
                    self.budget, chosen, decided, edits,
                )  # fmt: skip
            actions[rows] = chosen
        return actions


class ShortPlanner(Planner):
    """Plan as ``planner`` does, with a fifth of its search, so that long sweeps can use it."""

    name = "planner-short"
    budget = Budget(8_000, 600)


class LongPlanner(Planner):
    """Plan as ``planner`` does, with searches that are about ten times as long."""

    name = "planner-long"
    budget = Budget(480_000, 36_000)


def recall_plans(state: State, budget: Budget) -> Memory:
    """The plans of the missions in a state by a planner with this budget."""
    missions = state.missions
    shape = state.uavs.shape
    key = (id(missions), budget)
    if key not in _MEMORIES:
        memory = Memory(
            np.zeros((len(missions), 3), np.uint64),
            np.zeros((*shape, MOST_WAYPOINTS + 1), WAYPOINT),
            np.zeros(shape, np.int64),
            np.zeros(shape, fluid.CRAFT),
            np.zeros_like(state.residual),
            np.zeros_like(state.residual),
        )
        forget = partial(_MEMORIES.pop, key)  # called with the reference, as the default of ``pop``
        _MEMORIES[key] = weakref.ref(missions, forget), memory
    return _MEMORIES[key][1]


@kernel
def _choose_actions(
    missions, uavs, residual, nodes, rates, memory, workspace,
    rows_mission, rows_uav, safe, budget, actions, decided, most,
):  # fmt: skip
    """Choose the actions of rows; return how many are decided once ``most`` edits were tried."""
    for row in range(decided, len(rows_mission)):
        if most <= 0:
            return row
        b = rows_mission[row]
        i = rows_uav[row]
        mission = missions[b]
        team = uavs[b]
        planned_for = memory.made[b]
        plan = Plan(memory.waypoints[b], memory.lengths[b])
        slot = np.uint64(mission.slot + 1)
        is_same = planned_for[0] == mission.seed and planned_for[1] == np.uint64(
            mission.replication
        )
        if not is_same or planned_for[2] != slot:
            is_new = not is_same or not 0 < planned_for[2] < slot
            steps, hottest = (budget.new, _NEW) if is_new else (budget.again, _AGAIN)
            steps = (steps + mission.uavs - 1) // mission.uavs
            if workspace.course[TRIED] == 0:
                if is_new:
                    _write_first_plan(mission, team, residual[b].sum(), rates.chart, plan)
                    memory.surplus[b] = 0.0
                elif _departs_from_plan(
                    mission, team, residual[b], memory, b, slot - planned_for[2]
                ):
                    memory.surplus[b] = 0.0
                else:
                    steps = 0
                if not is_new:
                    _drop_done_waypoints(mission, team, plan, memory.first[b])
            if steps > 0:
                most -= improve_plan(
                    mission, team, residual[b], nodes, rates, plan, workspace, steps, hottest, most
                )
                if workspace.course[TRIED] > 0:
                    return row
            else:
                fluid.begin_flight(mission, team, residual[b], workspace.flight)
            ahead = workspace.ahead
            fluid.simulate_flight(mission, rates, plan, workspace.flight, 0, ahead, 1, np.inf)
            for k in range(mission.nodes):
                memory.sea[b, k] = ahead.sea[ahead.last[0], k].base
            for j in range(mission.uavs):
                memory.first[b, j] = ahead.team[ahead.last[0], j]
            planned_for[0] = mission.seed
            planned_for[1] = np.uint64(mission.replication)
            planned_for[2] = slot
        action = memory.first[b, i].action
        if _must_charge_here(
            mission, team[i], residual[b].sum(), plan.waypoints[i], plan.lengths[i]
        ):
            action = HOVER
        if not safe[row, action]:
            x = team[i].x
            y = team[i].y
            number = memory.first[b, i].next
            if number < plan.lengths[i]:
                x, y = plan.waypoints[i, number].x, plan.waypoints[i, number].y
            moves = 0
            for move in range(len(STEP_X)):
                if safe[row, move]:
                    moves |= 1 << move
            action = step_towards(mission, team, i, rates.chart, moves, x, y)
        actions[row] = action
    return len(rows_mission)


@kernel
def _departs_from_plan(mission, uavs, residual, memory, b, slots):
    """Whether a mission is no longer what its plan, made that many slots ago, was made for."""
    departs = False
    arrived = mission.arrival_rate * slots
    for k in range(mission.nodes):
        memory.surplus[b, k] += residual[k] - memory.sea[b, k] - arrived
        departs = departs or abs(memory.surplus[b, k]) > _TOLERANCE
    for i in range(mission.uavs):
        u = uavs[i]
        v = memory.first[b, i]
        is_at_work = u.active and not u.grounded
        is_elsewhere = u.x != v.x or u.y != v.y or u.charging != v.charging
        departs = departs or is_at_work != v.active or (is_at_work and is_elsewhere)
    return departs


@inlined
def _must_charge_here(mission, u, data, waypoints, length):
    """Whether a UAV in the zone must charge though its plan has no charge.

    The fluid model may expect that the battery suffices for the quota where the guard does not.
    """
    if lands(mission) or not (u.latch and u.zone >= 0 and must_charge(mission, u, data)):
        return False
    is_planned = False
    for number in range(length):
        is_planned = is_planned or waypoints[number].stay == CHARGE
    return not is_planned


@kernel
def _write_first_plan(mission, uavs, data, chart, plan):
    """A plan in which the UAVs that must charge do so, each in its own cell of the zone."""
    for i in range(mission.uavs):
        plan.lengths[i] = 0
        if not lands(mission) and uavs[i].active and must_charge(mission, uavs[i], data):
            cell = chart.parking[i % len(chart.parking)]
            insert_waypoint(plan, i, 0, cell[0], cell[1], CHARGE, 0)


@kernel
def _drop_done_waypoints(mission, uavs, plan, planned):
    """Take out of a plan what has been done in the slot that it was made for.

    If UAVs have begun to charge, or have been charged since, their plans follow.
    """
    for i in range(mission.uavs):
        u = uavs[i]
        v = planned[i]
        if not u.active:
            plan.lengths[i] = 0
            continue
        for _ in range(v.next):
            remove_waypoint(plan, i, 0)
        if plan.lengths[i] > 0 and plan.waypoints[i, 0].stay != CHARGE:
            plan.waypoints[i, 0].stay -= v.stayed
        charge = 0
        while charge < plan.lengths[i] and plan.waypoints[i, charge].stay != CHARGE:
            charge += 1
        if charge == plan.lengths[i]:
            continue
        if u.charging and charge > 0:
            remove_waypoint(plan, i, charge)
            insert_waypoint(plan, i, 0, u.x, u.y, CHARGE, 0)
        elif v.charging != 0 and charge == 0 and not u.charging and not u.latch:
            remove_waypoint(plan, i, 0)
