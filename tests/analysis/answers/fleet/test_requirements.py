"""By how much fleets keep requirements, by hand."""

import pandas as pd
import pytest

from dess.analysis.answers.fleet.requirements import (
    least_spare,
    relative_spare,
)
from dess.analysis.metrics import RATIO, SUCCESS, metric_of
from dess.analysis.stats.requirement import Requirement

RATIO_OF_80 = Requirement(metric_of(RATIO), 0.8)


def test_a_success_that_all_fleets_have_is_not_tight():
    """It is nearer to its bound than the ratio, but no fleet comes closer."""
    success = Requirement(metric_of(SUCCESS), 0.99)
    fleets = pd.DataFrame({SUCCESS: [1.0, 1.0, 1.0], RATIO: [0.68, 0.82, 0.88]})
    assert relative_spare(fleets, success).tolist() == [float("inf")] * 3
    assert relative_spare(fleets, RATIO_OF_80).tolist() == pytest.approx([-0.6, 0.1, 0.4])
    assert least_spare(fleets, [success, RATIO_OF_80]).tolist() == pytest.approx([-0.6, 0.1, 0.4])
