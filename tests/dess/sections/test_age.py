"""Age of information against a sawtooth worked out by hand, and against samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess.sections.age import age_of_teeth

Tooth = tuple[float, float]


def _of_teeth(teeth: list[Tooth]) -> tuple[float, float]:
    lows, highs = (np.array(ends) for ends in zip(*teeth, strict=True))
    return age_of_teeth(lows, highs, np.ones(len(teeth)))


def test_two_teeth_by_hand():
    """Areas 8 and 2 over 6 slots; the longer tooth alone passes the highest 0.06 slots."""
    mean, percentile = _of_teeth([(0.0, 4.0), (0.0, 2.0)])
    assert mean == pytest.approx(10 / 6)
    assert percentile == pytest.approx(4 - 0.06)


ages = st.integers(0, 400).map(lambda quarters: quarters / 4)


@given(st.lists(st.tuples(ages, ages).map(lambda ends: (min(ends), max(ends))), min_size=1))
def test_the_mean_and_the_percentile_are_those_of_a_fine_sample(teeth):
    if all(low == high for low, high in teeth):
        return
    mean, percentile = _of_teeth(teeth)
    lows, highs = np.array(teeth).T
    time, step = (highs - lows).sum(), 1 / 64
    sample = np.concatenate([np.arange(low, high, step) + step / 2 for low, high in teeth])
    assert mean == pytest.approx(sample.mean())
    above = np.maximum(highs - np.maximum(lows, percentile), 0.0).sum()
    assert above == pytest.approx(0.01 * time)
    assert lows.min() <= percentile <= highs.max()
