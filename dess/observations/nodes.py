"""Observation (b) with a row per node: the vector, and the position of every node from the UAV.

A network that applies the same layers to all nodes learns only once what, for example, a node five
slots to the east is worth, and not once for every node.
"""

import numpy as np

from dess.code.kernels import kernel
from dess.code.portable import exp
from dess.observations import states as column
from dess.observations.states import CompactStates, Layout
from dess.observations.vector import DATA_UNIT, SCALES, Vector, nearest_teammates, spare_slots

NODE = 22


class Nodes:
    """The observation of one UAV as a vector and one row per node.

    Attributes:
        layout: The grid, zone and nodes.
        shapes: The shapes of its arrays per row: (F,) and (K, 22).
    """

    version = 1  # of the encoding; weights trained with another version cannot be used

    def __init__(self, layout: Layout):
        self.layout, self._vector = layout, Vector(layout)
        self.shapes = (*self._vector.shapes, (len(layout.nodes), NODE))
        slots = np.arange(2 * layout.grid + 2)
        self._nearness = exp(-slots / SCALES[:, None])
        between = np.abs(layout.nodes[:, None] - layout.nodes[None]).sum(2)
        self._around = np.stack([exp(-between / 6.0) / 25.0, exp(-between / 12.0) / 80.0])
        self._home = layout.zone_slots(layout.nodes)

    def encode(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """The observations of UAV ``uavs[r]`` in state ``missions[r]``, as float32.

        Where ``uavs[r]`` is -1, they are zeros.

        Returns:
            (R, F) vectors and (R, K, 22) nodes.
        """
        out = np.zeros((len(missions), *self.shapes[1]), np.float32)
        nodes = self.layout.nodes
        _encode(states, missions, uavs, nodes, self._nearness, self._around, self._home, out)
        return (*self._vector.encode(states, missions, uavs), out)


@kernel
def _encode(states, rows_mission, rows_uav, nodes, nearness, around, home, out):
    count = len(nodes)
    least = np.empty(count, np.float32)
    columns, rows = nodes[:, 0].astype(np.float32), nodes[:, 1].astype(np.float32)
    for row in range(len(rows_mission)):
        team = states.uavs[rows_mission[row]]
        data = states.residual[rows_mission[row]]
        i = rows_uav[row]
        if i < 0:
            continue
        me = team[i]
        nearest_teammates(team, i, columns, rows, least)
        for k in range(count):
            line = out[row, k]
            dx, dy = nodes[k, 0] - me[column.X], nodes[k, 1] - me[column.Y]
            slots = abs(dx) + abs(dy)
            lead = np.int64(least[k]) - slots
            units = data[k] / DATA_UNIT
            line[0] = units
            line[1] = units * nearness[0, slots]
            line[2] = units * nearness[1, slots]
            line[3] = dx / 16.0
            line[4] = dy / 16.0
            line[5] = slots / 30.0
            line[6] = nearness[0, slots]
            line[7] = nearness[1, slots]
            line[8] = nearness[2, slots]
            line[9] = min(max(lead / 10.0, -1.0), 1.0)
            line[10] = min(lead + slots, 40) / 30.0
            line[11] = home[k] / 30.0
            line[12] = spare_slots(me, home[k], slots)
            line[13] = line[12] >= 0.0
            line[14] = dx > 0
            line[15] = dx < 0
            line[16] = dy > 0
            line[17] = dy < 0
            for j in range(count):
                line[18] += data[j] * around[0, k, j]
                line[19] += data[j] * around[1, k, j]
            line[20] = nodes[k, 0] / 30.0
            line[21] = nodes[k, 1] / 30.0
