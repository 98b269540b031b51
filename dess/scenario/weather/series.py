"""Hourly weather: what each hour takes of the rows of a file.

Hour h takes the last row that is stamped at h or before, if it is not older than a step of the
file, which is the median time between its rows. Other hours are missing, and so is what a row does
not have: nothing is interpolated.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType

import numpy as np

from dess.base.elementary import atan2, hypot
from dess.base.errors import InputError, listed
from dess.base.files.reading import read_bytes, version_of
from dess.base.files.tables import LIMIT
from dess.scenario.weather.formats import FROM, U10, V10, WIND, Rows, known_name, read_rows

HOUR = np.timedelta64(1, "h")
LONGEST_STEP = np.timedelta64(3, "h")
MOST_YEARS = 200  # of a series
BEGIN, END = "begin", "end"


@dataclass(frozen=True, eq=False)
class Series:
    """The weather of consecutive hours, N of them.

    Attributes:
        first: The first hour [UTC], as ``datetime64[h]``.
        wind: (N,) the wind at the anemometer [m/s]; nan where it is missing.
        origin: (N,) where it comes from [degrees from north, clockwise]; nan where it is missing.
        columns: (N,) all columns of the file by their names (``formats.COLUMNS``), in SI units as
            far as their units are known; nan where a value is missing.
        digest: The SHA-256 hash of the content of the file.
        without_row: The number of hours that no row tells of.
        missing: The number of hours without a value, by the column; those without a row included.
    """

    first: np.datetime64
    wind: np.ndarray
    origin: np.ndarray
    columns: Mapping[str, np.ndarray]
    digest: str
    without_row: int
    missing: Mapping[str, int]

    @property
    def hours(self) -> np.ndarray:
        """(N,) the hours [UTC], as ``datetime64[h]``."""
        return self.first + np.arange(len(self.wind)) * HOUR

    def column(self, name: str) -> np.ndarray | None:
        """(N,) the values of a column, by any name that it may have; None if there is none."""
        return self.columns.get(name, self.columns.get(known_name(name)))


def read_series(path: Path, units: Mapping[str, str], stamps: str = BEGIN) -> Series:
    """The hourly weather in a file; it is read once as long as it does not change.

    Args:
        path: The file (``dess.scenario.weather.formats``).
        units: The units of columns that are not SI, by the names that the file has for them.
        stamps: Whether rows are stamped at the begin or at the end of the time that they tell of.

    Raises:
        InputError: If the file cannot be read, has no wind, or steps above 3 h.
    """
    return _read_version(path, version_of(path), tuple(sorted(units.items())), stamps)


def digest_of(path: Path) -> str:
    """The SHA-256 hash of the content of a file of weather, which must be readable.

    Raises:
        InputError: As ``read_series``, but for its columns.
    """
    return _digest_version(path, version_of(path))


@lru_cache(maxsize=64)
def _digest_version(path: Path, version: tuple[int, int]) -> str:
    return sha256(read_bytes(path, LIMIT, "a file of weather")).hexdigest()


@lru_cache(maxsize=4)
def _read_version(
    path: Path, version: tuple[int, int], units: tuple[tuple[str, str], ...], stamps: str
) -> Series:
    """The series of a file as it was at a time, of a size."""
    rows, content = read_rows(path, dict(units))
    order = np.argsort(rows.times, kind="stable")
    times = rows.times[order]
    steps = np.diff(times)
    steps = steps[steps > np.timedelta64(0, "s")]
    if not len(steps):
        raise InputError(path, "has no rows at different times", "rows of at most 3 h")
    step = np.sort(steps)[len(steps) // 2]
    if step > LONGEST_STEP:
        hours = step / HOUR
        raise InputError(path, f"has a row every {hours:g} h", "3 h at most")
    if times[-1] - times[0] > MOST_YEARS * 366 * 24 * HOUR:
        problem = f"has rows from {times[0]} to {times[-1]}"
        raise InputError(path, problem, f"{MOST_YEARS} years at most")
    if stamps == END:
        times = times - step
    first = -((-times[0].astype("datetime64[s]").astype(np.int64)) // 3600)
    end = -((-(times[-1] + step).astype("datetime64[s]").astype(np.int64)) // 3600)
    hours = np.arange(first, end).astype("datetime64[h]")
    row = np.searchsorted(times, hours.astype("datetime64[s]"), side="right") - 1
    is_told = hours.astype("datetime64[s]") - times[row] <= step
    columns = {
        name: _frozen(np.where(is_told, values[order][row], np.nan))
        for name, values in rows.columns.items()
    }
    wind, origin = _wind_of(columns, rows, path)
    missing = {name: int(np.count_nonzero(np.isnan(values))) for name, values in columns.items()}
    return Series(
        hours[0],
        _frozen(wind),
        _frozen(origin),
        MappingProxyType(columns),
        sha256(content).hexdigest(),
        int(np.count_nonzero(~is_told)),
        MappingProxyType(missing),
    )


def _wind_of(
    columns: dict[str, np.ndarray], rows: Rows, path: Path
) -> tuple[np.ndarray, np.ndarray]:
    """The wind and where it comes from; the latter is 0 of a calm."""
    if {U10, V10} <= columns.keys() and not {WIND, FROM} <= columns.keys():
        east, north = columns[U10], columns[V10]
        wind = hypot(east, north)
        origin = np.degrees(atan2(-east, -north)) % 360
        columns[WIND], columns[FROM] = _frozen(wind), _frozen(origin)
    for name in (WIND, FROM):
        if name not in columns:
            problem = f"has no {name} in its columns {listed(rows.columns) or 'none'}"
            raise InputError(path, problem, f"{WIND} and {FROM}, or {U10} and {V10}")
    wind = columns[WIND]
    origin = np.where(wind == 0, 0.0, columns[FROM])
    return wind, np.where(np.isnan(wind), np.nan, origin)


def _frozen(values: np.ndarray) -> np.ndarray:
    """An array that is shared, and which nothing may change."""
    values.flags.writeable = False
    return values
