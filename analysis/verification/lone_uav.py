"""A single UAV that hovers near a single node, to observe the channel without selection.

In a mission, UAVs serve the node with the highest SNR, so the data that they collect are not a
random sample of the channel. With one node there is no choice, and the data of every communication
slot are one random draw of the rate::

    means = simulate_rates(space, seed)  # by the batch engine
    rates(space, means)  # beside the closed form
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from analysis.verification import closed_forms
from dess import simulate, simulate_batch
from dess.scenario import ScenarioSpace
from dess.state import HOVER
from dess.view import View

MISSIONS, SLOTS = 200, 100  # missions per distance and slots per mission, with the batch engine
LONG = 5000  # mission slots of the mission with the SimPy engine

_PLENTY = 1e9  # data units at the node, more than the UAV can collect


class Hovering:
    """A policy that hovers in every slot."""

    name = "hovering"

    def act(self, view: View) -> np.ndarray:
        """Choose Hover for all R rows."""
        return np.full(len(view.uav), HOVER)


def alone(space: ScenarioSpace, dx: int, dy: int, slots: int) -> ScenarioSpace:
    """A scenario with the same channel, one UAV and one node ``dx, dy`` cells away.

    The mission lasts ``slots`` slots. The battery does not decrease, and the node is never empty.
    """
    still: dict[str, Any] = {"uavs": 1, "flying_time": 100, "flight_cost": 0, "pads": None}
    place: dict[str, Any] = {"zone": (0, 0, 1, 1), "nodes": ((dx, dy),)}
    data: dict[str, Any] = {"initial_data": _PLENTY, "arrival_rate": 0.0}
    quota = slots * space.communication_slots
    return ScenarioSpace.of(space, **still, **place, **data, quota=quota, max_slots=slots)


def offsets(space: ScenarioSpace) -> list[tuple[int, int]]:
    """Offsets of the node from the UAV [cells], from none up to the whole grid."""
    along = [0, *(2**k for k in range(8) if 2**k < space.grid)]
    return [*((d, 0) for d in along), (space.grid - 1, space.grid - 1)]


def simulate_rates(space: ScenarioSpace, seed: int) -> list[float]:
    """Mean rates at all offsets with the batch engine [data units per communication slot].

    Every offset has its own replications, because the same replications have the same shadowing.
    """
    means = []
    for number, (dx, dy) in enumerate(offsets(space)):
        replications = range(number * MISSIONS, (number + 1) * MISSIONS)
        scenario = alone(space, dx, dy, SLOTS)
        missions = simulate_batch(scenario, Hovering(), seed, replications).missions
        means.append(float(missions["collected"].sum() / _draws(space)))
    return means


def simulate_slots(space: ScenarioSpace, seed: int, slots: int = LONG) -> list[float]:
    """Data of every communication slot of a mission with the SimPy engine [data units]."""
    scenario = alone(space, space.grid // 2, 0, slots)
    log = simulate(scenario, Hovering(), seed, len(offsets(space)) * MISSIONS, events=True).events
    assert log is not None
    columns = log.columns()
    return columns["value"][columns["event"] == "communication"].tolist()


def rates(space: ScenarioSpace, means: Sequence[float]) -> pd.DataFrame:
    """The rates of ``simulate_rates`` together with those of the closed form.

    Returns:
        A row per distance: ``distance`` [m], ``n`` communication slots, ``mean`` [data units per
        communication slot], ``known`` and ``error``, the closed form's mean and the standard error
        of a mean of n draws.
    """
    rows, n = [], _draws(space)
    for (dx, dy), mean in zip(offsets(space), means, strict=True):
        distance = float(closed_forms.distance(space, dx, dy))
        known, deviation = closed_forms.rate_moments(space, distance)
        rows.append((distance, n, mean, known, deviation / np.sqrt(n)))
    return pd.DataFrame(rows, columns=["distance", "n", "mean", "known", "error"])


def deviates(space: ScenarioSpace, collected: Sequence[float]) -> np.ndarray:
    """The shadowing in the data of ``simulate_slots``, in standard deviations.

    The SNR follows from the data of a communication slot (eq. 9), the shadowing from the SNR
    (eq. 10).
    """
    distance = closed_forms.distance(space, space.grid // 2, 0)
    snr = closed_forms.snr_of(space, np.array(collected))
    return (snr - closed_forms.mean_snr(space, distance)) / np.sqrt(space.shadowing_variance)


def _draws(space: ScenarioSpace) -> int:
    """The number of communication slots per distance."""
    return MISSIONS * SLOTS * space.communication_slots
