"""The order in which UAVs are given charging pads, and the power that the pads share."""

from typing import Literal

from pydantic import Field

from dess.sections.section import Integer, Section


class Charging(Section):
    """The charging pads beyond their number (``pads``) and their rate (``charge_rate``)."""

    order: Literal["first-come", "lowest-battery"] = Field(
        "first-come", description="which waiting UAV is given the next free pad"
    )
    power: Integer = Field(
        0,
        ge=0,
        le=6400,
        description="battery that all pads together can add in a slot [%]; 0 for no limit",
    )
    measured: bool = Field(
        False, description="whether records have the queue, waiting time and use of the pads"
    )
