"""Polygons on the grid: the cells and the places in them, and the cells along their rings."""

import numpy as np

from dess.scenario.projection import Size


def border_within(rings: list[np.ndarray], size: Size) -> np.ndarray:
    """(K, 2) the cells along rings, without those at the rim of the grid, beyond which is land."""
    cells = np.concatenate([_border_of(ring, size) for ring in rings])
    return cells[((cells > 0) & (cells < np.array(size) - 1)).all(1)]


def _border_of(ring: np.ndarray, size: Size) -> np.ndarray:
    """(K, 2) the cells along a ring, of its edges that may be on the grid."""
    low = np.minimum(ring[:-1], ring[1:])
    high = np.maximum(ring[:-1], ring[1:])
    is_near = ((low < size) & (high > 0)).all(1)
    starts = ring[:-1][is_near]
    steps = np.diff(ring, axis=0)[is_near]
    counts = np.ceil(2 * np.abs(steps)).astype(int).max(1, initial=1)  # at every half of a cell
    edges = np.repeat(np.arange(len(counts)), counts)
    first = np.cumsum(counts) - counts
    shares = (np.arange(len(edges)) - first[edges]) / counts[edges]
    return np.floor(starts[edges] + shares[:, None] * steps[edges]).astype(int)


def centres_in(rings: list[np.ndarray], size: Size) -> np.ndarray:
    """(H, W) whether the centre of a cell lies in a polygon, by the even-odd rule.

    A ray from the centre to the west crosses the rings an odd number of times.

    Args:
        rings: The outer ring and the holes, (K, 2) places on the grid [cells] each, closed.
        size: Cells of the grid from west to east and from north to south.
    """
    starts = np.concatenate([ring[:-1] for ring in rings])
    ends = np.concatenate([ring[1:] for ring in rings])
    inside = np.zeros(size[::-1], np.bool_)
    for row in range(size[1]):
        y = row + 0.5
        crosses = (starts[:, 1] <= y) != (ends[:, 1] <= y)
        x0, y0 = starts[crosses].T
        x1, y1 = ends[crosses].T
        crossings = np.sort(x0 + (y - y0) * (x1 - x0) / (y1 - y0))
        inside[row] = np.searchsorted(crossings, np.arange(size[0]) + 0.5) % 2 == 1
    return inside


def lie_in(rings: list[np.ndarray], spots: np.ndarray) -> np.ndarray:
    """(K,) whether (K, 2) places lie in a polygon, by the even-odd rule as in ``centres_in``."""
    x0, y0 = np.concatenate([ring[:-1] for ring in rings]).T
    x1, y1 = np.concatenate([ring[1:] for ring in rings]).T
    is_held = np.zeros(len(spots), np.bool_)
    for number, (x, y) in enumerate(spots):
        crosses = (y0 <= y) != (y1 <= y)
        shares = (y - y0[crosses]) / (y1 - y0)[crosses]
        crossings = x0[crosses] + shares * (x1 - x0)[crosses]
        is_held[number] = np.count_nonzero(crossings < x) % 2 == 1
    return is_held
