"""The arrivals of packets in continuous time, and their integrated rate."""

from collections.abc import Sequence

import numpy as np

from dess.scenario import ScenarioSpace
from dess.sections.arrivals import draw_arrival, factors_of, sources_of
from dess.state import constants_of


def arrivals_of(space: ScenarioSpace, k: int, seed: int = 1, replication: int = 0) -> np.ndarray:
    """The times [slots] of all arrivals at node ``k`` until the last slot of a mission."""
    missions = constants_of(space)
    missions["seed"], missions["replication"] = seed, replication
    sources = sources_of(space.arrivals, space.arrival_rate, len(space.nodes))
    factors = factors_of(space.arrivals)
    found = []
    while sources["time"][k] < np.inf:
        draw_arrival(missions, sources, *factors, k)
        found.append(sources["time"][k])
    return np.array(found[:-1])


def integrated(
    times: np.ndarray, schedule: Sequence[tuple[float, float]], end: float
) -> np.ndarray:
    """The integral of the factor of a schedule from 0 to each time, for times up to ``end``.

    In this time, the arrivals of a process with the rate 1 are a Poisson process of rate 1.
    """
    edges = np.array([0.0, *(slot for slot, _ in schedule), end])
    factors = np.array([1.0, *(factor for _, factor in schedule)])
    areas = np.concatenate([[0.0], (factors * np.diff(edges)).cumsum()])
    return np.interp(times, edges, areas)
