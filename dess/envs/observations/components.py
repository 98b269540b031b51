"""The state of a UAV, its mission and its teammates as a vector of named components."""

import numpy as np

from dess.base.kernels import kernel
from dess.model.state import ACTION_NAMES, HOVER, STEP_X, STEP_Y, State, spaces_of
from dess.physics.charging import charge_limit
from dess.physics.chart import is_open
from dess.physics.energy import PERCENT, slot_cost_at
from dess.scenario.scenario import Scenario, ScenarioSpace

# The UAV's own state, whether it waits for a pad, the way to the nearest cell of a zone, the
# scenario's parameters and the time. The residual data of the nodes follow, then the teammates in
# the order of their indices, then what is beyond the paper.
_OWN = (
    *("active", "x", "y", "battery", "quota", "latch", "charging", "waiting"),
    *("zone_dx", "zone_dy", "charge_start", "charge_complete", "slot"),
)
_MATE = ("active", "dx", "dy", "battery", "quota", "charging")  # all 0 after the teammate has ended


def component_names(scenario: Scenario | ScenarioSpace) -> list[str]:
    """The names of the F components of an observation.

    Positions and distances are divided by the largest cell index in that direction, battery, C_S
    and C_C by 100, communications by the quota, the slot by ``max_slots``, and residual data by the
    high end of ``initial_data``. A UAV that has ended keeps its last state. Where a mission has
    fewer UAVs than the largest fleet, the other rows are zeros.

    Scenarios beyond the paper have more components at the end: the share of the pads that are out
    of order, what each move costs more than one percent a slot divided by 100, and ages divided by
    ``max_slots``.
    """
    space = spaces_of([scenario])[0]
    nodes = [f"residual_{k}" for k in range(len(space.nodes))]
    mates = [f"mate_{j}_{name}" for j in range(1, space.uavs[1]) for name in _MATE]
    return [*_OWN, *nodes, *mates, *sum(_beyond_the_paper(space), [])]


def _beyond_the_paper(space: ScenarioSpace) -> list[list[str]]:
    """The names of five groups of components; a group is empty if the scenario has it not."""
    nodes = range(len(space.nodes))
    failures = space.failures
    mates = [f"mate_{j}_grounded" for j in range(1, space.uavs[1])]
    groups = [
        (failures.uav_rate > 0, ["grounded", *mates]),
        (failures.largest_pad_rate > 0, ["pads_out"]),
        (failures.node_rate > 0, [f"silent_{k}" for k in nodes]),
        (
            space.wind.is_on or space.consumption.is_on,
            [f"wind_{name}" for name in ACTION_NAMES[:HOVER]],
        ),
        (space.age.is_on, [f"age_{k}" for k in nodes]),
    ]
    for has_group, names in groups:
        if not has_group:
            names.clear()
    return [names for _, names in groups]


def component_bounds(scenario: Scenario | ScenarioSpace) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and the highest values (F,) of an observation."""
    names = component_names(scenario)
    low = [-1.0 if name.endswith(("dx", "dy")) else 0.0 for name in names]
    # Arrivals are not bounded.
    high = [np.inf if name.startswith("residual") else 1.0 for name in names]
    return np.array(low, np.float32), np.array(high, np.float32)


class Components:
    """Encodes the state of a UAV, its mission and its teammates as a vector of named components.

    Unlike the other encoders, this one has no features made for learning; it fits every scenario.

    Attributes:
        shapes: The shape of its array per row: (F,).
    """

    def __init__(self, space: ScenarioSpace):
        groups = _beyond_the_paper(space)
        self._chart = space.chart
        self.shapes = ((len(component_names(space)),),)
        self._has = tuple(len(group) > 0 for group in groups)
        self._common = self.shapes[0][0] - sum(map(len, groups))

    def encode(
        self, state: State, missions: np.ndarray, uavs: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """The observations of UAV ``uavs[r]`` in mission ``missions[r]``: (R, F) float32.

        Where ``uavs[r]`` is -1, they are zeros.
        """
        out = np.zeros((len(missions), *self.shapes[0]), np.float32)
        _encode(state, self._chart, missions, uavs, self._has, self._common, out)
        return (out,)


@kernel
def _encode(state, chart, missions, uavs, has, common, out):
    for row in range(len(missions)):
        b = missions[row]
        i = uavs[row]
        if i >= 0:
            mission = state.missions[b]
            team = state.uavs[b]
            _encode_uav(mission, chart, team, i, state.residual[b], out[row])
            _encode_beyond(has, mission, chart, team, i, state.sensors[b], out[row, common:])


@kernel
def _encode_uav(mission, chart, uavs, i, residual, out):
    """What every observation has of one UAV, in the order of ``component_names``."""
    u = uavs[i]
    home = chart.parking[chart.nearest[uavs[i].y, uavs[i].x]]
    rows, columns = chart.zones.shape
    column = 1.0 / (columns - 1)
    row = 1.0 / (rows - 1)
    out[0] = u.active
    out[1] = u.x * column
    out[2] = u.y * row
    out[3] = u.battery / 100.0
    out[4] = _quota_share(u)
    out[5] = u.latch
    out[6] = u.charging
    out[7] = u.pad_request >= 0 and not u.charging
    out[8] = (home[0] - u.x) * column
    out[9] = (home[1] - u.y) * row
    out[10] = mission.charge_start / 100.0
    out[11] = charge_limit(mission, u) / 100.0
    out[12] = mission.slot / mission.max_slots
    at = 13
    full = mission.initial_high if mission.initial_high > 0.0 else 1.0
    for k in range(mission.nodes):
        out[at] = residual[k] / full
        at += 1
    for j in range(len(uavs)):
        if j == i:
            continue
        mate = uavs[j]
        if mate.active:
            out[at] = 1.0
            out[at + 1] = (mate.x - u.x) * column
            out[at + 2] = (mate.y - u.y) * row
            out[at + 3] = mate.battery / 100.0
            out[at + 4] = _quota_share(mate)
            out[at + 5] = mate.charging
        at += 6


@kernel
def _quota_share(u):
    """Communications as a share of the quota, at most 1; 0 without a quota."""
    return min(u.communications / u.quota, 1.0) if u.quota > 0 else 0.0


@kernel
def _surcharge(mission, u, action, x, y):
    """What a move costs more than one percent a slot, 0 if it costs less [%]."""
    more = slot_cost_at(mission, u.slots_per_cell, action, x, y) - PERCENT
    return max(u.slots_per_cell * more, 0) / PERCENT


@kernel
def _encode_beyond(has, mission, chart, uavs, i, sensors, out):
    """Write the components of UAV ``i`` in the order of ``_beyond_the_paper``."""
    can_be_grounded, pads_fail, nodes_fail, has_wind, has_age = has
    u = uavs[i]
    at = 0
    if can_be_grounded:
        out[0] = u.grounded
        at = 1
        for j in range(len(uavs)):
            if j != i:
                out[at] = uavs[j].grounded
                at += 1
    if pads_fail:
        out[at] = mission.pads_out[: mission.pads].sum() / mission.pads
        at += 1
    if nodes_fail:
        for k in range(mission.nodes):
            out[at + k] = sensors[k].silent
        at += mission.nodes
    if has_wind:
        for action in range(HOVER):
            x = u.x + STEP_X[action]
            y = u.y + STEP_Y[action]
            if is_open(chart.zones, x, y):
                extra = _surcharge(mission, u, action, x, y)
                out[at + action] = mission.flight_cost * extra / 100.0
        at += HOVER
    if has_age:
        for k in range(mission.nodes):
            out[at + k] = (mission.slot - sensors[k].newest) / mission.max_slots
