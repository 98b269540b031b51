"""Queues and ages of the simulator have the means that theory knows.

The means of several batches are compared with a closed form by a t-test. The batches of the
charging zone follow one another, and are long enough to be nearly independent; one more is left out
at the beginning, since its first customers come to an empty zone. All other batches are runs of
their own, of so many customers that the first ones do not matter.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy import stats

from dess.analysis.verification.closed_forms import Moments
from dess.scenario import ScenarioSpace, load_scenario
from tests.dess.queues import theory
from tests.dess.queues.model import (
    Station,
    ages_of,
    arrivals_of,
    integrated,
    mission_above,
    visited,
)

BATCHES, CUSTOMERS = 10, 1000  # customers in a batch
SLOTS = 400  # of a mission; each mission is a batch
LOAD = 0.5  # arrivals per service, of all systems with a queue
CHARGING = 6.0  # mean time on a pad [slots]
PLACES = 3  # of the finite buffers
GAP = 3.0  # mean time between visits of a node [slots]
RATE = 2.0  # packets per slot of the thinned process, where the factor is 1
SCHEDULE = ((100.0, 3.0), (400.0, 0.0), (500.0, 0.25), (1500.0, 2.0))
END = 3000.0  # of the thinned process [slots]
SPACE, SEED = load_scenario("paper"), 1
LEAST = 0.001  # of a p-value; draws are fixed, so a test passes always or never

Means = dict[str, Any]


def _zone(pads: int, is_fixed: bool = False) -> tuple[Means, Means]:
    """The charging zone, where UAVs charge for exponential times, or all for the same time."""
    arrivals = LOAD * pads / CHARGING
    waiting = theory.waiting_of_mmc(arrivals, CHARGING, pads)
    if is_fixed:
        waiting = theory.waiting_of_mg1(arrivals, Moments(CHARGING, 0.0))
    generator, count = np.random.default_rng([SEED, pads]), (BATCHES + 1) * CUSTOMERS
    gaps = generator.exponential(1 / arrivals, count)
    times = np.full(count, CHARGING) if is_fixed else generator.exponential(CHARGING, count)
    station = Station(pads, gaps, times)
    waits, queues, lasted = (
        values.reshape(-1, CUSTOMERS)[1:].mean(1)  # without the first batch
        for values in (station.waits, station.queues, gaps)
    )
    known = {"waiting time": waiting, "queue length": arrivals * waiting}
    return known, {"waiting time": waits, "queue length": queues / lasted}


def _mission(places: int) -> tuple[Means, Means]:
    """Missions of a UAV above a node, which serves a packet in each communication slot."""
    gap, arrivals = 1 / SPACE.communication_slots, {"process": "continuous", "buffer": places}
    records = [
        mission_above(SPACE, LOAD, SEED, r, max_slots=SLOTS, arrivals=arrivals)
        for r in range(BATCHES)
    ]
    if not places:
        known = {"latency": theory.latency_of_slotted_md1(LOAD / gap, gap)}
        return known, {"latency": np.array([r.latency for r in records])}
    lost = np.array([r.lost_packets / r.generated for r in records])
    return {"lost": theory.loss_of_slotted_md1k(LOAD, PLACES)}, {"lost": lost}


def _visits() -> tuple[Means, Means]:
    """Ages of a node visited at exponential gaps X: E[X^2] / (2 E[X]) and E[X]."""
    gaps = np.random.default_rng([SEED, 99]).exponential(GAP, (BATCHES, CUSTOMERS))
    age, peak, _ = np.transpose([ages_of(visited(times), times[-1]) for times in gaps.cumsum(1)])
    return {"age": GAP, "peak age": GAP}, {"age": age, "peak age": peak}


def _continuous(**changes: Any) -> ScenarioSpace:
    return ScenarioSpace.of(SPACE, **{"arrivals": {"process": "continuous"}} | changes)


def p_value(values: np.ndarray, known: float) -> float:
    """The p-value of a mean by Student's t, transformed for skewed values, as waiting times are.

    P. Hall: On the removal of skewness by transformation, Journal of the Royal Statistical Society
    B 54, 1992.
    """
    n, deviation = len(values), values.std(ddof=1)
    skew = (((values - values.mean()) / deviation) ** 3).mean()
    off = (values.mean() - known) / deviation
    t = np.sqrt(n) * (off + skew * off**2 / 3 + skew**2 * off**3 / 27 + skew / (6 * n))
    return float(2 * stats.t.sf(abs(t), n - 1))


SYSTEMS: dict[str, Callable[[], tuple[Means, Means]]] = {
    **{f"zone, M/M/{pads}": partial(_zone, pads) for pads in (1, 2, 3)},
    "zone, M/D/1": partial(_zone, 1, is_fixed=True),
    "mission, M/D/1": partial(_mission, 0),
    f"mission, M/D/1/{PLACES}": partial(_mission, PLACES),
    "visits at exponential gaps": _visits,
}


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_queue_has_the_means_that_theory_knows(system):
    known, measured = SYSTEMS[system]()
    for what, mean in known.items():
        assert p_value(measured[what], mean) > LEAST
        assert p_value(2 * measured[what], mean) < LEAST


def test_the_age_of_a_node_visited_at_fixed_gaps_is_uniform():
    times = np.arange(1, CUSTOMERS + 1) * GAP
    assert ages_of(visited(times), times[-1]) == pytest.approx((GAP / 2, GAP, 0.99 * GAP))


def test_thinned_arrivals_are_a_poisson_process_in_the_integrated_rate():
    schedule = {"process": "continuous", "schedule": SCHEDULE}
    world = _continuous(arrival_rate=RATE, max_slots=int(END), arrivals=schedule)
    times = arrivals_of(world, 0, SEED)
    own, total = (RATE * integrated(t, SCHEDULE, END) for t in (times, np.array([END])))
    assert stats.kstest(np.diff(own, prepend=0.0), "expon").pvalue > LEAST
    assert stats.poisson(total[0]).sf(len(times)) > LEAST < stats.poisson(total[0]).cdf(len(times))


def test_a_node_has_its_own_rate():
    rates = {"process": "continuous", "rates": [0.0, 5.0, *[0.1] * 23]}
    world = _continuous(max_slots=1000, arrivals=rates)
    assert len(arrivals_of(world, 0)) == 0
    assert 0.01 < stats.poisson.cdf(len(arrivals_of(world, 1)), 5000) < 0.99
    assert 0.01 < stats.poisson.cdf(len(arrivals_of(world, 2)), 100) < 0.99
