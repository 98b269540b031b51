"""Types of UAVs, for fleets whose UAVs differ."""

from pydantic import Field

from dess.sections.section import Integer, Number, Section


class UavType(Section):
    """A type of UAV; UAV i of a mission has type ``i % len(fleet)``."""

    flying_time: Integer | None = Field(
        None, ge=1, le=100, description="battery at the start [%]; without it, that of the scenario"
    )
    slots_per_cell: Integer = Field(
        1, ge=1, le=8, description="mission slots that a move to the next cell takes"
    )
    quota: Integer | None = Field(
        None,
        ge=1,
        le=1_000_000,
        description="communication slots that the UAV must fill; without it, those of the scenario",
    )
    rate: Number = Field(
        1.0, ge=0.001, le=1000, description="factor of the rate at which the UAV collects data"
    )
