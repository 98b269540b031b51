"""The charging zone as a queue: by hand, and with Little's law."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.verification.queues.pads import Station

times = st.integers(1, 40).map(lambda eighths: eighths / 8)


def test_three_uavs_and_a_pad_by_hand() -> None:
    """They come at 1, 2 and 3 and charge for 4, 1 and 1: the pad is free at 5, 6 and 7."""
    station = Station(1, np.array([1.0, 1.0, 1.0]), np.array([4.0, 1.0, 1.0]))
    assert station.waits.tolist() == [0.0, 3.0, 3.0]
    assert station.queues.tolist() == [0.0, 0.0, 1.0 + 5.0]  # one from 2 to 3, two to 5, one to 6


def test_two_pads_by_hand() -> None:
    station = Station(2, np.array([1.0, 1.0, 1.0]), np.array([4.0, 1.5, 1.0]))
    assert station.waits.tolist() == [0.0, 0.0, 0.5]


@given(st.integers(1, 3), st.lists(st.tuples(times, times), min_size=1, max_size=60))
def test_littles_law(pads: int, uavs: list[tuple[float, float]]) -> None:
    gaps, charging = np.array(uavs).T
    station = Station(pads, gaps, charging)
    assert station.queues.sum() == pytest.approx(station.waits.sum())
