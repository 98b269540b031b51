"""The link budget: the mean SNR of a node at a distance, and how far it is served (eq. 10)."""

import math
from typing import NamedTuple

import numpy as np

from dess.base.elementary import hypot, log10
from dess.scenario.fields import Fields


class Link(NamedTuple):
    """The link budget: all on which the mean SNR at a distance depends.

    Attributes:
        edge_snr: The mean SNR at ``snr_distance`` [dB].
        snr_distance: The distance at which it holds [m].
        path_loss_exponent: The exponent of the path loss.
        altitude: The altitude of the UAVs [m].
        range: The distance beyond which there is no service [m], 0 for none.
    """

    edge_snr: float
    snr_distance: float
    path_loss_exponent: float
    altitude: float
    range: float

    @classmethod
    def of(cls, scenario: Fields) -> "Link":
        """The link budget of a scenario."""
        return cls(
            scenario.edge_snr,
            scenario.snr_distance,
            scenario.path_loss_exponent,
            scenario.altitude,
            scenario.radio.range,
        )


def mean_snr_at(link: Link, horizontal: np.ndarray) -> np.ndarray:
    """The mean SNR [dB] at horizontal distances [m], minus infinity out of range (eq. 10)."""
    distance = hypot(horizontal, link.altitude)
    loss = 10 * link.path_loss_exponent * log10(distance / link.snr_distance)
    reach = link.range or math.inf
    return np.where(distance <= reach, link.edge_snr - loss, -math.inf)


def least_snr(scenario: Fields) -> float:
    """The least mean SNR [dB] at which a node is served: that of the lowest of its rates."""
    if scenario.radio.steps:
        return scenario.radio.steps[0][0]
    return -math.inf


def service_cells(scenario: Fields) -> int:
    """The largest whole distance [cells] at which nodes are served by their mean SNR; 0 for none.

    It is no longer than the longer side of the grid, as it is without a limit of the radio.
    """
    cells = np.arange(max(scenario.size) + 1)
    snr = mean_snr_at(Link.of(scenario), scenario.cell_size * cells)
    is_served = (snr > -math.inf) & (snr >= least_snr(scenario))
    return max(int(np.count_nonzero(is_served)) - 1, 0)
