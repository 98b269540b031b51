"""The bundle method finds the minimum of simple convex functions."""

import numpy as np
import pytest

from dess.analysis.bound.prices import next_prices


def minimise(function, slope, start: np.ndarray, most: np.ndarray) -> tuple[np.ndarray, float]:
    points, values, slopes = [start], [function(start)], [slope(start)]
    for _ in range(60):
        best = int(np.argmin(values))
        point, model = next_prices(
            points[best].copy(), most, values[best], np.array(points), np.array(values),
            np.array(slopes), 0.1,
        )  # fmt: skip
        assert model <= values[best] + 1e-6
        assert (point >= 0).all() and (point <= most).all()
        points.append(point)
        values.append(function(point))
        slopes.append(slope(point))
    return points[int(np.argmin(values))], min(values)


def test_it_finds_a_kink():
    goal = np.array([0.3, 0.8, 0.0])
    most = np.array([np.inf, 1.0, 1.0])
    found, least = minimise(
        lambda x: np.abs(x - goal).sum(), lambda x: np.sign(x - goal), np.ones(3), most
    )
    assert least == pytest.approx(0, abs=0.05)
    assert found == pytest.approx(goal, abs=0.05)


def test_it_keeps_within_the_largest_prices():
    found, _ = minimise(
        lambda x: -x.sum(), lambda x: -np.ones(2), np.zeros(2), np.array([1.0, 2.0])
    )
    assert found.tolist() == [1, 2]
