"""The mean rates at which UAVs collect data, in tables that the planner reads.

tables = rates_of(view)
tables.ranks[place, 0]      # the node with the highest mean SNR at a place

A place is a point on the way between neighbouring cells at which a communication slot may be.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from dess.code.memory import check_memory
from dess.sections.wind import surcharges
from dess.view import View

# Nodes kept per place. The farther ones give next to no data, and nothing is planned with them.
_RANKS = 32
# Points of the Gauss-Hermite rule for the mean over the shadowing.
_POINTS = 16


# A node that a UAV may serve at a place, and its mean rate [data units per communication slot].
CANDIDATE = np.dtype([("node", np.int64), ("rate", np.float64)])


class Rates(NamedTuple):
    """What a UAV may collect at each place, and what its moves cost.

    Attributes:
        candidates: (2 * M * L, C) ``CANDIDATE`` records of each place, in descending order of the
            mean SNR. The first M * L places are those on the M rows of cells, counted along the
            row; the others those on the columns.
        extra: (4, M, M) surcharges of moves in the wind [%], by action and the cell that it leads
            to; (0, 0, 0) where there is no wind.
        parts: Places per cell.
    """

    candidates: np.ndarray
    extra: np.ndarray
    parts: int


def rates_of(view: View) -> Rates:
    """The tables of the sea that a view is about."""
    mission, snr = view.state.missions[0], view.world.mean_snr
    candidates = _candidates(
        view.world.nodes.tobytes(),
        snr.tobytes(),
        len(snr),
        float(mission["communication_slot_length"]),
        float(mission["shadowing_deviation"]),
    )
    extra = np.zeros((0, 0, 0), np.int64)
    if mission["wind_most"] > 0:
        wind = (mission[name].item() for name in ("wind_x", "wind_y", "wind_gusts", "wind_seed"))
        extra = surcharges(len(snr), *wind).copy()
    return Rates(candidates, extra, (snr.shape[1] - 1) // (len(snr) - 1))


@lru_cache(maxsize=8)
def _candidates(
    nodes: bytes, mean_snr: bytes, grid: int, length: float, deviation: float
) -> np.ndarray:
    cells = np.frombuffer(nodes, np.int64).reshape(-1, 2)
    snr = np.frombuffer(mean_snr).reshape(grid, -1)
    mean_rate = _mean_rate(snr, length, deviation)
    parts, places = (snr.shape[1] - 1) // (grid - 1), snr.shape[1]
    kept = min(_RANKS, len(cells))
    check_memory(
        f"planner: a grid of {grid:,} cells",
        2 * grid * places * kept * CANDIDATE.itemsize,
        "a smaller grid, or fewer nodes or communication slots",
    )
    table = np.empty((2, grid, places, kept), CANDIDATE)
    for axis in range(2):
        along, across = cells[:, axis], cells[:, 1 - axis]
        fine = np.abs(np.arange(places)[:, None] - parts * along)
        for line in range(grid):
            coarse = np.broadcast_to(np.abs(line - across), fine.shape)
            best = np.argsort(-snr[coarse, fine], axis=1, kind="stable")[:, :kept]
            table["node"][axis, line] = best
            table["rate"][axis, line] = np.take_along_axis(mean_rate[coarse, fine], best, 1)
    return table.reshape(-1, kept)


def _mean_rate(snr: np.ndarray, length: float, deviation: float) -> np.ndarray:
    """The mean of the rate (eq. 9) over the shadowing, for mean SNRs [dB]."""
    points, weights = np.polynomial.hermite_e.hermegauss(_POINTS)
    weights /= weights.sum()
    rates = np.empty_like(snr)
    for row, levels in enumerate(snr):  # all rows at once would take gigabytes on a large grid
        levels = levels[:, None] + deviation * points
        rates[row] = length * np.log2(1.0 + 10.0 ** (levels / 10.0)) @ weights
    return rates
