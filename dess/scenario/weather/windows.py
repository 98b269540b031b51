"""Windows of weather: runs of open hours, each of which is a mission; and the gaps between them."""

from typing import NamedTuple

import numpy as np

from dess.scenario.weather.hours import Hours, HourState, Year


class Window(NamedTuple):
    """Consecutive open hours that UAVs fly in at once.

    Attributes:
        first: The first hour, as an index of ``Hours``.
        hours: The number of hours.
    """

    first: int
    hours: int


def windows_of(hours: Hours, year: Year, longest: int, slot: float) -> list[Window]:
    """The windows of a year: its runs of open hours, cut after ``longest`` hours.

    What begins before the year or ends after it is cut at its turn.

    Args:
        hours: The hours of the series.
        year: The year.
        longest: The longest window [h].
        slot: A mission slot [s]; shorter windows are closed.
    """
    starts, ends = _runs(hours.state[year.first : year.first + year.hours] == HourState.OPEN)
    return [
        Window(year.first + first, min(longest, end - first))
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True)
        for first in range(start, end, longest)
        if min(longest, end - first) * 3600 >= slot
    ]


def longest_gap(hours: Hours, year: Year) -> int:
    """The longest run of closed hours of a year [h]."""
    starts, ends = _runs(hours.state[year.first : year.first + year.hours] != HourState.OPEN)
    return int((ends - starts).max(initial=0))


def shares_of(hours: Hours, year: Year) -> dict[str, float]:
    """The share of a year's hours that is open, and that each reason closes, by its name."""
    counts = np.bincount(
        hours.state[year.first : year.first + year.hours],
        minlength=HourState.LIMIT + len(hours.limits),
    )
    names = {int(HourState.OPEN): "open"} | hours.names
    return {name: float(counts[state] / year.hours) for state, name in names.items()}


def _runs(is_in: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where runs of hours begin, and where they end."""
    edges = np.diff(np.concatenate([[0], is_in.astype(np.int8), [0]]))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
