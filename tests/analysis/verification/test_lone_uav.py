"""The lone UAV has the rates and the shadowing of the closed forms; others are refuted."""

import numpy as np
import pandas as pd
import pytest

from analysis.verification import draws, measurements
from dess import load_scenario
from tests.analysis.verification.verdicts import failing

SPACE = load_scenario("paper")


@pytest.fixture(scope="module")
def rates() -> pd.DataFrame:
    return measurements.rates(SPACE, measurements.simulate_rates(SPACE, 11))


def test_the_engine_has_the_rates_of_the_formula(rates: pd.DataFrame) -> None:
    assert not failing([draws.rate_check(rates)])
    assert rates["distance"].is_monotonic_increasing
    # Each distance has draws of its own, so their deviations are independent.
    assert ((rates["mean"] - rates["known"]) / rates["error"]).nunique() == len(rates)


def test_other_rates_are_refuted(rates: pd.DataFrame) -> None:
    assert failing([draws.rate_check(rates.assign(mean=1.01 * rates["mean"]))])
    one = rates.copy()
    one.loc[2, "mean"] += 6 * one.loc[2, "error"]
    assert failing([draws.rate_check(one)])


def test_without_shadowing_the_rates_are_exact() -> None:
    still = load_scenario("paper", shadowing_variance=0.0)
    table = measurements.rates(still, measurements.simulate_rates(still, 11)).assign(error=0.0)
    check = draws.rate_check(table)
    assert check.p is None and not failing([check])
    assert failing([draws.rate_check(table.assign(mean=1.0001 * table["mean"]))])


def test_shadowing_is_normal_and_independent() -> None:
    deviates = measurements.deviates(SPACE, measurements.simulate_slots(SPACE, 11, slots=800))
    assert len(deviates) == 800 * SPACE.communication_slots
    assert not failing(draws.shadowing_checks(deviates))
    assert failing(draws.shadowing_checks(1.1 * deviates))
    assert failing(draws.shadowing_checks(np.repeat(deviates[::2], 2)))
