"""What a whole interval shows, refutes and leaves open."""

import itertools

import numpy as np
import pytest

from analysis.stats.intervals import Interval
from analysis.stats.verdict import HOLDS, IN_PART, INCONCLUSIVE, REFUTED, above, judged


@pytest.mark.parametrize(
    ("low", "high", "part"),
    [(0.1, 0.3, True), (-0.3, -0.1, False), (-0.1, 0.3, None), (0.0, 0.0, None)],
)
def test_a_whole_interval_lies_on_one_side(low: float, high: float, part: bool | None) -> None:
    assert above(Interval((low + high) / 2, low, high)) is part
    assert above(Interval((low + high) / 2 + 1, low + 1, high + 1), 1) is part


def test_an_interval_that_there_is_not_leaves_it_open() -> None:
    assert above(Interval(5.0, np.nan, np.nan)) is None


def test_verdicts_on_parts() -> None:
    assert judged(True) == judged(True, True) == HOLDS
    assert judged(True, False) == judged(True, None) == IN_PART
    assert judged(False) == judged(False, None) == judged(False, False) == REFUTED
    assert judged(None) == judged(None, None) == INCONCLUSIVE


def test_the_order_of_parts_does_not_matter() -> None:
    for parts in itertools.product((True, False, None), repeat=3):
        assert len({judged(*order) for order in itertools.permutations(parts)}) == 1
