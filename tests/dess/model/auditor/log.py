"""The rows of an event log, taken one after the other."""

import math
from collections import namedtuple
from typing import Any


class WrongLogError(Exception):
    """The log is not that of a mission of the model."""


Row = namedtuple("Row", "time event uav node value x y battery other snr packet generated")

# What a row has in the columns that say nothing of its event; a value must always be expected.
_NONE = dict.fromkeys(("uav", "node", "x", "y", "battery", "other", "packet"), -1)
_NONE |= {"generated": math.nan}


class Log:
    """The rows of a log, and the place up to which they have been taken."""

    def __init__(self, rows: list[Row]):
        self.rows, self.place, self.slot = rows, 0, 0

    def require(self, holds: bool, problem: str) -> None:
        if not holds:
            raise WrongLogError(f"row {self.place - 1}, slot {self.slot}: {problem}")

    @property
    def next_row(self) -> Any:
        self.require(self.place < len(self.rows), "the log ends too early")
        return self.rows[self.place]

    def next_is(self, time: float, *events: str, **values: Any) -> bool:
        """Whether the next row has this time, one of these events and these values."""
        for row in self.rows[self.place : self.place + 1]:
            is_event = row.time == time and row.event in events
            return is_event and all(getattr(row, name) == values[name] for name in values)
        return False

    def take(self, event: str, time: float, **expected: Any) -> Any:
        """The next row, which must be this event and have the expected values.

        Any SNR is accepted of a communication; no other row has one.
        """
        is_next = self.next_is(time, event)
        self.place += 1
        self.require(is_next, f"{event} at {time} expected")
        row: Any = self.rows[self.place - 1]
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
