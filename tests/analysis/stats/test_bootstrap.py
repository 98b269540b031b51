"""Bootstrap intervals: near Student's, reproducible, and defined where BCa is not."""

import numpy as np
import pytest

from analysis.stats import bootstrap
from analysis.stats.bootstrap import bootstrap_interval, expanded_level
from analysis.stats.intervals import mean_interval


def test_bootstrap_of_a_mean_is_near_student():
    sample = np.random.default_rng(3).normal(10.0, 2.0, 400)
    ours = bootstrap_interval(sample, np.mean, np.random.default_rng(1))
    assert ours == pytest.approx(mean_interval(sample), abs=0.02)


def test_bootstrap_keeps_pairs_together():
    x = np.random.default_rng(3).exponential(size=30)
    ratio = bootstrap_interval((2 * x, x), lambda a, b: a.sum() / b.sum(), np.random.default_rng(1))
    assert ratio == pytest.approx((2.0, 2.0, 2.0))


def test_bootstrap_of_many_resamples_at_once_is_that_of_one_by_one(monkeypatch):
    sample, sizes = np.random.default_rng(3).exponential(size=300), []

    def mean(values, axis=-1):
        sizes.append(values.size)
        return np.mean(values, axis=axis)

    def interval(statistic):
        generator = np.random.default_rng(1)
        return bootstrap_interval(sample, statistic, generator, resamples=99)

    one_by_one = interval(lambda values: np.mean(values))
    assert interval(mean) == pytest.approx(one_by_one, rel=1e-12)
    assert len(sizes) < 10
    monkeypatch.setattr(bootstrap, "_BATCH", 1000)  # what is in memory: three resamples
    sizes.clear()
    assert interval(mean) == pytest.approx(one_by_one, rel=1e-12)
    assert max(sizes) <= 1000


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("sample", "statistic"),
    [
        (np.arange(20.0), lambda values: len(np.unique(values))),  # more than in any resample
        (np.array([1.0, 2.0, 2.0, 2.0, 3.0]), np.median),  # whichever is left out
        (np.array([0.0, 1.0]), np.mean),
        (np.array([1.0, 2.0, 5.0]), np.max),
    ],
)
def test_bootstrap_where_bca_is_not_defined_has_ends(sample, statistic):
    _, low, high = bootstrap_interval(sample, statistic, np.random.default_rng(1))
    assert sample.min() <= low <= high <= max(sample.max(), 20)


def test_bootstrap_at_a_level_beyond_bca_holds_the_estimate():
    # one outlier: the acceleration is near its largest, 1 / 6, and BCa turns over
    sample = np.array([1.0] + [0.0] * 29)
    mean, low, high = bootstrap_interval(sample, np.mean, np.random.default_rng(1), 1 - 1e-10)
    assert low <= mean < high


def test_few_values_need_a_higher_level():
    # t(0.975, 4) sqrt(5 / 4) = 2.776445 x 1.118034 = 3.104160, of which normal: 0.998092
    assert expanded_level(0.95, 5) == pytest.approx(0.998092, abs=1e-6)
    assert expanded_level(0.95, 10**6) == pytest.approx(0.95, abs=1e-6)
    assert expanded_level(0.95, 0.5) == expanded_level(0.95, 2) <= 1
