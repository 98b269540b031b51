"""Confidence sequences: what the bets rule out, and how often a reader who watches is misled."""

import math
from pathlib import Path

import numpy as np
import pytest

from dess.analysis.metrics import PRODUCT
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.intervals import bounded_interval, mean_interval, share_interval
from dess.analysis.stats.sequences import PARTS, add_values, ends_of_what_was_seen, sequence_ends
from tests.compiled import new_sequence

PORTION = 25


def watch(values, least=0.0, most=1.0, error=0.05, portion=PORTION):
    """The ends of the interval after every portion of the values."""
    sequence = new_sequence(least, most, error)
    ends = []
    for begin in range(0, len(values), portion):
        add_values(sequence, values[begin : begin + portion])
        ends.append(sequence_ends(sequence))
    return np.array(ends)


def share_of_misled(draw, mean, readers, least=0.0, most=1.0):
    """The share of readers to whom some portion showed an interval without the true mean."""
    misled = 0
    for seed in range(readers):
        ends = watch(draw(np.random.default_rng([57, seed])), least, most)
        misled += bool((ends[:, 0] > mean).any() or (ends[:, 1] < mean).any())
    return misled / readers


def test_the_first_bets_by_hand():
    """Nothing is expected but 1/2, with the variance 1/4; the stakes are at most 1/2."""
    sequence = new_sequence(0.0, 1.0)
    add_values(sequence, np.array([1.0]))
    # Against a mean of 0.4: the stake is 0.1 / (0.25 + 0.01), and 1 - 0.4 is won on it.
    assert sequence[0]["for_more"][400] == pytest.approx(1 + 0.1 / 0.26 * 0.6)
    assert sequence[0]["for_less"][400] == 1.0
    # Against a mean of 0.9, the bet is that the mean is less, and 0.1 of the stake is lost.
    assert sequence[0]["for_less"][900] == pytest.approx(1 - 0.4 / 0.41 * 0.1)


def test_the_first_means_are_ruled_out_by_hand():
    """After two ones, those against which half of the capital has grown to 1 / error."""

    def capital(mean):
        # 1/2 and a variance of 1/4 are expected, then 3/4 and a variance of 5/32.
        expected = ((0.5, 1 / 4), (0.75, 5 / 32))
        stakes = [(x - mean) / (variance + (x - mean) ** 2) for x, variance in expected]
        return math.prod(1 + stake * (1 - mean) for stake in stakes)

    sequence = new_sequence(0.0, 1.0, error=0.5)
    add_values(sequence, np.ones(2))
    low, high = sequence_ends(sequence)
    assert 0 < low < 0.05
    assert capital(low) >= 2 / 0.5 > capital(low + 1 / PARTS)
    assert high == 1


def test_what_was_seen_has_no_allowance_for_failures():
    """With bounds or a failure, or without: the sequence of the values alone."""
    values = np.random.default_rng(4).normal(0.02, 0.01, 200)
    sequences = [new_sequence(-1.0, 1.0), new_sequence(-math.inf, math.inf, failure=1.0)]
    alone = new_sequence(-math.inf, math.inf)
    for sequence in (*sequences, alone):
        add_values(sequence, values)
    low, high = sequence_ends(alone)
    assert 0 < low < values.mean() < high
    assert ends_of_what_was_seen(alone) == (low, high)
    for sequence in sequences:
        assert ends_of_what_was_seen(sequence) == (low, high)
        assert sequence_ends(sequence)[0] < 0


@pytest.mark.parametrize("least, most", [(0.0, 1.0), (-1.0, 1.0), (0.0, math.inf)])
def test_portions_change_nothing(least, most):
    values = np.random.default_rng(1).random(300)
    at_once = watch(values, least, most, portion=300)[-1]
    in_portions = watch(values, least, most, portion=7)[-1]
    assert (at_once == in_portions).all()


def test_an_interval_only_gets_narrower_within_the_bounds():
    values = (np.random.default_rng(2).random(2000) < 0.7) * 1.0
    ends = watch(values)
    assert (np.diff(ends[:, 0]) >= 0).all()
    assert (np.diff(ends[:, 1]) <= 0).all()
    assert (ends[:, 0] >= 0).all()
    assert (ends[:, 1] <= 1).all()


def test_other_bounds_move_and_stretch_the_interval():
    values = np.random.default_rng(3).random(500)
    plain = watch(values)
    stretched = watch(6 * values - 2, -2.0, 4.0)
    assert stretched == pytest.approx(6 * plain - 2, abs=6 / PARTS)


def test_missing_values_are_passed_over():
    values = np.random.default_rng(4).random(60)
    with_gaps = np.insert(values, [0, 10, 60], math.nan)
    assert (watch(with_gaps, portion=70)[-1] == watch(values, portion=70)[-1]).all()


def test_equal_values_leave_an_interval_of_some_width():
    """A thousand successes do not rule out that one mission in a thousand fails."""
    low, high = watch(np.ones(1000))[-1]
    assert 0.98 < low < 0.995
    assert high == 1


def test_a_watched_interval_is_wider_than_one_for_a_fixed_number():
    """By about a half for a share, which is what pages say."""
    values = (np.random.default_rng(5).random(1000) < 0.9) * 1.0
    fixed = share_interval(int(values.sum()), 1000)
    low, high = watch(values)[-1]
    assert 1.2 < (high - low) / (fixed.high - fixed.low) < 1.8
    times = np.random.default_rng(6).exponential(1.0, 1000)
    fixed = mean_interval(times)
    low, high = watch(times, 0.0, math.inf)[-1]
    assert 1.2 < (high - low) / (fixed.high - fixed.low) < 1.8


def test_nothing_is_said_of_few_values_without_bounds():
    assert (watch(np.ones(20), 0.0, math.inf, portion=20)[-1] == (0.0, math.inf)).all()


@pytest.mark.slow
@pytest.mark.parametrize("success", [0.9, 0.95, 0.99, 0.999])
def test_readers_who_watch_a_share_are_seldom_misled(success):
    def draw(random):
        return (random.random(2000) < success) * 1.0

    assert share_of_misled(draw, success, 2000) <= 0.05


@pytest.mark.slow
def test_readers_who_watch_a_paired_difference_are_seldom_misled():
    """Of two policies that fail in 1 and 3 % of the missions, otherwise with equal products."""

    def draw(random):
        failures = random.random((2, 2000)) < [[0.01], [0.03]]
        product = 0.85 + 0.1 * random.random(2000)
        return product * ~failures[0] - product * ~failures[1]

    assert share_of_misled(draw, 0.02 * 0.9, 2000, -1.0, 1.0) <= 0.05


@pytest.mark.slow
@pytest.mark.parametrize("failing, most", [(0.0, math.inf), (0.0, 30.0), (0.03, 30.0)])
def test_readers_who_watch_a_time_are_seldom_misled(failing, most):
    """Of skewed times; and of missions some of which fail and last longer, within known bounds.

    Without bounds, nothing protects from failures that are so rare that none has come yet.
    """

    def draw(random):
        times = random.gamma(4.0, 0.5, 2000) + 20.0 * (random.random(2000) < failing)
        return np.minimum(times, 30.0)

    assert share_of_misled(draw, 2.0 + 20.0 * failing, 2000, 0.0, most) <= 0.05


def test_sequences_are_as_much_wider_than_a_studys_intervals_as_the_panel_says():
    """For ratios of missions that differ little, with and without pairing."""
    generator = np.random.default_rng(5)
    templates = Path(__file__).parents[3] / "reports" / "templates"
    caption = (templates / "panel.html").read_text("utf-8")
    assert "1.3 to 1.8 times for means, 2.4 to 3.2 times for differences" in caption
    for n in (100, 300, 600):
        a = np.clip(0.8 + 0.13 * generator.normal(size=n), 0, 1)
        b = np.clip(a - 0.04 + 0.05 * generator.normal(size=n), 0, 1)
        pair = compare_pairs(b, a, metric=PRODUCT)
        mean = bounded_interval(a)
        widths = []
        for ends, values in (((0.0, 1.0), a), ((-1.0, 1.0), b - a)):
            sequence = new_sequence(*ends)
            add_values(sequence, values)
            low, high = sequence_ends(sequence)
            widths.append(high - low)
        assert 1.3 < widths[0] / (mean.high - mean.low) < 1.85
        assert 2.35 < widths[1] / (pair.high - pair.low) < 3.25
