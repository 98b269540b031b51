"""The engine that simulates missions: the batch engine, or the SimPy engine where it is needed."""

from collections.abc import Sequence
from typing import Literal

from dess.batch import check_slotted
from dess.scenario import ScenarioSpace

Engine = Literal["batch", "events"]


def engine_of(spaces: Sequence[ScenarioSpace], asked: Engine | None = None) -> Engine:
    """The engine for missions of some scenarios: the one that was asked for, or the fastest.

    Args:
        spaces: The scenarios.
        asked: The engine that was asked for, if any.

    Raises:
        InputError: If the batch engine was asked for, and one of the scenarios needs the other.
    """
    if asked is None:
        return "events" if any(space.needs_events for space in spaces) else "batch"
    if asked == "batch":
        check_slotted(spaces)
    return asked
