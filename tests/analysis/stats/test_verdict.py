"""What intervals show, refute and leave open, and which settings may be the best."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.special import ndtri

from dess.analysis.metrics import MOST_SLOTS, SUCCESS, metric_in_missions
from dess.analysis.stats.differences import difference_test
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.verdict import (
    ABOVE,
    BELOW,
    HOLDS,
    IN_PART,
    INCONCLUSIVE,
    REFUTED,
    front_membership,
    judge_parts,
    may_be_best,
    on_front,
    position_by_test,
    position_of,
    verdict_above,
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
    assert position_of(Interval((low + high) / 2, low, high)) == side
    assert position_of(Interval((low + high) / 2 + 1, low + 1, high + 1), 1) == side
    assert position_of(pd.Series({"low": low, "high": high})) == side
    assert verdict_above(Interval((low + high) / 2, low, high)) is part


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
    assert judge_parts(True) == judge_parts(True, True) == HOLDS
    assert judge_parts(True, False) == judge_parts(True, None) == IN_PART
    assert judge_parts(False) == judge_parts(False, None) == judge_parts(False, False) == REFUTED
    assert judge_parts(None) == judge_parts(None, None) == INCONCLUSIVE


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


def by_hand(values, level=0.95):
    """The definition, a paired t test of scipy for every two settings."""
    count = values.shape[1]
    alpha = (1 - level) / max(count - 1, 1)

    def beats(other, own):
        pairs = values[np.isfinite(values[:, own] - values[:, other])][:, [other, own]]
        ahead = pairs[:, 0] - pairs[:, 1]
        if len(ahead) < 2:
            return False
        if np.ptp(ahead) < 1e-9:
            return ahead[0] > 0 and 0.5 ** len(ahead) <= alpha
        return stats.ttest_1samp(ahead, 0, alternative="greater").pvalue < alpha

    return np.array([not any(beats(j, i) for j in range(count) if j != i) for i in range(count)])


def test_it_is_the_paired_t_test_of_every_two_settings():
    generator = np.random.default_rng(3)
    shared = generator.normal(size=(25, 1))
    values = shared + 0.4 * generator.normal(size=(25, 12)) + np.linspace(0, 1, 12)
    values[20:, ::3] = np.nan  # replications that some settings lack
    values[:, 7] = values[:, 6] + 0.25  # all differences alike
    expected = by_hand(values)
    assert 1 < expected.sum() < 10
    assert may_be_best(values).tolist() == expected.tolist()


def test_of_ages_the_lower_is_better_and_a_rare_one_is_the_largest():
    """An age of 4 in 12 missions against 10 is no evidence where a failure has one of 250."""
    missions = pd.DataFrame({"age": [4.0], MOST_SLOTS: [500]})
    of, noise = (
        metric_in_missions(missions, "age"),
        np.random.default_rng(2).normal(0, 0.1, (400, 2)),
    )
    ages = np.array([4.0, 10.0]) + noise
    assert may_be_best(ages[:12], "age").tolist() == [True, False]
    assert may_be_best(ages[:12], of).all()
    assert may_be_best(ages, of).tolist() == [True, False]


def test_after_a_search_the_tests_have_the_errors_of_their_looks():
    """Look k of a setting has the share 1 / (k (k + 1)) of the error of each pair."""
    values = np.random.default_rng(4).normal(size=(15, 8)) + np.linspace(0, 1.5, 8)
    later = np.full(8, 2)
    assert may_be_best(values, looks=later).tolist() == by_hand(values, 1 - 0.05 / 6).tolist()
    assert may_be_best(values, looks=later).sum() > may_be_best(values).sum()


def test_blocks_of_settings_are_judged_like_all_at_once(monkeypatch):
    values = np.random.default_rng(1).normal(size=(12, 40)) + np.linspace(0, 2, 40)
    whole = may_be_best(values)
    monkeypatch.setattr("dess.analysis.stats.verdict._BLOCK", 7)
    assert may_be_best(values).tolist() == whole.tolist()


def test_shares_are_judged_as_the_test_of_shares_does():
    """Of 12 missions one lost more is no evidence, eight are."""
    sure = np.ones((12, 3))
    sure[:1, 1], sure[:8, 2] = 0, 0
    assert may_be_best(sure, SUCCESS).tolist() == [True, True, False]
    interval, _ = difference_test(sure[:, 0], sure[:, 2], SUCCESS, 1 - 2 * 0.05 / 2)
    assert interval.low > 0  # the one-sided test at 0.05 / 2


def test_settings_without_common_replications_are_not_compared():
    values = np.array([[1.0, np.nan], [1.1, np.nan], [np.nan, 9.0], [np.nan, 9.1]])
    assert may_be_best(values).all()
