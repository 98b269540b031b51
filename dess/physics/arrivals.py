"""New data in continuous time: a Poisson process per node, whose rate may change over time.

The times are drawn by thinning (P. Lewis, G. Shedler: Simulation of nonhomogeneous Poisson
processes by thinning, Naval Research Logistics 1979). Candidates arrive at the highest rate that
the schedule allows, with exponential gaps, and each is accepted with the probability that the rate
at its time has. Candidate number c of a node is a draw of its own, so arrivals depend neither on
the policy nor on those of other nodes.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dess.base.descriptions import Description
from dess.base.elementary import log
from dess.base.errors import InputError
from dess.base.kernels import kernel
from dess.physics import streams
from dess.physics.section import Integer, Number, Section, for_sections

# The highest rate or factor, the last slot and the largest number of a schedule.
MOST_RATE, LAST, MOST_ROWS = 100, 1_000_000, 10_000
MOST_AMOUNT = 10**9  # initial data of a node

# The largest number of messages of a node and slot that are drawn. Of more of them, the deviation
# is below 15 % of the mean, and a node has exactly its rate.
MOST_MESSAGES = 50

Rate = Annotated[Number, Field(ge=0, le=MOST_RATE)]
Amount = Annotated[Number, Field(ge=0, le=MOST_AMOUNT)]
Time = Annotated[Number, Field(ge=0, le=LAST)]

# The Poisson process of one node.
SOURCE = np.dtype(
    [
        ("rate", np.float64),  # packets per slot where the factor of the schedule is 1
        ("candidate", np.int64),  # number of the next candidate
        ("time", np.float64),  # of the next arrival [slots]; infinite after the mission
    ]
)


class Arrivals(Section):
    """What data nodes have of their own, the size of messages, and packets in continuous time.

    Only the SimPy engine has arrivals in continuous time.
    """

    process: Literal["slotted", "continuous"] = Field(
        "slotted",
        description=Description(
            "when new data arrive",
            form="slotted, at the ends of mission slots (eq. 12), or continuous, a Poisson "
            "process per node",
        ),
    )
    rates: tuple[Rate, ...] = Field(
        (),
        max_length=1024,
        description=Description(
            "arrival rate per node",
            unit="data units per slot",
            form="a number 0..100 per node; without it, arrival_rate for all",
        ),
    )
    initial: tuple[Amount, ...] = Field(
        (),
        max_length=1024,
        description=Description(
            "initial data per node",
            unit="data units",
            form="a number for each; without it, initial_data for all",
        ),
    )
    message: Number = Field(
        0.0,
        ge=0,
        le=MOST_AMOUNT,
        description=Description(
            "data that a node makes at once",
            unit="data units",
            note="0 for one data unit",
            form="new data are a Poisson number of such messages; of a node that makes more than "
            f"{MOST_MESSAGES} in a slot they are exactly its rate",
        ),
    )
    merged: tuple[Annotated[Integer, Field(ge=1)], ...] = Field(
        (),
        max_length=1024,
        description=Description(
            "how many sensor nodes each node stands for",
            form="it has as many times the arrival_rate and the initial_data",
        ),
    )
    schedule: tuple[tuple[Time, Rate], ...] = Field(
        (),
        max_length=MOST_ROWS,
        description=Description(
            "factors of the rates over time",
            form="a list of [slot, factor], the factor 0..100 from this slot on and 1 before the "
            "first",
        ),
    )
    buffer: Integer = Field(
        0,
        ge=0,
        le=1_000_000,
        description=Description("packets that a node can hold", note="0 for no limit"),
    )
    service: Literal["oldest", "newest"] = Field(
        "oldest", description="which packet of a node is served first"
    )

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if self.process == "slotted" and (self.schedule or self.buffer or self.service != "oldest"):
            raise InputError(
                "process", "slotted arrivals have no schedule, buffer or service", "continuous"
            )
        for (earlier, _), (later, _) in pairwise(self.schedule):
            if later <= earlier:
                raise InputError(
                    "schedule", f"slot {later:g} comes after slot {earlier:g}", "growing slots"
                )
        return self


def sources_of(rates: Sequence[float]) -> np.ndarray:
    """The (K,) ``SOURCE`` records of nodes with these rates, before their first arrival."""
    sources = np.zeros(len(rates), SOURCE)
    sources["rate"] = rates
    return sources


def factors_of(arrivals: Arrivals) -> tuple[np.ndarray, np.ndarray]:
    """The (S,) slots from which the factors of a schedule hold, and the (S,) factors."""
    starts, factors = np.array([(0.0, 1.0), *arrivals.schedule]).T.copy()
    return starts, factors


@kernel
def draw_arrival(missions, sources, starts, factors, k):
    """Draw the next arrival at node ``k``; its time is infinite if the mission ends before it.

    Args:
        missions: (1,) ``MISSION`` records.
        sources: (K,) ``SOURCE`` records.
        starts, factors: As from ``factors_of``.
        k: Index of the node.
    """
    mission = missions[0]
    source = sources[k]
    highest = factors.max()
    while source.time < math.inf:
        words = streams.block(
            mission.seed, mission.replication, streams.ARRIVAL_TIME, 0, k, source.candidate
        )
        source.candidate += 1
        source.time -= log(streams.uniform(words[0])) / (source.rate * highest)
        if not source.time < mission.max_slots:
            source.time = math.inf
            return
        factor = factors[np.searchsorted(starts, source.time, side="right") - 1]
        if streams.uniform(words[1]) * highest < factor:
            return


@for_sections
def has_messages(mission):
    """Whether nodes make messages of another size than a data unit."""
    return mission.message > 0.0


@for_sections
def draw_messages(mission, rate, word):
    """The data [data units] of the messages of a node in a slot.

    Args:
        mission: ``MISSION`` record.
        rate: Arrival rate of the node [data units per slot].
        word: Random word.
    """
    messages = rate / mission.message
    if messages > MOST_MESSAGES:
        return rate
    return streams.poisson(word, messages) * mission.message
