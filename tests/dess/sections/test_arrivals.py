"""Poisson processes in continuous time: their gaps, thinning, and what is refused."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest, poisson

from analysis.verification.queues.sources import arrivals_of, integrated
from dess import InputError
from dess.scenario import ScenarioSpace, load_scenario


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


# --- scenarios ---


@pytest.mark.parametrize(
    ("arrivals", "message"),
    [
        ({"process": "slotted", "buffer": 3}, "process: slotted .*allowed: continuous"),
        ({"process": "slotted", "service": "newest"}, "process: slotted"),
        ({"rates": [0.1]}, "arrivals.rates: there are 1 rates for 25 nodes"),
        ({"rates": [-0.1] * 25}, "arrivals.rates"),
        ({"schedule": [[3, 1], [3, 2]]}, "schedule: slot 3 comes after slot 3"),
        ({"schedule": [[3, 101]]}, "arrivals.schedule"),
        ({"buffer": -1}, "arrivals.buffer: -1 is out of range"),
        ({"process": "poisson"}, "arrivals.process: .* allowed: slotted, continuous"),
    ],
)
def test_arrivals_that_make_no_sense_are_refused(arrivals: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        _space(**arrivals)
