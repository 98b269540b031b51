"""What the hourly weather of a scenario leaves to UAVs: as numbers for programs, and in lines."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.base.errors import listed
from dess.scenario.scenario import ScenarioSpace
from dess.scenario.weather.hours import HourState, Year, hours_of, years
from dess.scenario.weather.windows import longest_gap, shares_of, windows_of

OPEN, NIGHT = "open", "night"
# What closes an hour in words, by the name of its share; others are limits.
_CLOSED = {NIGHT: "not operating", "missing": "without a value", "wind": "too windy to fly"}
MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")

_LEAST = 0.0005  # the least share that a line tells


def weather_facts(space: ScenarioSpace) -> dict[str, Any]:
    """What the weather of a scenario leaves to UAVs; nothing is simulated.

    Args:
        space: A scenario with ``[weather]``.

    Returns:
        The hours of the file and its whole calendar years; of their hours, or of all without such
        a year, the share that is open and that each reason closes, and the share of the operating
        hours that is open; the mean number of windows a year; the median and the largest of the
        longest gaps of the years [h]; the hours of the file without a row, and without a value by
        column, for the columns that count.

    Raises:
        InputError: As ``hours_of``.
    """
    hours = hours_of(space)
    whole = years(hours)
    counted = whole or [Year(0, 0, len(hours.state))]
    of_years = [shares_of(hours, year) for year in counted]
    lengths = np.array([year.hours for year in counted])
    shares = {
        name: float(np.average([of_year[name] for of_year in of_years], weights=lengths))
        for name in of_years[0]
    }
    assert space.units
    longest = space.weather.longest_hours
    windows = [len(windows_of(hours, year, longest, space.units.slot)) for year in counted]
    gaps = [longest_gap(hours, year) for year in counted]
    operating = 1 - shares["night"]
    missing = hours.series.missing
    counting = [name for name in ("wind", "from", *hours.limits) if missing.get(name)]
    return {
        "file": space.weather.file,
        "hours": len(hours.series.wind),
        "years": [year.year for year in whole],
        "shares": shares,
        "open_of_operating": shares["open"] / operating if operating else 0.0,
        "windows": float(np.mean(windows)),
        "longest_gap_h": {"median": float(np.median(gaps)), "largest": max(gaps)},
        "without_row": hours.series.without_row,
        "missing": {name: missing[name] for name in counting},
    }


def weather_lines(space: ScenarioSpace) -> list[str]:
    """``weather_facts`` in lines."""
    facts = weather_facts(space)
    whole_years = facts["years"]
    about = f"weather: {facts['hours']:,} hours"
    if whole_years:
        number = numbers.format_count(len(whole_years), "whole year")
        span = str(whole_years[0])
        if len(whole_years) > 1:
            span = f"{whole_years[0]} to {whole_years[-1]}"
        about += f" with {number}, {span}"
    else:
        about += " without a whole calendar year, so that no year can be simulated"
    closed = [
        f"{100 * share:.1f} % {reason_in_words(name)}"
        for name, share in facts["shares"].items()
        if name != OPEN and share >= _LEAST
    ]
    is_open = f"{100 * facts['shares']['open']:.1f} % of the hours are open"
    windows = f"{facts['windows']:,.0f} windows of at most {space.weather.longest}"
    gap = facts["longest_gap_h"]
    gaps = f"the longest gap is {gap['largest']:g} h"
    if len(whole_years) > 1:
        windows = windows.replace(" of", " a year, each of", 1)
        gaps = f"the longest gap of a year is {gap['median']:g} h in the median, "
        gaps += f"{gap['largest']:g} h at most"
    operating = f"of the operating hours {100 * facts['open_of_operating']:.1f} % are open"
    lines = [about, ", ".join([is_open, *closed]), f"{operating}: {windows}; {gaps}"]
    if facts["missing"]:
        named = [f"{name} {count:,}" for name, count in facts["missing"].items()]
        rows = f", {facts['without_row']:,} of them without a row" if facts["without_row"] else ""
        lines.append(f"hours without a value: {listed(named)}{rows}")
    return lines


def reason_in_words(name: str) -> str:
    """What closes an hour in words, by the name of its share in ``weather_facts``."""
    return _CLOSED.get(name) or f"beyond {name}"


def hours_by_month(space: ScenarioSpace, chosen: Iterable[Year]) -> pd.DataFrame:
    """How many hours of a day are open in every month, and what closes the others.

    Args:
        space: A scenario with ``[weather]``.
        chosen: Years of its weather, of which the means are taken.

    Returns:
        A row per month, with a column of hours a day for ``open`` and for each reason that closes
        an hour. The sum of a row is 24.

    Raises:
        InputError: As ``hours_of``.
    """
    hours = hours_of(space)
    names = {int(HourState.OPEN): OPEN} | hours.names
    counts = np.zeros((12, max(names) + 1))
    for year in chosen:
        begin = np.datetime64(f"{year.year}-01-01T00", "h")
        of_year = begin + np.arange(year.hours)
        months = of_year.astype("datetime64[M]").astype(int) % 12
        np.add.at(counts, (months, hours.state[year.first : year.first + year.hours]), 1)
    shares = counts / counts.sum(axis=1, keepdims=True)
    return pd.DataFrame(
        {name: 24 * shares[:, state] for state, name in names.items()}, index=MONTHS
    )
