"""The paper's observation (a): a local and a pooled global map, both centred on the UAV.

It follows Section III-D, eq. 19-22. Since few cells are not zero, both maps are written directly
from the zone, the nodes and the UAVs, without building the centred map of eq. 19.
"""

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates, Layout

# The layers of a map: the charging zone, residual data / 20 [data units], remaining flying time
# of the active UAVs / 100 [%], and their operational status.
ZONE, DATA, FLYING_TIME, STATUS = range(4)
LAYERS = 4
DATA_SCALE = 20.0  # the most that a node starts with (Table II)
BATTERY_SCALE = 100.0
# Widths of the paper's local map and of a cell of its global map [cells] (l, g).
CROP, POOL = 17, 3


class Maps:
    """Encodes states as the paper's local and global maps and the UAV's own flying time.

    The M x M map is moved into one of ``2 M - 1`` cells a side, with the UAV in the middle and
    zeros outside. The local map is the ``CROP`` x ``CROP`` cells in the middle. A cell of the
    global map is the mean of ``POOL`` x ``POOL`` cells; incomplete cells at the south and east
    edges are left out. Maps are indexed layer, y, x; the layers are ``ZONE`` to ``STATUS``.

    Attributes:
        layout: The grid, the zone and the nodes.
        shapes: The shapes of one row of each array that ``encode`` returns.
    """

    version = 1  # of the encoding; weights trained with another version cannot be used

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        width = (2 * layout.grid - 1) // POOL
        self.shapes = ((LAYERS, CROP, CROP), (LAYERS, width, width), (1,))

    def encode(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """The observations of UAV ``uavs[r]`` in state ``missions[r]``, for every r.

        Args:
            states: S missions at one moment each.
            missions: (R,) indices into the states.
            uavs: (R,) indices of the UAVs; where it is -1, the observation is zeros.

        Returns:
            The local maps (R, 4, l, l), the global maps (R, 4, w, w) and the own batteries
            / 100 (R, 1), all float32.
        """
        local, far, scalars = (np.zeros((len(missions), *s), np.float32) for s in self.shapes)
        rows = np.asarray(missions, np.int64), np.asarray(uavs, np.int64)
        _encode(states, self.layout, *rows, local, far, scalars)
        return local, far, scalars


@kernel
def _encode(states, layout, missions, uavs, local, far, own):
    """Write the maps of all rows into zeroed arrays."""
    zone, nodes = layout.zone, layout.nodes
    centre = layout.grid - 1
    middle_cell = CROP // 2
    for r in range(len(missions)):
        if uavs[r] < 0:
            continue
        team = states.uavs[missions[r]]
        residual = states.residual[missions[r]]
        x, y = team[uavs[r], column.X], team[uavs[r], column.Y]
        own[r, 0] = team[uavs[r], column.BATTERY] / np.float32(BATTERY_SCALE)
        # All positions below are relative to the UAV's cell.
        _mark_zone(local[r, ZONE], middle_cell, 1, zone[0] - x, zone[1] - y, zone[2], zone[3])
        _mark_zone(far[r, ZONE], centre, POOL, zone[0] - x, zone[1] - y, zone[2], zone[3])
        for k in range(len(nodes)):
            data = residual[k] / np.float32(DATA_SCALE)
            _add(local[r], far[r], centre, DATA, nodes[k, 0] - x, nodes[k, 1] - y, data)
        for i in range(len(team)):
            if team[i, column.ACTIVE]:
                dx = team[i, column.X] - x
                dy = team[i, column.Y] - y
                battery = team[i, column.BATTERY] / np.float32(BATTERY_SCALE)
                _add(local[r], far[r], centre, FLYING_TIME, dx, dy, battery)
                _add(local[r], far[r], centre, STATUS, dx, dy, np.float32(1))


@inlined
def _add(local, far, centre, layer, dx, dy, value):
    """Add a value at a cell to a layer of both maps, if the cell lies in them."""
    x = CROP // 2 + dx
    y = CROP // 2 + dy
    if 0 <= x < CROP and 0 <= y < CROP:
        local[layer, y, x] += value
    x = (centre + dx) // POOL
    y = (centre + dy) // POOL
    if x < far.shape[2] and y < far.shape[1]:
        far[layer, y, x] += value / np.float32(POOL * POOL)


@inlined
def _mark_zone(layer, centre, pool, dx, dy, width, height):
    """Set each cell of a layer to the share that the zone covers."""
    end = len(layer) * pool
    left = max(centre + dx, 0)
    right = min(centre + dx + width, end)
    top = max(centre + dy, 0)
    bottom = min(centre + dy + height, end)
    for y in range(top, bottom):
        for x in range(left, right):
            layer[y // pool, x // pool] += np.float32(1) / np.float32(pool * pool)
