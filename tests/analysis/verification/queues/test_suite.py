"""The queues of the simulator are those of theory, and it is noticed if they are not."""

import numpy as np
import pytest

from analysis.verification.queues import suite
from analysis.verification.queues.suite import Measured
from dess.scenario import ScenarioSpace, load_scenario
from tests.analysis.verification.verdicts import failing


@pytest.fixture(scope="module")
def space() -> ScenarioSpace:
    return load_scenario("paper")


@pytest.fixture(scope="module")
def measured(space: ScenarioSpace) -> Measured:
    return suite.simulate(space, 1, 10)


def test_the_queues_are_those_of_theory(space: ScenarioSpace, measured: Measured) -> None:
    checks = suite.checks(measured, space)
    assert not failing(checks)
    assert len(checks) == len({check.test for check in checks}) == 20


def test_values_that_are_twice_as_large_are_noticed(
    space: ScenarioSpace, measured: Measured
) -> None:
    for test in measured:
        values = np.array(measured[test])
        changed = measured | {test: (values + values.mean()).tolist()}
        found = failing(suite.checks(changed, space))
        assert found and all(name.startswith(test) for name in found), test


def test_the_mean_of_skewed_values_is_refuted_as_often_as_the_level_says() -> None:
    """Of 50 exponential values, Student's t would refute the mean in 2.5 % of all cases."""
    values = np.random.default_rng(1).exponential(1.0, (6000, 50))
    refuted = np.mean([suite.p_value(row, 1.0) < 0.01 for row in values])
    assert refuted == pytest.approx(0.01, abs=0.004)  # three standard errors
