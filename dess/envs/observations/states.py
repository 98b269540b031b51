"""Compact states, from which the observations are computed: a few bytes per mission and slot.

The replay memory stores these states instead of observations: one state serves all UAVs of its
mission, and the next state of a transition is a later row of the memory.

    states = compact_states(view.state, view.world.chart, guarded=True)
    masks(states, view.mission, view.uav)                        # (R, 5) allowed actions
    Vector(layout_of(space)).encode(states, view.mission, view.uav)
"""

from typing import NamedTuple

import numpy as np

from dess.base.errors import InputError
from dess.base.kernels import inlined, kernel
from dess.model.guard.battery import slots_needed
from dess.model.guard.moves import guide
from dess.model.guard.ways import battery_home, cells_home
from dess.model.rules import legal_moves, may_act
from dess.model.state import HOVER, State
from dess.model.ways import Ways
from dess.physics.chart import Chart, zones_of
from dess.physics.energy import PERCENT
from dess.scenario.scenario import ScenarioSpace

# Columns of ``CompactStates.missions``.
CHARGE_START, CHARGE_COMPLETE = range(2)
MISSION_COLUMNS = 2
# Columns of ``CompactStates.uavs``: the cell, the battery [%], mission slots until the quota is
# filled, whether the UAV is active, latched, charging and must charge, the battery [%] that it
# needs to reach its parking cell, and the mask of its allowed actions as bits.
X, Y, BATTERY, NEEDED, ACTIVE, LATCH, CHARGING, MUST_CHARGE, HOME, MASK = range(10)
UAV_COLUMNS = 10

_MOST = np.iinfo(np.int16).max


class CompactStates(NamedTuple):
    """The states of S missions, each at one time, with up to I UAVs and K nodes.

    Attributes:
        missions: (S, 2) int16, columns ``CHARGE_START`` and ``CHARGE_COMPLETE``.
        uavs: (S, I, 10) int16, columns ``X`` to ``MASK``; zeros where a mission has fewer UAVs.
        residual: (S, K) float32 [data units].
    """

    missions: np.ndarray
    uavs: np.ndarray
    residual: np.ndarray


class Layout(NamedTuple):
    """The square grid, the only zone and the nodes that all missions of a space share.

    Attributes:
        grid: Cells along one side (M).
        zone: (4,) x, y, width and height of the charging zone [cells].
        nodes: (K, 2) cells of the nodes.
    """

    grid: int
    zone: np.ndarray
    nodes: np.ndarray

    @property
    def zones(self) -> np.ndarray:
        """``Chart.zones`` of the layout."""
        return zones_of(self.grid, self.grid, [tuple(self.zone.tolist())], [])

    def zone_slots(self, cells: np.ndarray) -> np.ndarray:
        """(N,) slots from each of (N, 2) cells to the nearest cell of the zone."""
        x, y, width, height = self.zone
        nearest = np.clip(cells, [x, y], [x + width - 1, y + height - 1])
        return np.abs(cells - nearest).sum(1)


def layout_of(space: ScenarioSpace) -> Layout:
    """The layout of a space.

    Raises:
        InputError: If it has no such layout.
    """
    misfits = [
        ("rows", space.size[0] != space.size[1], "a square grid"),
        ("zones", space.has("zones"), "a single zone"),
        ("no_fly", space.has("no_fly"), "no no-fly cells"),
    ]
    for field, is_wrong, allowed in misfits:
        if is_wrong:
            raise InputError(
                field, f"the observations vector and maps need {allowed}", "the observation state"
            )
    return Layout(space.grid, np.array(space.zone), np.array(space.nodes))


def empty_states(count: int, uavs: int, nodes: int) -> CompactStates:
    """Compact states filled with zeros, for that many missions, UAVs per mission and nodes."""
    return CompactStates(
        np.zeros((count, MISSION_COLUMNS), np.int16),
        np.zeros((count, uavs, UAV_COLUMNS), np.int16),
        np.zeros((count, nodes), np.float32),
    )


def compact_states(
    state: State, chart: Chart, guarded: bool, ways: Ways | None = None
) -> CompactStates:
    """The compact states of all missions of a state.

    Args:
        state: The state of B missions.
        chart: Their chart.
        guarded: True for the mask of the return guard, False for the mask of all legal actions.
        ways: Those of the batch; without them, they are made of the missions of the state.
    """
    states = empty_states(len(state.missions), state.uavs.shape[1], state.residual.shape[1])
    reach = (ways or Ways(state.missions, chart)).reach
    rows = active_rows(state.missions, state.uavs)
    now = state.missions, state.uavs, state.residual
    guidance = guide(*now, *rows, chart, reach, True)
    fill_states(*now, guarded, chart, reach, *guidance, *states)
    return states


@kernel
def active_rows(missions, uavs):
    """The (R,) missions and (R,) UAV indices of all active UAVs."""
    rows_mission = np.empty(uavs.size, np.int64)
    rows_uav = np.empty(uavs.size, np.int64)
    count = 0
    for b in range(len(missions)):
        for i in range(missions[b].uavs):
            if uavs[b, i].active:
                rows_mission[count], rows_uav[count] = b, i
                count += 1
    return rows_mission[:count], rows_uav[:count]


@kernel
def fill_states(
    missions, uavs, residual, guarded, chart, reach, charge, home, safe,
    out_missions, out_uavs, out_residual,
):  # fmt: skip
    """Write the compact states of missions.

    Args:
        missions, uavs, residual: As in ``State``.
        guarded: As ``compact_states``.
        chart: The chart.
        reach: ``Ways.reach``.
        charge, home, safe: The ``Guidance`` of all active UAVs.
        out_missions, out_uavs, out_residual: The states, filled with zeros.
    """
    guided = 0  # the active UAVs so far
    for b in range(len(missions)):
        mission = missions[b]
        team = uavs[b]
        out_missions[b, CHARGE_START] = mission.charge_start
        out_missions[b, CHARGE_COMPLETE] = mission.charge_complete
        for k in range(residual.shape[1]):  # compiles in a tenth of the time of the whole row
            out_residual[b, k] = residual[b, k]
        for i in range(mission.uavs):
            u = team[i]
            row = out_uavs[b, i]
            row[X], row[Y], row[BATTERY] = u.x, u.y, u.battery
            row[NEEDED] = min(max(slots_needed(mission, u), 0), _MOST)
            row[ACTIVE], row[LATCH], row[CHARGING] = u.active, u.latch, u.charging
            row[MASK] = 1 << HOVER
            if not u.active:
                continue
            row[MUST_CHARGE] = charge[guided]
            battery = battery_home(mission, team, i, chart, None, u.x, u.y, home[guided], reach)
            cells = cells_home(mission, team, i, chart, None, u.x, u.y, home[guided])
            battery = _observed_battery(battery, cells * u.slots_per_cell)
            row[HOME] = min(battery, _MOST)
            if may_act(u):
                row[MASK] = safe[guided] if guarded else legal_moves(chart.zones, u)
            guided += 1


@inlined
def _observed_battery(battery, slots):
    """The battery for a way as it was in training [%]: no slot takes less than one percent.

    Args:
        battery: What the way takes [% / 1000].
        slots: The slots that it takes.
    """
    return max((battery + PERCENT - 1) // PERCENT, slots)


def masks(states: CompactStates, missions: np.ndarray, uavs: np.ndarray) -> np.ndarray:
    """The (R, 5) mask of the allowed actions of UAV ``uavs[r]`` in state ``missions[r]``.

    Where ``uavs[r]`` is -1, only Hover is allowed.
    """
    out = np.empty((len(uavs), 5), np.bool_)
    _write_masks(states.uavs, missions, uavs, out)
    return out


@kernel
def _write_masks(states, missions, uavs, out):
    for row in range(len(uavs)):
        bits = states[missions[row], uavs[row], MASK] if uavs[row] >= 0 else 1 << HOVER
        for action in range(5):
            out[row, action] = bits >> action & 1
