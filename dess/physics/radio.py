"""The radio as data sheets have it: an SNR at a distance, a range, and a largest rate."""

from pydantic import Field

from dess.base.descriptions import Description
from dess.physics.section import Number, Section, for_sections


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


@for_sections
def has_max_rate(mission):
    """Whether the modulation ends somewhere."""
    return mission.max_rate > 0.0


@for_sections
def has_range(mission):
    """Whether there are places without service."""
    return mission.range > 0.0
