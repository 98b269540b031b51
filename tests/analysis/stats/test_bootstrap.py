"""Bootstrap intervals, also where BCa is not defined, and of few values."""

import numpy as np
import pytest

from dess.analysis.stats.bootstrap import bootstrap_interval, expanded_level


def test_bootstrap_keeps_pairs_together():
    x = np.random.default_rng(3).exponential(size=30)
    ratio = bootstrap_interval((2 * x, x), lambda a, b: a.sum() / b.sum(), np.random.default_rng(1))
    assert ratio == pytest.approx((2.0, 2.0, 2.0))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("sample", "statistic"),
    [
        # More than in any resample.
        (np.arange(20.0), lambda values: len(np.unique(values))),
        # Whichever is left out.
        (np.array([1.0, 2.0, 2.0, 2.0, 3.0]), np.median),
        (np.array([0.0, 1.0]), np.mean),
        (np.array([1.0, 2.0, 5.0]), np.max),
    ],
)
def test_bootstrap_where_bca_is_not_defined_has_ends(sample, statistic):
    _, low, high = bootstrap_interval(sample, statistic, np.random.default_rng(1))
    assert sample.min() <= low <= high <= max(sample.max(), 20)


def test_few_values_need_a_higher_level():
    # t(0.975, 4) sqrt(5 / 4) = 2.776445 x 1.118034 = 3.104160, of which normal: 0.998092
    assert expanded_level(0.95, 5) == pytest.approx(0.998092, abs=1e-6)
    assert expanded_level(0.95, 10**6) == pytest.approx(0.95, abs=1e-6)
    assert expanded_level(0.95, 0.5) == expanded_level(0.95, 2) <= 1
