"""Sequential tests of means: what is clear is found soon, and a wrong verdict is rare."""

import math

import numpy as np
import pytest

from dess.analysis.stats.betting import MeanTest, WorstNodeTest

ERROR = 0.05


def outcome(values, required=0.99, tolerance=0.005, error=ERROR):
    test = MeanTest(required, tolerance, error)
    test.observe(values)
    return test.verdict, test.missions


def failing(seed, rate, missions=40_000):
    return (np.random.default_rng([1, seed]).random(missions) >= rate).astype(float)


def test_missions_that_never_fail_meet_a_requirement_soon():
    # A gambler who stakes all but nothing multiplies the wealth by 1 / 0.985 a mission: 199
    # missions for 20. The stakes are 15, of which one is the best: 15 times the wealth is needed.
    verdict, missions = outcome(np.ones(1000))
    assert verdict == "met"
    assert math.log(20) / -math.log(0.985) < missions < math.log(20 * 15) / -math.log(0.985) + 1


@pytest.mark.parametrize("rate, verdict", [(0.0, "met"), (0.002, "met"), (0.03, "missed")])
def test_what_is_clear_is_found(rate, verdict):
    assert outcome(failing(3, rate))[0] == verdict


def test_what_is_not_clear_stays_open():
    assert outcome(failing(3, 0.01, 100)) == ("open", 100)
    assert outcome(np.ones(0)) == ("open", 0)


@pytest.mark.parametrize("rate", [0.0, 0.009, 0.03])
def test_blocks_and_later_missions_change_nothing(rate):
    values = failing(4, rate)
    whole = outcome(values)
    test = MeanTest(0.99, 0.005, ERROR)
    for block in np.array_split(values, 97):
        test.observe(block)
    assert (test.verdict, test.missions) == whole
    assert outcome(values[: whole[1]]) == whole
    assert outcome(values[: whole[1] - 1])[0] == "open"


def wrong(draw, forbidden, trials):
    """How often a verdict is wrong."""
    return np.mean([outcome(draw(seed))[0] == forbidden for seed in range(trials)])


def most(trials):
    """The promised rate of errors, and three binomial errors."""
    return ERROR + 3 * math.sqrt(ERROR * (1 - ERROR) / trials)


@pytest.mark.parametrize("mean, forbidden", [(0.985, "met"), (0.995, "missed")])
def test_errors_are_rare(mean, forbidden):
    assert wrong(lambda seed: failing(seed, 1 - mean, 10_000), forbidden, 100) <= most(100)


@pytest.mark.parametrize(
    ("rates", "verdict"), [([0.0, 0.0], "met"), ([0.0, 0.03], "missed"), ([0.03, 0.0], "missed")]
)
def test_the_worst_node_decides(rates, verdict):
    values = np.column_stack([failing(seed, rate) for seed, rate in enumerate(rates)])
    test = WorstNodeTest(0.99, 0.005, ERROR)
    for block in np.array_split(values, 97):
        test.observe(block)
    assert test.verdict == verdict
    alone = MeanTest(0.99, 0.005, ERROR)
    alone.observe(values[:, np.argmax(rates)])
    assert alone.verdict == verdict and alone.missions <= test.missions


@pytest.mark.parametrize("mean, forbidden", [(0.985, "met"), (0.995, "missed")])
def test_errors_on_the_worst_of_five_nodes_are_rare(mean, forbidden):
    def verdict(seed):
        test = WorstNodeTest(0.99, 0.005, ERROR)
        test.observe(np.column_stack([failing(5 * seed + k, 1 - mean, 3000) for k in range(5)]))
        return test.verdict

    assert np.mean([verdict(seed) == forbidden for seed in range(30)]) <= most(30)


def test_where_both_verdicts_are_right_the_mean_decides():
    """Bets on either side win with the same value: all values are what is required."""
    assert outcome(np.full(20_000, 0.5), 0.5)[0] == "met"
    below, above = np.nextafter(0.5, [0, 1])
    assert outcome(np.full(20_000, below), 0.5)[0] == "missed"
    assert outcome(np.full(20_000, above), 0.5)[0] == "met"
