"""The radio as data sheets have it: an SNR at a distance, a range, and the rates that it has.

Without steps, the rate grows with the SNR up to a largest one. With steps, such as those of LoRa's
spreading factors, it is that of the highest step that the SNR reaches, and below the lowest step
there is no service.
"""

from itertools import pairwise
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from dess.base.descriptions import Description
from dess.base.errors import InputError
from dess.physics.section import Number, Section, for_sections

MOST_STEPS = 32

Snr = Annotated[Number, Field(ge=-300, le=300)]
Efficiency = Annotated[Number, Field(ge=1e-9, le=1000)]


class Radio(Section):
    """The radio beyond ``edge_snr`` and ``path_loss_exponent``."""

    anchor: Number = Field(
        0.0,
        ge=0,
        le=1e6,
        description=Description(
            "distance at which the mean SNR is edge_snr",
            unit="m",
            note="0 for half the grid's diagonal",
        ),
    )
    range: Number = Field(
        0.0,
        ge=0,
        le=1e7,
        description=Description(
            "distance beyond which there is no service", unit="m", note="0 for none"
        ),
    )
    max_rate: Number = Field(
        0.0,
        ge=0,
        le=1000,
        description=Description("largest spectral efficiency", unit="bit/s/Hz", note="0 for none"),
    )
    steps: tuple[tuple[Snr, Efficiency], ...] = Field(
        (),
        max_length=MOST_STEPS,
        description=Description(
            "spectral efficiencies by SNR",
            unit="dB, bit/s/Hz",
            form="a list of [SNR, efficiency], both rising: from an SNR on the rate is this one, "
            "and below the first there is no service; without it, the rate is that of eq. 9",
        ),
    )
    duty_cycle: Number = Field(
        1.0,
        ge=1e-6,
        le=1,
        description=Description(
            "share of the time in which a node may send", note="by which all rates are multiplied"
        ),
    )

    @model_validator(mode="after")
    def _is_rising(self) -> Self:
        for lower, higher in pairwise(self.steps):
            if higher[0] <= lower[0] or higher[1] <= lower[1]:
                problem = f"{[*higher]} comes after {[*lower]}"
                raise InputError("steps", problem, "steps whose SNR and efficiency rise")
        if self.steps and self.max_rate:
            raise InputError("max_rate", "the highest step is the largest rate", "one of both")
        return self

    def constants(self) -> dict[str, Any]:
        """The fields of ``MISSION`` that the section sets, but for the length of a slot."""
        table = np.zeros((2, MOST_STEPS))
        table[:, : len(self.steps)] = np.reshape(self.steps, (-1, 2)).T
        step_snr, step_rate = table
        return {
            "range": self.range,
            "max_rate": self.max_rate,
            "steps": len(self.steps),
            "step_snr": step_snr,
            "step_rate": step_rate,
        }


@for_sections
def has_max_rate(mission):
    """Whether the modulation ends somewhere."""
    return mission.max_rate > 0.0


@for_sections
def has_steps(mission):
    """Whether the rate has steps."""
    return mission.steps > 0


@for_sections
def step_efficiency(mission, snr):
    """The efficiency [bit/s/Hz] of the highest step that an SNR [dB] reaches, or else 0."""
    efficiency = 0.0
    for number in range(mission.steps):
        if snr >= mission.step_snr[number]:
            efficiency = mission.step_rate[number]
    return efficiency


@for_sections
def is_below_steps(mission, snr):
    """Whether an SNR [dB] is too low for any service."""
    return mission.steps > 0 and snr < mission.step_snr[0]


@for_sections
def has_limit(mission):
    """Whether there are places without service: beyond a range, or below the lowest step."""
    return mission.range > 0.0 or mission.steps > 0
