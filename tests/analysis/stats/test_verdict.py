"""What a whole interval shows, refutes and leaves open."""

import numpy as np
import pandas as pd
import pytest

from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.verdict import (
    ABOVE,
    BELOW,
    HOLDS,
    IN_PART,
    INCONCLUSIVE,
    REFUTED,
    above,
    judged,
    position,
    position_by_test,
)


@pytest.mark.parametrize(
    ("low", "high", "side", "part"),
    [
        (0.1, 0.3, ABOVE, True),
        (-0.3, -0.1, BELOW, False),
        (0.0, 0.0, INCONCLUSIVE, None),
        (np.nan, np.nan, INCONCLUSIVE, None),
    ],
)
def test_a_whole_interval_lies_on_one_side(low, high, side, part):
    assert position(Interval((low + high) / 2, low, high)) == side
    assert position(Interval((low + high) / 2 + 1, low + 1, high + 1), 1) == side
    assert position(pd.Series({"low": low, "high": high})) == side
    assert above(Interval((low + high) / 2, low, high)) is part


@pytest.mark.parametrize(
    ("difference", "p", "side"),
    [
        (0.1, 0.05, ABOVE),
        (-0.1, 0.01, BELOW),
        (0.1, 0.06, INCONCLUSIVE),
        (0.0, 0.01, INCONCLUSIVE),
        (np.nan, np.nan, INCONCLUSIVE),
    ],
)
def test_a_significant_difference_lies_on_one_side(difference, p, side):
    assert position_by_test(difference, p) == side


def test_verdicts_on_parts():
    assert judged(True) == judged(True, True) == HOLDS
    assert judged(True, False) == judged(True, None) == IN_PART
    assert judged(False) == judged(False, None) == judged(False, False) == REFUTED
    assert judged(None) == judged(None, None) == INCONCLUSIVE
