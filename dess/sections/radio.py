"""The radio as data sheets have it: an SNR at a distance, a range, and a largest rate."""

from typing import Any

import numpy as np
from pydantic import Field

from dess.sea.chart import NO_FLY
from dess.sections.section import Number, Section, for_sections


class Radio(Section):
    """The radio beyond ``edge_snr`` and ``path_loss_exponent``."""

    anchor: Number = Field(
        0.0,
        ge=0,
        le=1e6,
        description="distance at which the mean SNR is edge_snr [m]; 0 for half the grid's "
        "diagonal",
    )
    range: Number = Field(
        0.0, ge=0, le=1e7, description="distance beyond which there is no service [m]; 0 for none"
    )
    max_rate: Number = Field(
        0.0, ge=0, le=1000, description="largest spectral efficiency [bit/s/Hz]; 0 for none"
    )


@for_sections
def has_max_rate(mission):
    """Whether the modulation ends somewhere."""
    return mission.max_rate > 0.0


@for_sections
def has_range(mission):
    """Whether there are places without service."""
    return mission.covered > 0.0


def covered(scenario: Any) -> float:
    """The share of the open cells of a scenario from which a node is in range."""
    cells = np.argwhere(scenario.chart.zones.T != NO_FLY)
    reach = scenario.radio.range**2 - scenario.altitude**2
    is_near = np.zeros(len(cells), bool)
    for node in scenario.nodes:
        is_near |= ((cells - node) ** 2).sum(1) * scenario.cell_size**2 <= reach
    return float(is_near.mean())
