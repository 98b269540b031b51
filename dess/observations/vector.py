"""Observation (b): a compact vector, with more information than the paper's observation.

It adds the slots until the quota is filled, the charging latch, C_S and C_C, the slots to the
parking cell, which UAVs must charge, and which cells around are occupied. Every node has its own
entry, so a network is valid for one layout only. The number of teammates may vary: the two nearest
are described one by one, and all of them affect the data that is left for this UAV.
"""

import numpy as np

from dess.code.kernels import kernel
from dess.observations.states import (
    ACTIVE,
    BATTERY,
    CHARGE_COMPLETE,
    CHARGE_START,
    CHARGING,
    HOME,
    LATCH,
    MASK,
    MUST_CHARGE,
    NEEDED,
    CompactStates,
    Layout,
    X,
    Y,
)
from dess.state import STEP_X, STEP_Y

MATES = 2  # teammates described one by one, the nearest first
_OWN = 16
_NODE = 4
_MATE = 11
# The nearness of a node to a cell is exp(-slots / scale), for each scale [slots]. The sums of data
# times nearness are divided by these divisors.
SCALES = np.array([1.2, 4.0, 12.0])
_NORMS = np.array([10.0, 25.0, 80.0])
DATA_UNIT = 10.0  # data are divided by this [data units]
_FAR = 10.0  # leads over the teammates are divided by this [slots]


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
        self._nearness = np.exp(-slots / SCALES[:, None])
        self._home = layout.zone_slots(layout.nodes)
        own = _OWN + 2 * layout.grid + _NODE * len(layout.nodes)
        self.shapes = ((own + 5 * (2 * len(SCALES) + 2) + MATES * _MATE,),)

    def encode(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """The observations of UAV ``uavs[r]`` in state ``missions[r]``: (R, F) float32."""
        out = np.zeros((len(missions), *self.shapes[0]), np.float32)
        grid, nodes = self.layout.grid, self.layout.nodes
        _encode(states, missions, uavs, grid, nodes, self._home, self._nearness, out)
        return (out,)


@kernel
def _encode(states, rows_mission, rows_uav, grid, nodes, home, nearness, out):
    count = len(nodes)
    free = np.empty(count, np.float32)  # data at nodes that no teammate is nearer to
    for row in range(len(rows_mission)):
        mission = states.missions[rows_mission[row]]
        team = states.uavs[rows_mission[row]]
        data = states.residual[rows_mission[row]]
        i = rows_uav[row]
        me, line = team[i], out[row]
        at = _own(mission, team, i, data, line)
        line[at + me[X]] = 1.0
        line[at + grid + me[Y]] = 1.0
        at += 2 * grid
        for k in range(count):
            slots = abs(nodes[k, 0] - me[X]) + abs(nodes[k, 1] - me[Y])
            lead = lead_of(team, i, nodes[k, 0], nodes[k, 1], slots)
            free[k] = data[k] if lead >= 0 else 0.3 * data[k]
            line[at + k] = data[k] / DATA_UNIT
            line[at + count + k] = data[k] / DATA_UNIT * nearness[1, slots]
            line[at + 2 * count + k] = min(max(lead / _FAR, -1.0), 1.0)
            line[at + 3 * count + k] = spare_slots(me, home[k], slots)
        at += _NODE * count
        at = _actions(me, team, i, data, free, nodes, nearness, line, at)
        _mates(team, i, line, at)


@kernel
def _own(mission, team, i, data, line):
    """Write the UAV's own state; returns the index of the next part."""
    me = team[i]
    active = 0
    for j in range(len(team)):
        active += team[j, ACTIVE]
    total = 0.0
    for k in range(len(data)):
        total += data[k]
    slack = me[BATTERY] - 1 - me[HOME]
    line[0] = me[BATTERY] / 100.0
    line[1] = me[NEEDED] / 100.0
    line[2] = me[LATCH]
    line[3] = me[MUST_CHARGE]
    line[4] = mission[CHARGE_START] / 100.0
    line[5] = mission[CHARGE_COMPLETE] / 100.0
    line[6] = me[HOME] / 30.0
    line[7] = min(slack, 50) / 50.0
    line[8] = min(max(slack, 0), 8) / 8.0
    line[9] = (me[BATTERY] - mission[CHARGE_START]) / 50.0
    line[10] = min(max(me[BATTERY] - mission[CHARGE_START], -5), 10) / 10.0
    line[11] = min(max(me[NEEDED] - mission[CHARGE_COMPLETE], -20), 60) / 40.0
    line[12] = min(me[NEEDED], 10) / 10.0
    line[13] = active - 1.0
    line[14] = active == 1
    line[15] = total / (len(data) * DATA_UNIT)
    return _OWN


@kernel
def spare_slots(me, home, slots):
    """The spare slots / 20, within -1..1, if the UAV visits a node and then charges if it must."""
    left = me[BATTERY] - 1 - home if me[MUST_CHARGE] else me[NEEDED]
    return min(max((left - slots) / 20.0, -1.0), 1.0)


@kernel
def lead_of(team, i, x, y, slots):
    """Slots by which UAV ``i`` is nearer to a cell than the nearest flying teammate."""
    least = 10_000
    for j in range(len(team)):
        if j != i and team[j, ACTIVE] and not team[j, CHARGING]:
            least = min(least, abs(team[j, X] - x) + abs(team[j, Y] - y))
    return least - slots


@kernel
def _actions(me, team, i, data, free, nodes, nearness, line, at):
    """Write per action the mask, the teammates near the cell it leads to, and the data near it."""
    scales = len(nearness)
    for action in range(5):
        x, y = me[X] + STEP_X[action], me[Y] + STEP_Y[action]
        line[at] = me[MASK] >> action & 1
        for j in range(len(team)):
            if j != i and team[j, ACTIVE]:
                slots = abs(team[j, X] - x) + abs(team[j, Y] - y)
                if slots <= 1:
                    line[at + 1] += 1.0 if slots == 0 else 0.3
        for k in range(len(nodes)):
            slots = abs(nodes[k, 0] - x) + abs(nodes[k, 1] - y)
            for s in range(scales):
                near = nearness[s, slots] / _NORMS[s]
                line[at + 2 + s] += data[k] * near
                line[at + 2 + scales + s] += free[k] * near
        at += 2 + 2 * scales
    return at


@kernel
def _mates(team, i, line, at):
    """Write the nearest active teammates, relative to UAV ``i``."""
    last_slots, last = -1, -1
    for _ in range(MATES):
        nearest, least = -1, 10_000
        for j in range(len(team)):
            slots = abs(team[j, X] - team[i, X]) + abs(team[j, Y] - team[i, Y])
            after = slots > last_slots or (slots == last_slots and j > last)
            if j != i and team[j, ACTIVE] and after and slots < least:
                nearest, least = j, slots
        if nearest < 0:
            return
        last_slots, last = least, nearest
        mate = team[nearest]
        line[at] = 1.0
        line[at + 1] = (mate[X] - team[i, X]) / 30.0
        line[at + 2] = (mate[Y] - team[i, Y]) / 30.0
        line[at + 3] = min(max(mate[X] - team[i, X], -3), 3) / 3.0
        line[at + 4] = min(max(mate[Y] - team[i, Y], -3), 3) / 3.0
        line[at + 5] = mate[BATTERY] / 100.0
        line[at + 6] = mate[NEEDED] / 100.0
        line[at + 7] = mate[CHARGING]
        line[at + 8] = mate[MUST_CHARGE]
        line[at + 9] = mate[X] / 30.0
        line[at + 10] = mate[Y] / 30.0
        at += _MATE
