"""What generated seas are drawn of: integers, islands, coasts and lanes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import streams
from dess.sea.chart import FAR, spread
from dess.sea.families import Draws, grow_island, make_coast, make_islands, make_lane

seeds = st.integers(0, 10**9 - 1)


def draws(seed: int, attempt: int = 0) -> Draws:
    return Draws(seed, 3, attempt)


def test_integers_are_the_words_of_one_block_after_another() -> None:
    words = [streams.block(np.uint64(5), 3, streams.SEA, 0, 2, index) for index in range(3)]
    drawn = draws(5, attempt=2)
    assert [drawn.integer(0, 2**32 - 1) for _ in range(12)] == [int(w) for b in words for w in b]


@given(seeds)
def test_some_of_the_items_are_different_ones(seed: int) -> None:
    drawn = draws(seed)
    assert sorted(drawn.some_of(range(9), 9)) == [*range(9)]
    assert len({*drawn.some_of(range(9), 4)}) == 4
    assert drawn.one_of("abc") in "abc"
    assert all(2 <= drawn.integer(2, 4) <= 4 for _ in range(20))


@given(seeds, st.integers(1, 60))
def test_an_island_is_one_piece_of_its_size(seed: int, size: int) -> None:
    land = np.zeros((9, 7), np.bool_)
    grow_island(draws(seed), land, (3, 4), size)
    assert land[4, 3] and land.sum() == size
    ways = spread(np.where(land, -1, -2).astype(np.int8), np.array([[3, 4]]))[0]
    assert ((ways != FAR) == land.ravel()).all()


def test_islands_that_meet_lose_no_cells_but_at_the_edge() -> None:
    land = np.zeros((4, 4), np.bool_)
    grow_island(draws(1), land, (0, 0), 20)  # more than there are
    assert land.all()
    make_islands(draws(1), land, 3, 5)
    assert land.all()


@given(seeds)
def test_a_coast_lies_along_one_side(seed: int) -> None:
    land = np.zeros((24, 40), np.bool_)
    make_coast(draws(seed), land)
    sides = [land[0].all(), land[-1].all(), land[:, 0].all(), land[:, -1].all()]
    assert sum(map(bool, sides)) == 1
    assert 0 < land.mean() <= 0.25


@pytest.mark.parametrize("seed", range(20))
def test_a_lane_can_be_crossed_at_two_to_four_gates(seed: int) -> None:
    land = np.zeros((18, 50), np.bool_)
    make_lane(draws(seed), land)
    (top, below) = np.flatnonzero(land.any(1))
    assert below == top + 1 and (land[top] == land[below]).all()
    open_ = np.concatenate([[False], ~land[top], [False]])
    gates = np.flatnonzero(np.diff(open_.astype(int)) == 1)
    assert 1 <= len(gates) <= 4 and 6 <= open_.sum() <= 16
