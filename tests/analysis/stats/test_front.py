"""Which settings are on the front of costs and a metric, and how surely."""

import numpy as np
import pytest
from scipy.special import ndtri

from dess.analysis.stats.front import front_membership, on_front


def slow_front(costs, values):
    pairs = list(zip(costs, values, strict=True))
    return [
        not any(c <= cost and v >= value and (c, v) != (cost, value) for c, v in pairs)
        for cost, value in pairs
    ]


@pytest.mark.parametrize("seed", range(30))
def test_the_front_is_what_nothing_dominates(seed):
    generator = np.random.default_rng(seed)
    # With ties.
    costs, values = generator.integers(0, 6, (2, 4, 9)).astype(float)
    expected = [slow_front(*row) for row in zip(costs, values, strict=True)]
    assert on_front(costs, values).tolist() == expected


def test_equal_costs_stay_equal():
    """The same price: the better setting dominates the other one in every draw."""
    values = np.random.default_rng(2).normal(0.5, 0.1, (1, 200)) + np.array([[0.0], [0.01]])
    costs = np.full((2, 200), 0.1 + 0.2)
    assert front_membership(costs, values, False, np.random.default_rng(1)).tolist() == [0, 1]


def test_settings_that_never_failed_are_not_taken_for_certain():
    costs = np.repeat([[1.0], [2.0]], 100, axis=1)
    found = front_membership(costs, np.ones((2, 100)), True, np.random.default_rng(1), 4000)
    assert found[0] == 1
    assert found[1] == pytest.approx(0.5, abs=0.03)


def test_replications_need_not_be_common():
    generator = np.random.default_rng(3)
    values, costs = generator.normal(0.5, 0.1, (2, 60)), np.repeat([[1.0], [2.0]], 60, axis=1)
    values[0, 30:] = costs[0, 30:] = np.nan
    found = front_membership(costs, values, False, np.random.default_rng(1))
    assert found[0] == 1
    assert 0 < found[1] < 1


def planted(seed, kind, settings=8, missions=300):
    """True costs and means, and samples that are correlated as by common random numbers."""
    generator = np.random.default_rng([seed, 7])
    shared = generator.normal(size=missions)

    def noise():
        own = generator.normal(size=(settings, missions))
        return np.sqrt(0.5) * shared + np.sqrt(0.5) * own

    # In pairs of one price.
    costs = np.repeat(np.arange(settings // 2), 2).astype(float)
    paid = np.repeat(costs[:, None], missions, axis=1)
    if generator.random() < 0.5:
        costs = costs + generator.normal(0, 0.1, settings)
        paid = costs[:, None] + 2 * noise()
    if kind == "ratio":
        means = generator.normal(0.9, 0.01, settings)
        return costs, means, paid, means[:, None] + 0.05 * noise()
    failures = 10 ** generator.uniform(-4, -0.5, settings)
    if kind == "success":
        failures = generator.uniform(0, 0.2, settings)
    return costs, 1 - failures, paid, (noise() < ndtri(1 - failures)[:, None]).astype(float)


@pytest.mark.parametrize("kind", ["ratio", "success", "rare failures"])
@pytest.mark.parametrize(
    ("problems", "draws", "allowed"),
    [(60, 200, 0.3), pytest.param(2000, 500, 0.06, marks=pytest.mark.slow)],
)
def test_the_probabilities_are_calibrated(kind, problems, draws, allowed):
    """In every bin of the stated probabilities, as many settings are on the true front."""
    stated, true = [], []
    for seed in range(problems):
        costs, means, paid, values = planted(seed, kind)
        generator = np.random.default_rng(seed)
        stated.append(front_membership(paid, values, kind != "ratio", generator, draws))
        true.append(on_front(costs, means))
    probabilities, members = np.concatenate(stated), np.concatenate(true)
    bins = np.digitize(probabilities, [0.05, 0.2, 0.4, 0.6, 0.8, 0.95])
    gaps = np.bincount(bins, members - probabilities, 7) / np.bincount(bins, minlength=7)
    assert np.nanmax(np.abs(gaps)) < allowed
    assert np.abs(np.bincount(bins, members - probabilities)).sum() / len(bins) < 0.05
