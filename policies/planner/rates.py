"""The mean rates at which UAVs collect data, in tables that the planner reads.

tables = load_rates(view.world, radio)
tables.candidates[row, 0]      # the node with the highest rate in a step

A step is an action together with the cell that it leads to.
"""

from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from dess.base.files.memory import check_memory
from dess.base.kernels import kernel
from dess.model.channel import World, efficiency
from dess.model.state import STEP_X, STEP_Y, mission_part
from dess.physics.chart import Chart

# Nodes kept per step. The farther ones give next to no data, and nothing is planned with them.
_RANKS = 12
# The Gauss-Hermite rule of 16 points for the mean over the shadowing: its positive points and their
# weights. A library would compute them, with other last bits on another machine.
_RULE = (
    (0.3867606045005573, 0.28656852123801213),
    (1.1638291005549648, 0.1583383727509496),
    (1.9519803457163334, 0.047284752354014026),
    (2.7602450476307014, 0.007266937601184733),
    (3.600873624171548, 0.0005259849265739092),
    (4.492955302520011, 1.5300032162487272e-05),
    (5.472225705949343, 1.3094732162868227e-07),
    (6.630878198393129, 1.4978147231618397e-10),
)


# What the rates are computed from, beside the world.
RATES_PART = mission_part(
    *("communication_slot_length", "shadowing_deviation", "slowest"),
    *("max_rate", "steps", "step_snr", "step_rate"),
)

# A node that a UAV may serve in a slot, and its mean rate [data units per communication slot].
CANDIDATE = np.dtype([("node", np.int32), ("rate", np.float32)])


class Rates(NamedTuple):
    """What a UAV may collect in a slot.

    Attributes:
        candidates: (5 * W * H, C) ``CANDIDATE`` records of each step, in descending order of the
            rate; rows as in ``World.order``.
        chart: The zones, the no-fly cells and the ways between cells.
    """

    candidates: np.ndarray
    chart: Chart


def load_rates(world: World, radio: bytes) -> Rates:
    """The tables of missions in a world.

    Args:
        world: The nodes and the tables of the channel.
        radio: Their ``RATES_PART``.
    """
    rows, columns = world.chart.zones.shape
    nodes, snr = world.nodes.tobytes(), world.mean_snr.tobytes()
    candidates = _rank_nodes(nodes, snr, (columns, rows), world.means.shape[2], radio)
    return Rates(candidates, world.chart)


@lru_cache(maxsize=8)
def _rank_nodes(
    nodes: bytes, mean_snr: bytes, size: tuple[int, int], m: int, radio: bytes
) -> np.ndarray:
    cells = np.frombuffer(nodes, np.int64).reshape(-1, 2)
    snr = np.frombuffer(mean_snr)
    columns, rows = size
    longest = max(size)
    constants = np.frombuffer(radio, RATES_PART)[0]
    rates = _mean_rate(snr.reshape(longest, -1), constants)
    kept = min(_RANKS, len(cells))
    slowest = int(constants["slowest"])
    phases = slowest * (slowest + 1) // 2
    check_memory(
        f"planner: a grid of {columns:,} x {rows:,} cells",
        5 * phases * columns * rows * kept * CANDIDATE.itemsize,
        "a smaller grid, or fewer nodes or slots per cell",
    )
    table = np.empty((phases, 5, rows, columns, kept), CANDIDATE)
    parts = (rates.shape[1] - 1) // (longest - 1)
    for s in range(1, slowest + 1):
        part = parts // (m * s) if parts % (m * s) == 0 else 0
        for stage, action, y in product(range(s), range(5), range(rows)):
            # how far it still has to fly in the communication slots of this part of its move
            ahead = part * (m * (s - stage) - 1 - np.arange(m))
            mean = _mean_rates_of_steps(rates, parts, cells, action, y, ahead, columns)
            best = np.argsort(-mean, axis=1, kind="stable")[:, :kept]
            row = table[s * (s - 1) // 2 + stage, action, y]
            row["node"] = best
            row["rate"] = np.take_along_axis(mean, best, 1)
    return table.reshape(-1, kept)


def _mean_rates_of_steps(
    rates: np.ndarray, parts: int, cells: np.ndarray, action: int, y: int, ahead: np.ndarray,
    columns: int,
) -> np.ndarray:  # fmt: skip
    """The (W, K) mean rates of the nodes during an action that leads to the cells of a row."""
    dx, dy = np.broadcast_arrays(np.arange(columns)[:, None] - cells[:, 0], y - cells[:, 1])
    step = STEP_X[action]
    along = dx
    across = dy
    if STEP_Y[action] != 0:
        step = STEP_Y[action]
        along = dy
        across = dx
    farthest = rates.shape[1] - 1  # beyond it are moves that begin off the grid
    total = np.zeros(across.shape)
    for places in ahead:
        fine = np.abs(parts * along - step * places)
        total += rates[np.abs(across), np.minimum(fine, farthest)]
    return total / len(ahead)


def _mean_rate(snr: np.ndarray, constants: np.void) -> np.ndarray:
    """The mean of the rate (eq. 9) over the shadowing, for mean SNRs [dB].

    It is computed once for each SNR, so that nodes at equal distances have equal rates.
    """
    distinct, places = np.unique(snr, return_inverse=True)
    rates = np.zeros(len(distinct))
    _add_rates(distinct, constants, rates)
    return rates[places].reshape(snr.shape)


@kernel
def _add_rates(snr, radio, rates):
    """Add the mean rate at each mean SNR [dB] to ``rates``."""
    length = radio.communication_slot_length
    for number in range(len(snr)):
        for point, weight in _RULE:
            for deviate in (-point, point):
                level = snr[number] + radio.shadowing_deviation * deviate
                rates[number] += length * weight * efficiency(radio, level)
