"""What is known of queues and ages in closed form, and what the simulator makes of it::

    checks(simulate(space, seed=1, batches=50), space)

A check compares the mean of several batches with the closed form by a t-test. The batches of the
charging zone follow one another, and are long enough to be nearly independent; one more is left out
at the beginning, since its first customers come to an empty zone. All other batches are runs of
their own, of so many customers that the first ones do not matter.
"""

from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import stats

from analysis.numbers import decimals
from analysis.stats.intervals import mean_interval
from analysis.verification.checks import QUEUES, Check
from analysis.verification.closed_forms import Moments
from analysis.verification.queues import theory
from analysis.verification.queues.pads import Station
from analysis.verification.queues.server import Server, ages_of, mission_above, visited
from analysis.verification.queues.sources import arrivals_of, integrated
from dess.scenario import ScenarioSpace

CUSTOMERS = 1000  # in a batch
SLOTS = 400  # of a mission; each mission is a batch
LOAD = 0.5  # arrivals per service, of all systems with a queue
CHARGING = 6.0  # mean time on a pad [slots]
PLACES = 3  # of the finite buffers
GAP = 3.0  # mean time between visits of a node [slots]
RATE = 2.0  # packets per slot of the thinned process, where the factor is 1
SCHEDULE = ((100.0, 3.0), (400.0, 0.0), (500.0, 0.25), (1500.0, 2.0))
END = 3000.0  # of the thinned process [slots]

_VISITED = "Node visited at fixed gaps"
_THINNED = "Thinned arrivals"

AGES = 3  # of the visits at fixed gaps: mean, peak and 99th percentile

Measured = dict[str, list[Annotated[float, Field(ge=0, le=1e9)]]]


class System(NamedTuple):
    """A system, what is known of it, and how it is simulated.

    Attributes:
        name: What it is.
        known: The closed forms, by what is measured.
        run: Simulates that many batches; returns a value per batch for each of ``known``.
    """

    name: str
    known: dict[str, float]
    run: Callable[[int], Mapping[str, Any]]

    @property
    def tests(self) -> dict[str, str]:
        """The names of the checks, by what is measured."""
        return {what: f"{self.name}: {what}" for what in self.known}


def systems(space: ScenarioSpace, seed: int) -> list[System]:
    """All systems whose batches are compared with closed forms.

    Args:
        space: The scenario whose channel and communication slots the missions have.
        seed: Seed of all draws.
    """

    def each(
        measure: Callable[[ScenarioSpace, int, int, int], dict[str, float]], places: int = 0
    ) -> Callable[[int], pd.DataFrame]:
        """Batches that are runs of their own, each with a replication."""
        return lambda batches: pd.DataFrame(
            [measure(space, seed, r, places) for r in range(batches)]
        )

    gap = 1 / space.communication_slots
    loss, number = theory.loss_of_mm1k(LOAD, PLACES), theory.number_in_mm1k(LOAD, PLACES)
    endless = {
        "time in the buffer": theory.waiting_of_mmc(LOAD, 1.0, 1) + 1.0,
        "age": theory.age_of_mm1(LOAD, 1.0),
    }
    finite = {
        "share of packets lost": loss,
        "packets in the buffer": number,
        "time in the buffer": number / (LOAD * (1 - loss)),
    }
    slotted = {"latency": theory.latency_of_slotted_md1(LOAD / gap, gap)}
    slotted_finite = {"share of packets lost": theory.loss_of_slotted_md1k(LOAD, PLACES)}
    visits = {"age": GAP, "peak age": GAP}  # E[X^2] / (2 E[X]) and E[X] of the gaps X
    return [
        *(_zone(pads, seed) for pads in (1, 2, 3)),
        _zone(1, seed, fixed=True),
        System("Buffer with a server, M/M/1", endless, each(_served)),
        System(f"Buffer with a server, M/M/1/{PLACES}", finite, each(_served, PLACES)),
        System("Mission of a UAV above a node, M/D/1", slotted, each(_flown)),
        System(
            f"Mission of a UAV above a node, M/D/1/{PLACES}", slotted_finite, each(_flown, PLACES)
        ),
        System("Node visited at exponential gaps", visits, partial(_visits, seed)),
    ]


def _zone(pads: int, seed: int, fixed: bool = False) -> System:
    """The charging zone, where UAVs charge for exponential times, or all for the same time."""
    arrivals = LOAD * pads / CHARGING
    waiting = theory.waiting_of_mmc(arrivals, CHARGING, pads)
    if fixed:
        waiting = theory.waiting_of_mg1(arrivals, Moments(CHARGING, 0.0))

    def run(batches: int) -> dict[str, np.ndarray]:
        generator, count = np.random.default_rng([seed, pads]), (batches + 1) * CUSTOMERS
        gaps = generator.exponential(1 / arrivals, count)
        times = np.full(count, CHARGING) if fixed else generator.exponential(CHARGING, count)
        station = Station(pads, gaps, times)
        waits, queues, lasted = (
            values.reshape(-1, CUSTOMERS)[1:].mean(1)  # without the first batch
            for values in (station.waits, station.queues, gaps)
        )
        return {"waiting time": waits, "queue length": queues / lasted}

    name = f"Charging zone, M/{'D' if fixed else 'M'}/{pads}"
    return System(name, {"waiting time": waiting, "queue length": arrivals * waiting}, run)


def _served(space: ScenarioSpace, seed: int, replication: int, places: int) -> dict[str, float]:
    """A buffer whose packets arrive as in the model, and are served in exponential times of mean 1.

    Args:
        space, seed, replication: Those of the arrivals.
        places: Packets that the buffer can hold; 0 for no limit.
    """
    world = _continuous(space, arrival_rate=LOAD, max_slots=round(CUSTOMERS / LOAD))
    times = arrivals_of(world, 0, seed, replication)
    work = np.random.default_rng([seed, replication]).exponential(1.0, len(times))
    server = Server(times, work, places)
    buffers = server.buffers
    done = buffers.packets[buffers.delivered]
    return {
        "share of packets lost": buffers.lost / len(buffers.all),
        "packets in the buffer": server.numbers.sum() / times[-1],
        "time in the buffer": (done["left"] - done["generated"]).mean(),
        "age": ages_of(buffers, done["left"].max())[0],
    }


def _flown(space: ScenarioSpace, seed: int, replication: int, places: int) -> dict[str, float]:
    """A mission of a UAV above a node; the arguments are those of ``_served``."""
    arrivals = {"process": "continuous", "buffer": places}
    record = mission_above(space, LOAD, seed, replication, max_slots=SLOTS, arrivals=arrivals)
    return {
        "latency": record.latency,
        "share of packets lost": record.lost_packets / record.generated,
    }


def _visits(seed: int, batches: int) -> pd.DataFrame:
    gaps = np.random.default_rng([seed, 99]).exponential(GAP, (batches, CUSTOMERS))
    ages = [ages_of(visited(times), times[-1]) for times in gaps.cumsum(1)]
    return pd.DataFrame(ages, columns=["age", "peak age", "percentile"])


def _continuous(space: ScenarioSpace, **changes: Any) -> ScenarioSpace:
    return ScenarioSpace.of(space, **{"arrivals": {"process": "continuous"}} | changes)


def simulate(space: ScenarioSpace, seed: int, batches: int) -> Measured:
    """Simulate all systems.

    Args:
        space: The scenario whose channel and communication slots the missions have.
        seed: Seed of all draws.
        batches: Number of batches, at least 2.

    Returns:
        For each check a value per batch; of the visits at fixed gaps the ages, and of the thinned
        process the times of all arrivals.
    """
    measured: Measured = {}
    for system in systems(space, seed):
        values = system.run(batches)
        measured |= {test: values[what].tolist() for what, test in system.tests.items()}
    times = np.arange(1, CUSTOMERS + 1) * GAP
    measured[_VISITED] = [*ages_of(visited(times), times[-1])]
    schedule = {"process": "continuous", "schedule": SCHEDULE}
    thinned = _continuous(space, arrival_rate=RATE, max_slots=int(END), arrivals=schedule)
    measured[_THINNED] = arrivals_of(thinned, 0, seed).tolist()
    return measured


def fits(measured: Measured, space: ScenarioSpace) -> bool:
    """Whether values may be those of ``simulate``: as many, and times that grow."""
    least = dict.fromkeys(_known(space), 2) | {_VISITED: AGES, _THINNED: 2}
    return (
        measured.keys() == least.keys()
        and all(len(values) >= least[name] for name, values in measured.items())
        and len(measured[_VISITED]) == AGES
        and all(0 <= a < b < END for a, b in pairwise(measured[_THINNED]))
    )


def _known(space: ScenarioSpace) -> dict[str, float]:
    """The closed forms by the name of their check."""
    return {
        system.tests[what]: value
        for system in systems(space, 0)
        for what, value in system.known.items()
    }


def checks(measured: Measured, space: ScenarioSpace) -> list[Check]:
    """Compare what ``simulate`` has measured with the closed forms."""
    known = _known(space)
    of_batches = [_batch_check(test, known[test], measured[test]) for test in known]
    thinned = _thinning_checks(np.array(measured[_THINNED]))
    return [*of_batches, _visits_check(measured[_VISITED]), *thinned]


def _batch_check(test: str, known: float, values: list[float]) -> Check:
    seen = decimals(*mean_interval(values), digits=4)
    return Check(QUEUES, test, f"{known:.4f}", seen, len(values), p_value(np.array(values), known))


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


def _visits_check(ages: list[float]) -> Check:
    """The age is uniform from 0 to the gap."""
    known = (GAP / 2, GAP, 0.99 * GAP)
    error = max(abs(age - value) for age, value in zip(ages, known, strict=True))
    test = f"{_VISITED}: mean, peak and 99th percentile of the age"
    seen, expected = (", ".join(f"{age:.4g}" for age in row) for row in (ages, known))
    return Check.exact(QUEUES, test, expected, seen, CUSTOMERS, error, bound=1e-9)


def _thinning_checks(times: np.ndarray) -> list[Check]:
    """In the integrated rate, arrivals are a Poisson process of rate 1; none comes at rate 0."""
    own, total = (RATE * integrated(t, SCHEDULE, END) for t in (times, np.array([END])))
    gaps = np.diff(own, prepend=0.0)
    p, n = float(stats.kstest(gaps, "expon").pvalue), len(times)
    test, whole = f"{_THINNED}: gaps in the integrated rate, Kolmogorov-Smirnov", float(total[0])
    return [
        Check(QUEUES, test, "exponential, mean 1", f"mean {gaps.mean():.4f}", n, p),
        Check.normal(QUEUES, f"{_THINNED}: number", whole, n, np.sqrt(whole), n, digits=0),
    ]
