"""Wind: moves against it cost more battery."""

from pydantic import Field

from dess.sections.section import Integer, Number, Section


class Wind(Section):
    """A field of wind over the grid, drawn from its own seed and the same in all missions."""

    strength: Number = Field(
        0.0,
        ge=0,
        le=10,
        description="battery that a move against the mean wind costs more [%]; 0 for none",
    )
    direction: Number = Field(
        0.0, ge=0, le=360, description="where the mean wind comes from [degrees from north]"
    )
    gusts: Number = Field(
        0.0, ge=0, le=10, description="standard deviation of the wind from cell to cell [%]"
    )
    seed: Integer = Field(0, ge=0, le=2**32 - 1, description="seed of the field of wind")
