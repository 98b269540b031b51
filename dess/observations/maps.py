"""The paper's observation (a): a local and a pooled global map, both centred on the UAV.

It follows Section III-D, eq. 19-22. Since few cells are not zero, both maps are written directly
from the zone, the nodes and the UAVs, without building the centred map of eq. 19.
"""

import numpy as np

from dess.code.kernels import inlined, kernel
from dess.errors import InputError
from dess.observations import states as column
from dess.observations.states import CompactStates, Layout

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
    zeros outside. The local map is the ``crop`` x ``crop`` cells in the middle. A cell of the
    global map is the mean of ``pool`` x ``pool`` cells; incomplete cells at the south and east
    edges are left out. Maps are indexed layer, y, x; the layers are ``ZONE`` to ``STATUS``.

    Attributes:
        layout: The grid, the zone and the nodes.
        crop: Width of the local map [cells] (l).
        pool: Cells a side that make one of the global map (g).
        width: Width of the global map, ``(2 M - 1) // pool``.
    """

    version = 1  # of the encoding; weights trained with another version cannot be used

    def __init__(self, layout: Layout, crop: int = CROP, pool: int = POOL) -> None:
        """Make an encoder for one layout.

        Raises:
            InputError: If ``crop`` is not an odd number of 1 to ``2 M - 1``, or ``pool`` is not a
                number of 1 to ``2 M - 1``.
        """
        centred = 2 * layout.grid - 1
        if not (1 <= crop <= centred and crop % 2):
            raise InputError(f"crop: {crop} is no such number; allowed: an odd one 1..{centred}")
        if not 1 <= pool <= centred:
            raise InputError(f"pool: {pool} is out of range; allowed: 1..{centred}")
        self.layout = layout
        self.crop = crop
        self.pool = pool
        self.width = centred // pool

    @property
    def shapes(self) -> tuple[tuple[int, ...], ...]:
        """The shapes of one row of each array that ``encode`` returns."""
        return (LAYERS, self.crop, self.crop), (LAYERS, self.width, self.width), (1,)

    def encode(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """The observations of UAV ``uavs[r]`` in state ``missions[r]``, for every r.

        Args:
            states: S missions at one moment each.
            missions: (R,) indices into the states.
            uavs: (R,) indices of the UAVs; where it is -1, the observation is zeros.

        Returns:
            The local maps (R, 4, crop, crop), the global maps (R, 4, width, width) and the own
            batteries / 100 (R, 1), all float32.
        """
        local, far, own = (np.zeros((len(missions), *s), np.float32) for s in self.shapes)
        rows = np.asarray(missions, np.int64), np.asarray(uavs, np.int64)
        _encode(states, self.layout, *rows, self.pool, local, far, own)
        return local, far, own


@kernel
def _encode(states, layout, missions, uavs, pool, local, far, own):
    """Write the maps of all rows into zeroed arrays."""
    zone, nodes = layout.zone, layout.nodes
    centre = layout.grid - 1
    middle = local.shape[2] // 2
    for r in range(len(missions)):
        if uavs[r] < 0:
            continue
        team, residual = states.uavs[missions[r]], states.residual[missions[r]]
        x, y = team[uavs[r], column.X], team[uavs[r], column.Y]
        own[r, 0] = team[uavs[r], column.BATTERY] / np.float32(BATTERY_SCALE)
        # All positions below are relative to the UAV's cell.
        _mark_zone(local[r, ZONE], middle, 1, zone[0] - x, zone[1] - y, zone[2], zone[3])
        _mark_zone(far[r, ZONE], centre, pool, zone[0] - x, zone[1] - y, zone[2], zone[3])
        for k in range(len(nodes)):
            data = residual[k] / np.float32(DATA_SCALE)
            _add(local[r, DATA], middle, 1, nodes[k, 0] - x, nodes[k, 1] - y, data)
            _add(far[r, DATA], centre, pool, nodes[k, 0] - x, nodes[k, 1] - y, data)
        for i in range(len(team)):
            if not team[i, column.ACTIVE]:
                continue
            dx, dy = team[i, column.X] - x, team[i, column.Y] - y
            battery = team[i, column.BATTERY] / np.float32(BATTERY_SCALE)
            _add(local[r, FLYING_TIME], middle, 1, dx, dy, battery)
            _add(far[r, FLYING_TIME], centre, pool, dx, dy, battery)
            _add(local[r, STATUS], middle, 1, dx, dy, np.float32(1))
            _add(far[r, STATUS], centre, pool, dx, dy, np.float32(1))


@inlined
def _add(layer, centre, pool, dx, dy, value):
    """Add a value at a cell to a pooled layer, if the cell lies in the layer."""
    x, y = centre + dx, centre + dy
    end = len(layer) * pool
    if 0 <= x < end and 0 <= y < end:
        layer[y // pool, x // pool] += value / np.float32(pool * pool)


@inlined
def _mark_zone(layer, centre, pool, dx, dy, width, height):
    """Set each cell of a layer to the share that the zone covers."""
    end = len(layer) * pool
    left, right = max(centre + dx, 0), min(centre + dx + width, end)
    top, bottom = max(centre + dy, 0), min(centre + dy + height, end)
    for y in range(top, bottom):
        for x in range(left, right):
            layer[y // pool, x // pool] += np.float32(1) / np.float32(pool * pool)
