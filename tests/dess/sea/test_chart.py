"""Ways between the cells of a sea: their lengths are those of a search of the whole grid."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dess.sea.chart import NO_FLY, OPEN, chart_at, length_around, spread


@given(st.data())
def test_a_way_around_closed_cells_is_as_long_as_a_search_of_all_cells_says(
    data: st.DataObject,
) -> None:
    """With and without no-fly cells, and on a large grid, where few cells have their ways."""
    width, height = data.draw(st.integers(3, 9)), data.draw(st.integers(3, 9))
    cell = st.tuples(st.integers(0, width - 1), st.integers(0, height - 1))
    zone, (start, end) = (0, 0, 1, 1), data.draw(st.lists(cell, min_size=2, max_size=2))
    no_fly = data.draw(st.lists(cell, max_size=width * height // 3, unique=True))
    no_fly = [place for place in no_fly if place not in ((0, 0), start, end)]
    closed = data.draw(st.lists(cell, max_size=8, unique=True))
    closed = [place for place in closed if place not in (start, end)]
    chart = chart_at(width, height, (zone,), tuple(no_fly))
    seen = np.full((height, width), OPEN)
    for x, y in (*no_fly, *closed):
        seen[y, x] = NO_FLY
    wanted = spread(seen, np.array([end]))[0].reshape(height, width)[start[1], start[0]]
    numbers = np.array([y * width + x for x, y in closed], np.int64)
    rows = np.full(width * height, -1, np.int64)
    for ways, row in ((chart.ways, chart.rows), (chart.ways, rows)):
        if ways is None and row is not None:
            continue
        assert length_around(chart.zones, ways, row, numbers, *start, *end) == wanted
