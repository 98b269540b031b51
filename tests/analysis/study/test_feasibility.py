"""Tests of requirements by betting: errors are as rare as promised, whatever the distribution."""

import math

import numpy as np
import pytest

from analysis.study.feasibility import MeanTest

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
