"""Poisson processes in continuous time: their gaps, thinning, and what is refused."""

from typing import Any

import numpy as np
from scipy.stats import kstest, poisson

from dess.scenario import ScenarioSpace, load_scenario
from tests.dess.queues.model import arrivals_of, integrated


def _space(**arrivals: Any) -> ScenarioSpace:
    values = {f"arrivals.{name}": value for name, value in arrivals.items()}
    return load_scenario("paper", **{"arrivals.process": "continuous"} | values)


SCHEDULE = ((100.0, 3.0), (400.0, 0.0), (500.0, 0.25), (1500.0, 2.0))


def test_thinned_arrivals_fit_the_integrated_rate() -> None:
    """In the time of the integrated rate, arrivals are a Poisson process of rate 1."""
    space = ScenarioSpace.of(_space(schedule=SCHEDULE), arrival_rate=2.0, max_slots=3000)
    times = arrivals_of(space, 7)
    assert not ((times >= 400) & (times < 500)).any()
    own_time = 2.0 * integrated(times, SCHEDULE, 3000.0)
    total = 2.0 * integrated(np.array([3000.0]), SCHEDULE, 3000.0)[0]
    assert kstest(np.diff(own_time, prepend=0.0), "expon").pvalue > 0.01
    assert kstest(own_time / total, "uniform").pvalue > 0.01
    assert 0.01 < poisson.cdf(len(times), total) < 0.99


def test_a_node_has_its_own_rate() -> None:
    rates = [0.0, 5.0, *[0.1] * 23]
    space = ScenarioSpace.of(_space(rates=rates), max_slots=1000)
    assert len(arrivals_of(space, 0)) == 0
    assert 0.01 < poisson.cdf(len(arrivals_of(space, 1)), 5000) < 0.99
    assert 0.01 < poisson.cdf(len(arrivals_of(space, 2)), 100) < 0.99
