"""A lone UAV that hovers within reach of a single node: the channel without anybody's choice.

In a mission UAVs serve the node that they hear best, so what they collect is no fair sample of
the channel. Here there is nothing to choose, and a communication slot is one draw of the rate.
"""

from typing import Any

import numpy as np
import pandas as pd

from analysis.verification import closed_forms
from dess import simulate, simulate_batch
from dess.scenario import ScenarioSpace
from dess.state import HOVER
from dess.view import View

_PLENTY = 1e9  # data units: more than anybody takes
MISSIONS, SLOTS = 200, 100  # per distance


class Still:
    """Hovers, whatever happens."""

    name = "still"

    def act(self, view: View) -> np.ndarray:
        """(R,) hovering."""
        return np.full(len(view.uav), HOVER)


def alone(space: ScenarioSpace, dx: int, dy: int, slots: int) -> ScenarioSpace:
    """The channel of a scenario, with one UAV and one node ``dx, dy`` cells away.

    The mission lasts that many slots: the battery does not decrease and the node never runs dry.
    """
    still: dict[str, Any] = {"uavs": 1, "flying_time": 100, "flight_cost": 0, "pads": None}
    place: dict[str, Any] = {"zone": (0, 0, 1, 1), "nodes": ((dx, dy),)}
    data: dict[str, Any] = {"initial_data": _PLENTY, "arrival_rate": 0.0}
    quota = slots * space.communication_slots
    return ScenarioSpace.of(space, **still, **place, **data, quota=quota, max_slots=slots)


def offsets(space: ScenarioSpace) -> list[tuple[int, int]]:
    """Where the node stands from the UAV [cells]: below it, ever farther off, across the grid."""
    along = [0, *(2**k for k in range(8) if 2**k < space.grid)]
    return [*((d, 0) for d in along), (space.grid - 1, space.grid - 1)]


def rates(space: ScenarioSpace, seed: int) -> pd.DataFrame:
    """Mean rates by the batch engine at several distances, beside those of the closed form.

    Every distance has replications of its own: otherwise all would meet the same shadowing.

    Returns:
        A row per distance: ``distance`` [m], ``n`` communication slots, ``mean`` [data units per
        communication slot], ``known`` and ``error``, the closed form's mean and the standard error
        of a mean of n draws.
    """
    rows = []
    for number, (dx, dy) in enumerate(offsets(space)):
        which = range(number * MISSIONS, (number + 1) * MISSIONS)
        missions = simulate_batch(alone(space, dx, dy, SLOTS), Still(), seed, which).missions
        n = MISSIONS * SLOTS * space.communication_slots
        away = float(closed_forms.distance(space, dx, dy))
        known, deviation = closed_forms.rate_moments(space, away)
        rows.append((away, n, missions["collected"].sum() / n, known, deviation / np.sqrt(n)))
    return pd.DataFrame(rows, columns=["distance", "n", "mean", "known", "error"])


def deviates(space: ScenarioSpace, seed: int, slots: int = 5000) -> np.ndarray:
    """Shadowing as told by the event log of the SimPy engine, in standard deviations.

    What a communication slot carried gives its SNR (eq. 9), and that its shadowing (eq. 10).
    """
    here = alone(space, space.grid // 2, 0, slots)
    log = simulate(here, Still(), seed, len(offsets(space)) * MISSIONS, events=True).events
    assert log is not None
    columns = log.columns()
    collected = columns["value"][columns["event"] == "communication"]
    away = closed_forms.distance(space, space.grid // 2, 0)
    shadowing = closed_forms.snr_of(space, collected) - closed_forms.mean_snr(space, away)
    return shadowing / np.sqrt(space.shadowing_variance)
