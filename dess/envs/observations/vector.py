"""Observation (b): a compact vector, with more information than the paper's observation.

It adds the slots until the quota is filled, the charging latch, C_S and C_C, the slots to the
parking cell, which UAVs must charge, and which cells around are occupied. Every node has its own
entry, so a network is valid for one layout only. The number of teammates may vary: the two nearest
are described one by one, and all of them affect the data that is left for this UAV.
"""

import numpy as np

from dess.base.elementary import exp_of_each
from dess.base.kernels import inlined, kernel
from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates, Layout
from dess.model.state import HOVER, STEP_X, STEP_Y

MATES = 2  # teammates described one by one, the nearest first
_OWN = 16
_NODE = 4
_MATE = 11
# The nearness of a node to a cell is exp(-slots / scale), for each scale [slots]. The sums of data
# times nearness are divided by these divisors.
SCALES = np.array([1.2, 4.0, 12.0])
_NORMS = np.array([10.0, 25.0, 80.0])
DATA_UNIT = 10.0  # data are divided by this [data units]
# Leads over the teammates and spare slots are divided by these [slots] and clipped to -1..1. These
# are tables, because a look-up takes less time than a division.
_LEAD, _SPARE = 10, 20
_LEADS = np.arange(-_LEAD, _LEAD + 1) / _LEAD
_SPARES = np.arange(-_SPARE, _SPARE + 1) / _SPARE
_WIDTH = 5 * len(SCALES) + 1  # of the table of ``_around``: whole vector registers


class Vector:
    """The observation of one UAV as a vector.

    Attributes:
        layout: The grid, zone and nodes.
        shapes: The shapes of its arrays per row: one vector (F,).
    """

    version = 1  # of the encoding; weights trained with another version cannot be used

    def __init__(self, layout: Layout):
        self.layout = layout
        slots = np.arange(2 * layout.grid + 2)
        self._nearness = exp_of_each(-slots / SCALES[1])
        self._around = _around(slots)
        self._home = layout.zone_slots(layout.nodes)
        own_columns = _OWN + 2 * layout.grid + _NODE * len(layout.nodes)
        self.shapes = ((own_columns + 5 * (2 * len(SCALES) + 2) + MATES * _MATE,),)

    def encode(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """The observations of UAV ``uavs[r]`` in state ``missions[r]``: (R, F) float32.

        Where ``uavs[r]`` is -1, they are zeros.
        """
        out = np.empty((len(missions), *self.shapes[0]), np.float32)
        tables = self._home, self._nearness, self._around
        _encode(*states, missions, uavs, self.layout.grid, self.layout.nodes, *tables, out)
        return (out,)


def _around(slots: np.ndarray) -> np.ndarray:
    """How near a node is to the cells that the five actions lead to, divided by ``_NORMS``.

    Returns:
        (9 S, 16): a row for each number of slots to the node and for each of its directions, and a
        column for each action and scale; the last column is zero, so that a row fills whole
        vector registers.
    """
    table = np.zeros((len(slots), 3, 3, _WIDTH))
    near = exp_of_each(-slots / SCALES[:, None]) / _NORMS[:, None]
    for east, south in np.ndindex(3, 3):  # 0 for a node to the west or north, 2 for the opposite
        for action in range(5):
            nearer = (STEP_X[action], STEP_Y[action]) in ((east - 1, 0), (0, south - 1))
            after = slots
            if action != HOVER:
                after = slots + (-1 if nearer else 1)
            column = action * len(SCALES)
            # Some numbers of slots are impossible in some directions; these rows are not used.
            table[:, east, south, column : column + len(SCALES)] = near[
                :, after.clip(0, slots[-1])
            ].T
    return table.reshape(-1, _WIDTH)


@kernel
def _encode(
    missions, uavs, residual, rows_mission, rows_uav, grid, nodes, home, nearness, around, out
):
    count = len(nodes)
    least = np.empty(count, np.float32)
    columns = nodes[:, 0].astype(np.float32)
    rows = nodes[:, 1].astype(np.float32)
    units = np.empty(count)
    near, free = np.empty(_WIDTH, np.float32), np.empty(_WIDTH, np.float32)
    before = -1
    total = 0.0
    for row in range(len(rows_mission)):
        b = rows_mission[row]
        i = rows_uav[row]
        line = out[row]
        line[:] = 0.0
        if i < 0:
            continue
        mission = missions[b]
        team = uavs[b]
        data = residual[b]
        if b != before:  # the UAVs of a mission share what follows from its data
            before = b
            total = 0.0
            for k in range(count):
                total += data[k]
                units[k] = data[k] / DATA_UNIT
        me = team[i]
        x = np.int64(me[column.X])
        y = np.int64(me[column.Y])
        at = _own(mission, team, i, total / (count * DATA_UNIT), line)
        line[at + x] = 1.0
        line[at + grid + y] = 1.0
        at += 2 * grid
        nearest_teammates(team, i, columns, rows, least)
        near[:] = 0.0
        free[:] = 0.0
        for k in range(count):
            dx = nodes[k, 0] - x
            dy = nodes[k, 1] - y
            slots = abs(dx) + abs(dy)
            lead = np.int64(least[k]) - slots
            line[at + k] = units[k]
            line[at + count + k] = units[k] * nearness[slots]
            line[at + 2 * count + k] = _LEADS[min(max(lead, -_LEAD), _LEAD) + _LEAD]
            line[at + 3 * count + k] = spare_slots(me, home[k], slots)
            if data[k] == 0.0:
                continue
            # data that no teammate is nearer to
            share = data[k] if lead >= 0 else np.float32(0.3 * data[k])
            entry = (slots * 3 + (dx > 0) - (dx < 0) + 1) * 3 + (dy > 0) - (dy < 0) + 1
            for j in range(_WIDTH):
                near[j] += data[k] * around[entry, j]
                free[j] += share * around[entry, j]
        at = _actions(team, i, near, free, line, at + _NODE * count)
        _mates(team, i, line, at)


@inlined
def _own(mission, team, i, mean, line):
    """Write the UAV's own state; returns the index of the next part."""
    me = team[i]
    active = 0
    for j in range(len(team)):
        active += team[j, column.ACTIVE]
    battery, needed, home = me[column.BATTERY], me[column.NEEDED], me[column.HOME]
    start, complete = mission[column.CHARGE_START], mission[column.CHARGE_COMPLETE]
    slack = battery - 1 - home
    line[0] = battery / 100.0
    line[1] = needed / 100.0
    line[2] = me[column.LATCH]
    line[3] = me[column.MUST_CHARGE]
    line[4] = start / 100.0
    line[5] = complete / 100.0
    line[6] = home / 30.0
    line[7] = min(slack, 50) / 50.0
    line[8] = min(max(slack, 0), 8) / 8.0
    line[9] = (battery - start) / 50.0
    line[10] = min(max(battery - start, -5), 10) / 10.0
    line[11] = min(max(needed - complete, -20), 60) / 40.0
    line[12] = min(needed, 10) / 10.0
    line[13] = active - 1.0
    line[14] = active == 1
    line[15] = mean
    return _OWN


@inlined
def spare_slots(me, home, slots):
    """The spare slots / 20, within -1..1, if the UAV visits a node and then charges if it must."""
    left = me[column.BATTERY] - 1 - home if me[column.MUST_CHARGE] else me[column.NEEDED]
    return _SPARES[min(max(left - slots, -_SPARE), _SPARE) + _SPARE]


@inlined
def nearest_teammates(team, i, columns, rows, least):
    """Write the slots from each node to the flying teammate of UAV ``i`` that is nearest to it.

    All are float32, in which these numbers are exact: so a vector register holds eight nodes.
    """
    least[:] = 10_000
    for j in range(len(team)):
        if j != i and team[j, column.ACTIVE] and not team[j, column.CHARGING]:
            x = np.float32(team[j, column.X])
            y = np.float32(team[j, column.Y])
            for k in range(len(least)):
                least[k] = min(least[k], abs(columns[k] - x) + abs(rows[k] - y))


@inlined
def _actions(team, i, near, free, line, at):
    """Write per action the mask, the teammates near the cell it leads to, and the data near it."""
    me = team[i]
    scales = len(SCALES)
    for action in range(5):
        x = me[column.X] + STEP_X[action]
        y = me[column.Y] + STEP_Y[action]
        line[at] = me[column.MASK] >> action & 1
        for j in range(len(team)):
            if j != i and team[j, column.ACTIVE]:
                slots = abs(team[j, column.X] - x) + abs(team[j, column.Y] - y)
                if slots <= 1:
                    line[at + 1] += 1.0 if slots == 0 else 0.3
        for s in range(scales):
            line[at + 2 + s] = near[action * scales + s]
            line[at + 2 + scales + s] = free[action * scales + s]
        at += 2 + 2 * scales
    return at


@inlined
def _mates(team, i, line, at):
    """Write the nearest active teammates, relative to UAV ``i``."""
    x = np.int64(team[i, column.X])
    y = np.int64(team[i, column.Y])
    last_slots, last = -1, -1
    for _ in range(MATES):
        nearest = -1
        least = 10_000
        for j in range(len(team)):
            slots = abs(team[j, column.X] - x) + abs(team[j, column.Y] - y)
            after = slots > last_slots or (slots == last_slots and j > last)
            if j != i and team[j, column.ACTIVE] and after and slots < least:
                nearest = j
                least = slots
        if nearest < 0:
            return
        last_slots = least
        last = nearest
        mate = team[nearest]
        dx = mate[column.X] - x
        dy = mate[column.Y] - y
        line[at] = 1.0
        line[at + 1] = dx / 30.0
        line[at + 2] = dy / 30.0
        line[at + 3] = min(max(dx, -3), 3) / 3.0
        line[at + 4] = min(max(dy, -3), 3) / 3.0
        line[at + 5] = mate[column.BATTERY] / 100.0
        line[at + 6] = mate[column.NEEDED] / 100.0
        line[at + 7] = mate[column.CHARGING]
        line[at + 8] = mate[column.MUST_CHARGE]
        line[at + 9] = mate[column.X] / 30.0
        line[at + 10] = mate[column.Y] / 30.0
        at += _MATE
