"""Land, turbines and random integers of generated seas, the same on every machine.

All is drawn by integer arithmetic on Philox blocks (``dess.streams``). An array of land is (H, W),
true where a cell is land.
"""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from dess import streams
from dess.sea.chart import Cell

T = TypeVar("T")


class Draws:
    """Random integers, one after another, of one attempt to draw a sea.

    Args:
        seed: Of the sea.
        family: Number of its family.
        attempt: Number of the attempt.
    """

    def __init__(self, seed: int, family: int, attempt: int) -> None:
        self._of = np.uint64(seed), family, streams.SEA, 0, attempt
        self._drawn = 0

    def integer(self, low: int, high: int) -> int:
        """A uniform integer in ``low..high``, both included."""
        words = streams.block(*self._of, self._drawn // 4)
        word = words[self._drawn % 4]
        self._drawn += 1
        return int(streams.integer(np.uint64(word), low, high))

    def one_of(self, items: Sequence[T]) -> T:
        """One of some items."""
        return items[self.integer(0, len(items) - 1)]

    def some_of(self, items: Sequence[T], number: int) -> list[T]:
        """A number of different items, in the order in which they are drawn."""
        left = [*items]
        for i in range(number):
            j = self.integer(i, len(left) - 1)
            left[i], left[j] = left[j], left[i]
        return left[:number]


def grow_island(draws: Draws, land: np.ndarray, start: Cell, size: int) -> None:
    """Make an island about a cell: one neighbour of the island after another becomes land."""
    rows, columns = land.shape
    border = [start]
    while size and border:
        number = draws.integer(0, len(border) - 1)
        border[number], border[-1] = border[-1], border[number]
        x, y = border.pop()
        if land[y, x]:
            continue
        land[y, x] = True
        size -= 1
        beside = ((x, y - 1), (x + 1, y), (x, y + 1), (x - 1, y))
        border += [(i, j) for i, j in beside if 0 <= i < columns and 0 <= j < rows]


def make_islands(draws: Draws, land: np.ndarray, number: int, largest: int) -> None:
    """Make islands of 3 to ``largest`` cells each, anywhere on the grid."""
    rows, columns = land.shape
    for _ in range(number):
        start = draws.integer(0, columns - 1), draws.integer(0, rows - 1)
        grow_island(draws, land, start, draws.integer(3, largest))


def make_coast(draws: Draws, land: np.ndarray) -> None:
    """Make land along one of the four sides, with a shore that goes to and fro."""
    turned = np.rot90(land, draws.integer(0, 3))  # a view: what is made there is made in ``land``
    depth, columns = turned.shape
    shore = draws.integer(depth // 8, depth // 5)
    for x in range(columns):
        shore = min(max(shore + draws.integer(-1, 1), 1), depth // 4)
        turned[:shore, x] = True


def make_lane(draws: Draws, land: np.ndarray) -> None:
    """Make a shipping lane of two rows along the grid, which UAVs may only cross at some gates."""
    rows, columns = land.shape
    top, width, gates = rows // 2 + draws.integer(-2, 1), draws.integer(3, 4), draws.integer(2, 4)
    land[top : top + 2] = True
    for gate in range(gates):
        part = columns // gates
        left = gate * part + draws.integer(0, part - width)
        land[top : top + 2, left : left + width] = False
