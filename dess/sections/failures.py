"""Failures at random times: UAVs that are lost or grounded, pads out of order, silent nodes."""

from typing import Literal

from pydantic import Field

from dess.sections.section import Probability, Section, Slots


class Failures(Section):
    """Rates of failures per mission slot, and mean durations of repairs."""

    uav_rate: Probability = Field(0.0, description="probability that a UAV fails in a mission slot")
    uav_repair: Slots = Field(
        0.0, description="mean time until a failed UAV flies again [slots]; 0 if it is lost"
    )
    uav_data: Literal["kept", "lost"] = Field(
        "kept", description="whether the data that a lost UAV has collected count"
    )
    pad_rate: Probability = Field(
        0.0, description="probability that a charging pad fails in a mission slot"
    )
    pad_repair: Slots = Field(
        0.0, description="mean time until a failed pad works again [slots]; 0 if it never does"
    )
    node_rate: Probability = Field(
        0.0, description="probability that a node falls silent in a mission slot"
    )
    node_repair: Slots = Field(
        0.0, description="mean time until a silent node answers again [slots]; 0 if it never does"
    )
    node_data: Literal["kept", "lost"] = Field(
        "kept", description="whether the data that a node holds when it falls silent are kept"
    )
