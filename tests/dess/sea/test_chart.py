"""The chart: shortest ways and nearest parking cells, compared with plain Python."""

import numpy as np
from hypothesis import given

from dess.scenario import ScenarioSpace
from dess.sea.chart import FAR, NO_FLY, OPEN, geometry, parking_of
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
