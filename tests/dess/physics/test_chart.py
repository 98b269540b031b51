"""The chart: shortest ways and nearest parking cells, compared with plain Python."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dess.physics.chart import (
    FAR,
    NO_FLY,
    OPEN,
    chart_at,
    geometry,
    length_around,
    parking_of,
    spread,
)
from dess.scenario.scenario import ScenarioSpace
from tests import compiled
from tests.drawn import reached, spaces


@given(spaces())
def test_ways_lead_around_no_fly_cells_and_home_to_the_nearest_zone(space):
    chart, parking = space.chart, parking_of(space.rectangles)
    ways = [reached(cell, *space.size, {*space.no_fly}) for cell in parking]
    for x, y in np.ndindex(space.size):
        lengths = [way.get((x, y), FAR) for way in ways]
        found = compiled.distances(chart, *np.repeat([[x], [y]], len(ways), 1), chart.parking)
        assert found.tolist() == lengths
        zone = next((n for n, z in enumerate(space.rectangles) if (x, y) in parking_of([z])), OPEN)
        assert chart.zones[y, x] == (NO_FLY if (x, y) in space.no_fly else zone)
        if min(lengths) < FAR:
            assert chart.nearest[y, x] == np.argmin(lengths)
    again = ScenarioSpace.of(space, **geometry(chart)).chart
    assert all(map(np.array_equal, again, chart))


def test_a_zone_may_have_more_cells_than_a_short_integer_counts():
    chart = ScenarioSpace.of(grid=200, zone=[0, 0, 200, 200], nodes=[[0, 0]]).chart
    assert (chart.nearest.ravel() == np.arange(40_000)).all()


@given(st.data())
def test_a_way_around_closed_cells_is_as_long_as_a_search_of_all_cells_says(data):
    """With and without no-fly cells, and on a large grid, where few cells have their ways."""
    width, height = data.draw(st.integers(3, 9)), data.draw(st.integers(3, 9))
    cell = st.tuples(st.integers(0, width - 1), st.integers(0, height - 1))
    start, end = data.draw(cell), data.draw(cell)
    kept = {(0, 0), start, end}
    cells = st.lists(cell.filter(lambda place: place not in kept), max_size=width * height // 3)
    no_fly, closed = data.draw(cells), data.draw(cells)
    chart = chart_at(width, height, ((0, 0, 1, 1),), tuple(no_fly))
    free = np.full((height, width), OPEN)
    for x, y in (*no_fly, *closed):
        free[y, x] = NO_FLY
    wanted = spread(free, np.array([end]))[0].reshape(height, width)[start[1], start[0]]
    numbers = np.array([y * width + x for x, y in closed], np.int64)
    few_rows = [] if chart.ways.size == 0 else [np.full(width * height, -1)]
    for rows in (chart.rows, *few_rows):
        found = length_around(chart.zones, chart.ways, rows, numbers, *start, *end)
        assert found == wanted
