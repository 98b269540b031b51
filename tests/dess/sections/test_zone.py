"""The charging zone as a queue: against the waiting times that theory gives."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import simpy
from scipy import stats

from analysis.verification.closed_forms import Moments, waiting_of_mg1, waiting_of_mmc
from dess.sections.zone import ChargingZone
from dess.state import MISSION, UAV

UAVS = 100  # more than are ever in the zone at the same time
CUSTOMERS, BATCHES = 20_000, 20


class Station:
    """UAVs that come to a charging zone at the times of a Poisson process, one after the other.

    Attributes:
        waits: The time that each of them has waited for a pad.
        queue: The integral of the number of waiting UAVs over time.
    """

    def __init__(self, pads: int, gaps: np.ndarray, times: np.ndarray):
        mission, self.uavs = np.zeros(1, MISSION), np.zeros(UAVS, UAV)
        mission["pads"], mission["uavs"] = pads, UAVS
        self.env = simpy.Environment()
        self.zone = ChargingZone(self.env, mission[0], self.uavs)
        self.waits = np.full(len(gaps), np.nan)
        self.queue, self._changed = 0.0, 0.0
        self._came = np.zeros(UAVS)
        self.env.process(self._arrivals(gaps, times))
        self.env.run()

    def _arrivals(self, gaps: np.ndarray, times: np.ndarray) -> Iterator[simpy.Event]:
        self._times = times
        for number, gap in enumerate(gaps):
            yield self.env.timeout(gap)
            uav = self.zone.requests.index(None)
            self.uavs[uav]["pad_request"], self._came[uav] = number, self.env.now
            self._serve(lambda uav=uav: self.zone.ask(uav))

    def _serve(self, change: Callable[[], Any]) -> None:
        """Make a change in the zone, and grant the pads that are free after it."""
        self.queue += len(self.zone.queue) * (self.env.now - self._changed)
        self._changed = self.env.now
        change()
        for uav in self.zone.grant():
            number = self.uavs[uav]["pad_request"]
            self.waits[number] = self.env.now - self._came[uav]
            done = self.env.timeout(self._times[number])
            assert done.callbacks is not None
            done.callbacks.append(lambda _, uav=uav: self._serve(lambda: self.zone.leave(uav)))


def _interval(waits: np.ndarray) -> tuple[float, float]:
    """A 99 % interval of the mean waiting time, by batch means."""
    means = waits.reshape(BATCHES, -1).mean(1)
    half = stats.t.ppf(0.995, BATCHES - 1) * means.std(ddof=1) / np.sqrt(BATCHES)
    return means.mean() - half, means.mean() + half


@pytest.mark.parametrize(
    ("pads", "charging"),
    [(1, "exponential"), (2, "exponential"), (5, "exponential"), (1, "deterministic")],
)
def test_the_zone_is_the_queue_of_theory(pads: int, charging: str) -> None:
    """M/M/c, and M/D/1, with 70 % of the pads in use."""
    generator = np.random.default_rng(pads)
    arrivals, mean = 0.7 * pads / 6.0, 6.0
    gaps = generator.exponential(1 / arrivals, CUSTOMERS)
    times = np.full(CUSTOMERS, mean)
    if charging == "exponential":
        times = generator.exponential(mean, CUSTOMERS)
        known = waiting_of_mmc(arrivals, mean, pads)
    else:
        known = waiting_of_mg1(arrivals, Moments(mean, 0.0))
    station = Station(pads, gaps, times)
    low, high = _interval(station.waits)
    assert low < known < high
    assert (high - low) / 2 < 0.3 * known
    # Little's law: the queue's mean length is that of theory, within the same interval
    length = station.queue / gaps.sum()
    assert station.queue == pytest.approx(station.waits.sum())
    assert low < length / arrivals < high


def test_a_queue_longer_than_theory_is_noticed() -> None:
    """Charging times that are 10 % longer do not fit the formula."""
    generator = np.random.default_rng(1)
    arrivals, mean = 0.7 / 6.0, 6.0
    gaps = generator.exponential(1 / arrivals, CUSTOMERS)
    station = Station(1, gaps, 1.1 * generator.exponential(mean, CUSTOMERS))
    low, _ = _interval(station.waits)
    assert low > waiting_of_mmc(arrivals, mean, 1)
