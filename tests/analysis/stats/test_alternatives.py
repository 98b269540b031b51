"""Which of several settings may be the best."""

from dataclasses import replace

import numpy as np
import pandas as pd
from scipy import stats

from dess.analysis.metric_ranges import metric_in_missions
from dess.analysis.metrics import MOST_SLOTS, SUCCESS, metric_of
from dess.analysis.stats.alternatives import may_be_best
from dess.analysis.stats.differences import difference_test


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
    """PointStyle k of a setting has the share 1 / (k (k + 1)) of the error of each pair."""
    values = np.random.default_rng(4).normal(size=(15, 8)) + np.linspace(0, 1.5, 8)
    later = np.full(8, 2)
    assert may_be_best(values, analyses=later).tolist() == by_hand(values, 1 - 0.05 / 6).tolist()
    assert may_be_best(values, analyses=later).sum() > may_be_best(values).sum()


def test_blocks_of_settings_are_judged_like_all_at_once(monkeypatch):
    values = np.random.default_rng(1).normal(size=(12, 40)) + np.linspace(0, 2, 40)
    whole = may_be_best(values)
    monkeypatch.setattr("dess.analysis.stats.alternatives._BLOCK", 7)
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


def test_each_setting_has_a_rare_mission_of_its_own_range():
    """One that cannot wait has no rare wait, so one that did wait in each mission is ruled out."""
    waits = np.column_stack([np.zeros(100), np.random.default_rng(5).uniform(3, 5, 100)])
    shared = replace(metric_of("waiting"), most=400.0)
    assert may_be_best(waits, shared).all()
    own = replace(shared, most=np.array([0.0, 400.0]))
    assert may_be_best(waits, own).tolist() == [True, False]
