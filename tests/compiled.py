"""Rules that exist only inside compiled functions, so that tests can call them one by one."""

import numpy as np

from dess.analysis.stats.sequences import SEQUENCE, start_sequence
from dess.base.kernels import kernel
from dess.model import rules
from dess.model.channel import empty_scratch
from dess.model.guard import battery, matching, moves, parking, queues, ways
from dess.model.state import MISSION, SENSOR, STEP_X, STEP_Y
from dess.model.ways import Ways
from dess.physics import chart
from dess.physics.chart import FAR, distance, is_open
from dess.policies import choices
from dess.scenario.fields import MOST_ZONES


@kernel
def resolve(mission, uavs, chart):
    rules.resolve(mission, uavs, chart.zones)


@kernel
def move(mission, uavs, chart):
    rules.resolve(mission, uavs, chart.zones)
    rules.grant_pads(mission, uavs)
    rules.spend(mission, uavs)


def arrive(mission, residual, arrivals):
    sensors = np.zeros(len(residual), SENSOR)
    scratch = empty_scratch(1, len(residual))
    _arrive(mission, residual, sensors, scratch._replace(arrivals=arrivals))


@kernel
def _arrive(mission, residual, sensors, scratch):
    rules.arrive(mission, residual, sensors, scratch)


@kernel
def settle(mission, uavs):
    rules.settle(mission, uavs)


@kernel
def must_charge(mission, u, data):
    return battery.must_charge(mission, u, data)


@kernel
def path(mission, uavs, i, chart, x, y):
    return ways.path_length(mission, uavs, i, chart, None, uavs[i].x, uavs[i].y, x, y)


@kernel
def distances(chart, x, y, to):
    """Shortest ways from cells, which may be closed, to cells."""
    found = np.full(len(x), FAR)
    for row in range(len(x)):
        if is_open(chart.zones, x[row], y[row]):
            found[row] = distance(chart, x[row], y[row], to[row, 0], to[row, 1])
    return found


@kernel
def cost_around(mission, zones, least, closed, start, end, limit):
    """What the cheapest way of a fast UAV costs around closed cells, the limit at most."""
    costs = np.full(zones.size, limit, np.int32)
    costs[closed] = -1
    table = least.reshape((1, -1))
    return chart.cost_around(zones, mission, 1, table, 0, costs, *start, *end, limit)


def _with_sections(mission, chart):
    """A mission as one that has sections, and its table: functions are compiled for that alone."""
    missions = np.array([mission]).view(MISSION)
    return missions[0], Ways(missions, chart).reach


def parking_cell(mission, uavs, i, chart, data=1e6):
    mission, reach = _with_sections(mission, chart)
    memory = parking.parking_memory(chart, len(uavs))
    return _parking_cell(mission, uavs, i, data, chart, memory, reach)


def planned_cells(mission, uavs, i, chart, data=1e6):
    """The cells that teammates choose before UAV ``i`` in its plan; None where one chooses none."""
    mission, reach = _with_sections(mission, chart)
    memory = parking.parking_memory(chart, len(uavs))
    _parking_cell(mission, uavs, i, data, chart, memory, reach)
    return [tuple(chart.parking[number]) if number >= 0 else None for number in memory.planned]


@kernel
def _parking_cell(mission, uavs, i, data, chart, memory, reach):
    return parking.parking_cell(mission, uavs, i, data, chart, memory, reach)


def plan_of_pads(mission, uavs, i, chart, data=1e6):
    """The plan, and what UAV ``i`` must keep for waits, when it charges, and if it gives way."""
    mission, reach = _with_sections(mission, chart)
    plan = queues.Plan(np.zeros(len(uavs), queues.TURN), np.zeros(MOST_ZONES, queues.QUEUE))
    return plan, _plan_pads(mission, uavs, i, data, chart, plan, reach)


@kernel
def _plan_pads(mission, uavs, i, data, chart, plan, reach):
    return queues.plan_pads(mission, uavs, i, data, chart, plan, reach)


def spread_out(prices, zones, cells):
    """The zones of UAVs that were in the best zone for each, as the matching changes them."""
    places = zones.copy()
    _spread_out(prices, places, cells - np.bincount(zones, minlength=len(cells)))
    return places


@kernel
def _spread_out(prices, places, left):
    matching.spread_out(prices, places, left)


def goal(kind, mission, uavs, i, residual, sensors, nodes, chart, reach):
    """The node whose cell is the goal that a heuristic chooses, or -1 for another cell."""
    home = parking_cell(mission, uavs, i, chart, residual.sum())
    cell = _goal(kind, mission, uavs, i, residual, sensors, nodes, chart, home, reach)
    if cell == (home.x, home.y):
        return -1
    return next(iter(np.flatnonzero((nodes == cell).all(axis=1))), -1)


@kernel
def _goal(kind, mission, uavs, i, residual, sensors, nodes, chart, home, reach):
    charge = battery.must_charge(mission, uavs[i], rules.data_left(mission, residual))
    return choices._choose_goal(
        kind, mission, uavs, i, residual, sensors, nodes, np.zeros(0, np.int64), chart, charge,
        home, reach,
    )  # fmt: skip


@kernel
def step_cost(mission, uavs, i, chart, action, x, y):
    """What a heuristic counts for an action of a UAV that flies to a cell."""
    u = uavs[i]
    after = u.x + STEP_X[action], u.y + STEP_Y[action]
    way = ways.path_length(mission, uavs, i, chart, None, after[0], after[1], x, y)
    return way, moves.contest(moves.contests(mission, uavs, i, chart.sizes, None), action)


def new_sequence(least, most, error=0.05, failure=0.0):
    """A confidence sequence without values, see ``start_sequence``."""
    sequence = np.zeros(1, SEQUENCE)
    start_sequence(sequence, float(least), float(most), float(failure), error)
    return sequence
