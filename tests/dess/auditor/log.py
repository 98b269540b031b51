"""The rows of an event log, taken one after the other."""

import math
from typing import Any, NamedTuple


class WrongLogError(Exception):
    """The log is not that of a mission of the model."""


class Row(NamedTuple):
    """A row of the log."""

    time: float
    event: str
    uav: int
    node: int
    value: float
    x: float
    y: float
    battery: int
    other: int
    snr: float
    packet: int
    generated: float


# What a row has in the columns that say nothing of its event; a value must always be expected.
_NONE = {"uav": -1, "node": -1, "x": -1, "y": -1, "battery": -1, "other": -1}
_NONE |= {"packet": -1, "generated": math.nan}


class Log:
    """The rows of a log, and the place up to which they have been taken."""

    def __init__(self, rows: list[Row]):
        self.rows, self.place, self.slot = rows, 0, 0

    def require(self, holds: bool, problem: str) -> None:
        if not holds:
            raise WrongLogError(f"row {self.place - 1}, slot {self.slot}: {problem}")

    @property
    def next_row(self) -> Row:
        self.require(self.place < len(self.rows), "the log ends too early")
        return self.rows[self.place]

    def next_is(self, time: float, *events: str, **values: Any) -> bool:
        """Whether the next row has this time, one of these events and these values."""
        rows = self.rows[self.place : self.place + 1]
        return any(
            row.time == time
            and row.event in events
            and all(getattr(row, name) == value for name, value in values.items())
            for row in rows
        )

    def take(self, event: str, time: float, **expected: Any) -> Row:
        """The next row, which must be this event and have the expected values.

        Any SNR is accepted of a communication; no other row has one.
        """
        is_next = self.next_is(time, event)
        self.place += 1
        self.require(is_next, f"{event} at {time} expected")
        row = self.rows[self.place - 1]
        for name, value in (_NONE | expected).items():
            self.require(_same(getattr(row, name), value), f"{event}: {name} must be {value}")
        self.require(math.isnan(row.snr) == (event != "communication"), f"{event}: its snr")
        return row


def _same(found: float, expected: float) -> bool:
    """Whether two numbers are equal; sums of data may be rounded in another order."""
    if isinstance(expected, int):
        return found == expected
    both_nan = math.isnan(found) and math.isnan(expected)
    return both_nan or math.isclose(found, expected, rel_tol=1e-9, abs_tol=1e-9)
