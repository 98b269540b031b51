"""The settings that may be the best are those that no other is significantly better than."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from analysis.names import SUCCESS
from analysis.stats.differences import difference_test
from analysis.stats.screening import may_be_best


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


def test_blocks_of_settings_are_judged_like_all_at_once(monkeypatch):
    values = np.random.default_rng(1).normal(size=(12, 40)) + np.linspace(0, 2, 40)
    whole = may_be_best(values)
    monkeypatch.setattr("analysis.stats.screening._BLOCK", 7)
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


@given(
    arrays(float, st.tuples(st.integers(2, 9), st.integers(1, 6)), elements=st.floats(-9, 9)),
    st.booleans(),
)
def test_the_best_mean_is_always_among_them(values, repeated):
    values = np.concatenate([values, values], axis=1) if repeated else values
    kept = may_be_best(values)
    means = values.mean(axis=0)
    assert kept[means.argmax()]
    if repeated:  # the same setting twice has the same verdict
        assert kept[: len(kept) // 2].tolist() == kept[len(kept) // 2 :].tolist()


def kept_best(generator, trials, spread, missions=30, count=40):
    """In how many trials the true best is kept, of settings that share their luck."""
    truth = np.zeros(count)
    truth[generator.integers(count)] = spread
    best, kept = truth.argmax(), 0
    for _ in range(trials):
        luck = generator.gamma(2.0, size=(missions, 1))
        values = truth + luck + generator.normal(size=(missions, count))
        kept += may_be_best(values)[best]
    return kept


def test_the_true_best_is_kept():
    trials = 200
    assert kept_best(np.random.default_rng(2), trials, 0.02) >= stats.binom.ppf(1e-4, trials, 0.95)


@pytest.mark.slow
@pytest.mark.parametrize("spread", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("count", [2, 10, 200])
def test_the_true_best_is_kept_as_often_as_promised(spread, count):
    trials = 2000
    kept = kept_best(np.random.default_rng(count), trials, spread, count=count)
    assert kept >= stats.binom.ppf(1e-4, trials, 0.95)
