"""New data in continuous time: packets with time stamps, in buffers at the nodes."""

from typing import Literal

from pydantic import Field

from dess.sections.section import Integer, Number, Section


class Arrivals(Section):
    """Packets of one data unit that arrive in continuous time; only the SimPy engine has them."""

    process: Literal["slotted", "continuous"] = Field(
        "slotted",
        description="when new data arrive: slotted, at the ends of mission slots (eq. 12), or "
        "continuous, a Poisson process per node",
    )
    rates: tuple[Number, ...] = Field(
        (),
        max_length=1024,
        description="arrival rate per node [data units per slot]: a number per node; without it, "
        "arrival_rate for all",
    )
    schedule: tuple[tuple[Number, Number], ...] = Field(
        (),
        max_length=10_000,
        description="factors of the rates over time: [slot, factor] from this slot on, or the name "
        "of a CSV file with the columns slot and factor",
    )
    buffer: Integer = Field(
        0, ge=0, le=1_000_000, description="packets that a node can hold; 0 for no limit"
    )
    service: Literal["oldest", "newest"] = Field(
        "oldest", description="which packet of a node is served first"
    )
