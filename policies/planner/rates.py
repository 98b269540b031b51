"""The mean rates at which UAVs collect data, in tables that the planner reads.

tables = rates_of(view)
tables.ranks[place, 0]      # the node with the highest mean SNR at a place

A place is a point on the way between neighbouring cells at which a communication slot may be.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from dess.code.memory import check_memory
from dess.sea.chart import Chart
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
        candidates: (P, C) ``CANDIDATE`` records of each place, in descending order of the mean SNR.
            The first places are those on the H rows of cells, counted along the row; the others
            those on the W columns.
        extra: (4, H, W) surcharges of moves in the wind [%], by action and the cell that it leads
            to; (0, 0, 0) where there is no wind.
        parts: Places per cell.
        chart: The zones, the no-fly cells and the ways between cells.
    """

    candidates: np.ndarray
    extra: np.ndarray
    parts: int
    chart: Chart


def rates_of(view: View) -> Rates:
    """The tables of the sea that a view is about."""
    mission, snr, chart = view.state.missions[0], view.world.mean_snr, view.world.chart
    rows, columns = chart.zones.shape
    candidates = _candidates(
        view.world.nodes.tobytes(),
        snr.tobytes(),
        (columns, rows),
        float(mission["communication_slot_length"]),
        float(mission["shadowing_deviation"]),
    )
    extra = np.zeros((0, 0, 0), np.int64)
    if mission["wind_most"] > 0:
        wind = (mission[name].item() for name in ("wind_x", "wind_y", "wind_gusts", "wind_seed"))
        extra = surcharges((columns, rows), *wind).copy()
    return Rates(candidates, extra, (snr.shape[1] - 1) // (len(snr) - 1), chart)


@lru_cache(maxsize=8)
def _candidates(
    nodes: bytes, mean_snr: bytes, size: tuple[int, int], length: float, deviation: float
) -> np.ndarray:
    cells = np.frombuffer(nodes, np.int64).reshape(-1, 2)
    snr = np.frombuffer(mean_snr).reshape(max(size), -1)
    mean_rate = _mean_rate(snr, length, deviation)
    parts, kept = (snr.shape[1] - 1) // (len(snr) - 1), min(_RANKS, len(cells))
    places = [parts * (cells - 1) + 1 for cells in size]  # of a row, and of a column
    count = places[0] * size[1] + places[1] * size[0]
    check_memory(
        f"planner: a grid of {size[0]:,} x {size[1]:,} cells",
        count * kept * CANDIDATE.itemsize,
        "a smaller grid, or fewer nodes or communication slots",
    )
    table, first = np.empty((count, kept), CANDIDATE), 0
    for axis in range(2):
        along, across = cells[:, axis], cells[:, 1 - axis]
        fine = np.abs(np.arange(places[axis])[:, None] - parts * along)
        for line in range(size[1 - axis]):
            coarse, part = np.broadcast_to(np.abs(line - across), fine.shape), table[first:]
            best = np.argsort(-snr[coarse, fine], axis=1, kind="stable")[:, :kept]
            part["node"][: len(fine)] = best
            part["rate"][: len(fine)] = np.take_along_axis(mean_rate[coarse, fine], best, 1)
            first += len(fine)
    return table


def _mean_rate(snr: np.ndarray, length: float, deviation: float) -> np.ndarray:
    """The mean of the rate (eq. 9) over the shadowing, for mean SNRs [dB]."""
    points, weights = np.polynomial.hermite_e.hermegauss(_POINTS)
    weights /= weights.sum()
    rates = np.empty_like(snr)
    for row, levels in enumerate(snr):  # all rows at once would take gigabytes on a large grid
        levels = levels[:, None] + deviation * points
        rates[row] = length * np.log2(1.0 + 10.0 ** (levels / 10.0)) @ weights
    return rates
