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


def test_values_are_those_of_the_seed(space: ScenarioSpace, measured: Measured) -> None:
    for test, values in suite.simulate(space, 1, 2).items():
        if not test.startswith("Charging zone"):  # the draws of its batches depend on their number
            assert values == measured[test][: len(values)]
