"""Poisson processes in continuous time; tests/dess/queues has their thinning."""

from typing import Any

from scipy.stats import poisson

from dess.scenario import ScenarioSpace, load_scenario
from tests.dess.queues.model import arrivals_of


def _space(**arrivals: Any) -> ScenarioSpace:
    values = {f"arrivals.{name}": value for name, value in arrivals.items()}
    return load_scenario("paper", **{"arrivals.process": "continuous"} | values)


def test_a_node_has_its_own_rate() -> None:
    rates = [0.0, 5.0, *[0.1] * 23]
    space = ScenarioSpace.of(_space(rates=rates), max_slots=1000)
    assert len(arrivals_of(space, 0)) == 0
    assert 0.01 < poisson.cdf(len(arrivals_of(space, 1)), 5000) < 0.99
    assert 0.01 < poisson.cdf(len(arrivals_of(space, 2)), 100) < 0.99
