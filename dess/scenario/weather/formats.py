"""Files of weather: rows of a time and of columns, as CSV files, NDBC's text and parquet have them.

    read_rows(Path("point.csv"), {})       # the times [UTC] and the columns [SI] of a file

Columns are known by their names, whatever the case (``COLUMNS``); others keep their names. A unit
stands in the settings, or behind a name: ``wind (km/h)``. Times are ISO 8601, in UTC where they
have no offset.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from dess.base.errors import InputError, listed, shown, unknown_name
from dess.base.files.reading import TEXT_LIMIT, read_bytes
from dess.base.files.tables import LIMIT, parse_columns, parse_table
from dess.scenario.quantities import exactly, form_of
from dess.scenario.readers import read_by_others
from dess.scenario.readers.table import without_delimiter

TIME, WIND, FROM, U10, V10 = "time", "wind", "from", "u10", "v10"
# What columns are called; letters may be small or large.
COLUMNS = {
    TIME: (TIME, "datetime", "date_time", "date", "timestamp", "valid_time", "utc", "time_utc"),
    WIND: (WIND, "wind_speed", "windspeed", "wspd", "wind_speed_10m", "windspeed_10m"),
    FROM: (FROM, "wind_from", "wind_direction", "winddirection", "wdir")
    + ("wind_direction_10m", "winddirection_10m"),
    U10: (U10, "u"),
    V10: (V10, "v"),
    "gust": ("gust", "gusts", "gst", "wind_gust", "wind_gusts", "wind_gusts_10m", "windgusts_10m")
    + ("fg10", "i10fg"),
    "waves": ("waves", "wave_height", "waveheight", "hs", "swh", "wvht"),
    "visibility": ("visibility", "vis"),
}
# The units of the known columns, and the least and the most that they may hold; those of others.
UNITS = {
    **dict.fromkeys((WIND, "gust"), ("m/s", (0, 150))),
    **dict.fromkeys((U10, V10), ("m/s", (-150, 150))),
    FROM: ("deg", (-360, 360)),
    "waves": ("m", (0, 50)),
    "visibility": ("m", (0, 1e6)),
}
_PLACE = ("latitude", "longitude", "lat", "lon")  # columns that hold one value each
_OTHER_UNITS = ("m/s", "m", "s", "deg", "percent")

# What stands for a missing value, in any column of text.
_MISSING = ("", "nan", "na", "n/a", "null", "none", "mm", "-", "--")
# A unit behind the name of a column.
_WITH_UNIT = re.compile(r"(.*\S)\s*[(\[]([^()\[\]]*)[)\]]", re.DOTALL)
# Spellings of units that quantities do not have.
_SPELLINGS = {"m s**-1": "m/s", "m s-1": "m/s", "ms-1": "m/s", "m s^-1": "m/s"}

# The columns of NDBC's standard meteorological text by their names there, with units and with what
# stands for a missing value; older files have the names in brackets.
_NDBC = {
    **dict.fromkeys(("WDIR", "WD"), (FROM, "deg", 999)),
    "WSPD": (WIND, "m/s", 99),
    "GST": ("gust", "m/s", 99),
    "WVHT": ("waves", "m", 99),
    "DPD": ("DPD", "s", 99),
    "APD": ("APD", "s", 99),
    "MWD": ("MWD", "deg", 999),
    **dict.fromkeys(("PRES", "BAR"), ("PRES", "", 9999)),
    **{name: (name, "", 999) for name in ("ATMP", "WTMP", "DEWP")},
    "VIS": ("visibility", "nmi", 99),
    "PTDY": ("PTDY", "", np.inf),
    "TIDE": ("TIDE", "ft", 99),
}
_NDBC_HEAD = re.compile(r"#?(YY|YYYY)\s+MM\s+DD\s+hh\s")
# The columns of its times, with the least and the most that they may hold.
_NDBC_TIME = (
    (("YY", "YYYY", "#YY", "#YYYY"), 0, 9999),
    *((("MM",), 1, 12), (("DD",), 1, 31), (("hh",), 0, 23), (("mm",), 0, 59)),
)
# The form of times that are read, in parts: date, time, fractions of a second, offset.
_ISO = (
    r"^(\d{4}-\d\d-\d\d)(?:[T ](\d\d(?::\d\d(?::\d\d)?)?)(?:\.\d+)?\s*(Z|[+-]\d\d(?::?\d\d)?)?)?$"
)
_TIMES = "times as 2020-01-31T06:00, with Z or +01:00 behind it where they are not UTC"


class Rows(NamedTuple):
    """The rows of a file of weather, as they stand there.

    Attributes:
        times: (R,) the stamps [UTC], as ``datetime64[s]``.
        columns: (R,) the values of each column, nan where one is missing, in SI units.
    """

    times: np.ndarray
    columns: Mapping[str, np.ndarray]


def read_rows(path: Path, units: Mapping[str, str]) -> tuple[Rows, bytes]:
    """The rows of a file, and its content.

    Args:
        path: The file; its ending tells the form. Those that no form here has are read by other
            packages: entry points of ``dess.scenario.readers.GROUP`` that return times and columns.
        units: The units of columns that are not SI, by the names that the file has for them.

    Raises:
        InputError: If the file cannot be read, has no such columns, or values that cannot be.
    """
    content = read_bytes(path, LIMIT, "a file of weather")
    ending = path.suffix.lower()
    if ending in _READERS:
        rows = _READERS[ending](content, path, units)
    else:
        rows = read_by_others(path, _rows_of_others, _READERS)
    for name, values in rows.columns.items():
        if name in UNITS:
            unit, (least, most) = UNITS[name]
            with np.errstate(invalid="ignore"):
                wrong = np.flatnonzero((values < least) | (values > most))
            if len(wrong):
                first = f"{name} is {values[wrong[0]]:g} {unit} at {rows.times[wrong[0]]}"
                allowed = f"{least:g}..{most:g} {unit}, and empty where it is missing"
                raise InputError(path, first, allowed)
    return rows, content


def _rows_of_others(times: Any, columns: Mapping[str, Any]) -> Rows:
    """The rows that the reader of another package returns."""
    stamps = np.asarray(times).astype("datetime64[s]")
    values = {str(name): np.array(column, float) for name, column in columns.items()}
    if any(column.shape != stamps.shape for column in values.values()) or np.isnat(stamps).any():
        raise ValueError("there is not a time for each value")
    return Rows(stamps, values)


def known_name(name: str) -> str:
    """What a column is called here: its known name, or else its own."""
    lower = name.lower()
    return next((column for column, names in COLUMNS.items() if lower in names), name)


def unit_of_column(name: str, unit: str) -> tuple[str, Fraction] | None:
    """The SI unit of a column, and the size of another unit in it; None for an unknown unit.

    Args:
        name: The known name of the column.
        unit: The unit, with a number before it or not.

    Raises:
        InputError: If the unit is none that a known column can have.
    """
    text = _SPELLINGS.get(unit.strip(), unit.strip())
    if text[:1] not in "0123456789.":
        text = f"1 {text}"
    kinds: Iterable[str] = _OTHER_UNITS
    if name in UNITS:
        kinds = [UNITS[name][0]]
    for kind in kinds:
        try:
            return kind, exactly(text, kind)[0]
        except InputError:
            continue
    if name in UNITS:
        raise InputError(name, f"has the unit {shown(unit)}", form_of(UNITS[name][0]))
    return None


def _read_text(content: bytes, path: Path, units: Mapping[str, str]) -> Rows:
    """The rows of a text: NDBC's, or a CSV file."""
    if len(content) > TEXT_LIMIT:
        raise InputError(path, "is too large", f"{TEXT_LIMIT:,} bytes at most")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(path, "cannot be read: it is not text", "UTF-8") from None
    text = text.lstrip()
    if _NDBC_HEAD.match(text):
        return _read_ndbc(text, path)
    text, delimiter = without_delimiter(text)
    table = parse_columns(text.lstrip("\r\n"), path, delimiter)
    if delimiter != ",":
        table = pa.table([_with_points(c) for c in table.columns], table.column_names)
    return _rows_of_table(table, path, units)


def _with_points(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Texts with points in the place of decimal commas."""
    return pc.replace_substring(column, ",", ".")


def _read_parquet(content: bytes, path: Path, units: Mapping[str, str]) -> Rows:
    """The rows of a parquet file: with a column of times, or with start and step in its metadata.

    The metadata may say of a column what one of its numbers is: ``columns = wind [0.1 m/s]``.
    """
    table = parse_table(content, path)
    said = {k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items()}
    if "columns" in said:
        of_columns = dict(re.findall(r"(\w+) \[([^\],]*)", said["columns"]))
        units = {**of_columns, **units}
    if not {"start", "step"} <= said.keys():
        return _rows_of_table(table, path, units)
    start = _times_of(pa.chunked_array([[said["start"]]]), path)[0]
    step = int(exactly(said["step"], "s")[0])
    times = start + np.arange(len(table)) * np.timedelta64(step, "s")
    return _rows_of_table(table, path, units, times)


def _rows_of_table(
    table: pa.Table, path: Path, units: Mapping[str, str], times: np.ndarray | None = None
) -> Rows:
    """The rows of a table: its times, if they are not told, and its columns in SI units."""
    named: dict[str, tuple[str, str]] = {}  # the column and its unit, by the known name
    unused = {*units}
    for column in table.column_names:
        match = _WITH_UNIT.fullmatch(column)
        written, unit = (match[1], match[2]) if match else (column, "")
        unused -= {column, written}
        unit = units.get(column, units.get(written, unit))
        name = known_name(written)
        if name in named:
            both = f"has the columns {named[name][0]} and {column} for {name}"
            raise InputError(path, both, "one of them")
        named[name] = (column, unit)
    if unused:
        name = min(unused)
        raise unknown_name(path, f"has no {name}, of the units", name, table.column_names)
    if times is None:
        if TIME not in named:
            present = listed(table.column_names)
            raise InputError(path, f"has no times in its columns {present}", listed(COLUMNS[TIME]))
        times = _times_of(table[named.pop(TIME)[0]], path)
    columns = {}
    for name, (column, unit) in named.items():
        try:
            values = _numbers_of(table[column], f"{path}: {column}", times)
            column_unit = unit_of_column(name, unit) if unit else None
        except InputError as error:
            if name in UNITS:
                raise error if str(path) in error.where else error.within(path) from None
            continue  # a column of texts, which no limit can have
        if column_unit:
            size = column_unit[1]
            values = values * size.numerator / size.denominator
        columns[name] = values
    for name in _PLACE:
        if name in columns and len(np.unique(columns[name])) > 1:
            raise InputError(path, f"has several values of {name}", "the rows of one place")
    return Rows(times, columns)


def _times_of(column: pa.ChunkedArray, path: Path) -> np.ndarray:
    """(R,) the times of a column [UTC] as ``datetime64[s]``."""
    kind = column.type
    if pa.types.is_date(kind):
        column = column.cast(pa.timestamp("s"))
    elif pa.types.is_string(kind) or pa.types.is_large_string(kind):
        is_time = pc.match_substring_regex(column, _ISO)
        if not pc.all(is_time).as_py():
            wrong = column[pc.index(is_time, False).as_py()].as_py()
            raise InputError(path, f"has the time {shown(wrong)}", _TIMES)
        whole = pc.replace_substring_regex(column, r"\.\d+", "")
        dates = pc.replace_substring_regex(whole, r"^(.{10})$", r"\1T00:00")
        offsets = pc.replace_substring_regex(dates, r"\s+([Z+-])", r"\1")
        utc = pc.replace_substring_regex(offsets, r"([T ]\d\d(:\d\d)*)$", r"\1Z")
        try:
            column = utc.cast(pa.timestamp("s", "UTC"))
        except pa.ArrowInvalid as error:
            wrong = re.search("'([^']*)'", str(error))
            problem = f"has the time {shown(wrong[1] if wrong else '')}"
            raise InputError(path, problem, _TIMES) from None
    elif not pa.types.is_timestamp(kind):
        raise InputError(path, f"has times of the type {kind}", _TIMES)
    if column.null_count:
        raise InputError(path, "has rows without a time", _TIMES)
    return column.to_numpy().astype("datetime64[s]")


def _numbers_of(column: pa.ChunkedArray, where: str, times: np.ndarray) -> np.ndarray:
    """(R,) the numbers of a column, nan where one is missing."""
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        is_missing = pc.is_in(pc.utf8_lower(column), pa.array(_MISSING))
        texts = pc.if_else(is_missing, pa.scalar(None, column.type), column)
        try:
            column = texts.cast(pa.float64())
        except pa.ArrowInvalid:
            row, text = next(
                (row, text)
                for row, text in enumerate(texts.to_pylist())
                if text is not None and not _is_number(text)
            )
            problem = f"is {shown(text)} at {times[row]}"
            raise InputError(where, problem, "a number, and empty where it is missing") from None
    try:
        values = pc.fill_null(column.cast(pa.float64()), np.nan).to_numpy()
    except (pa.ArrowException, TypeError):
        raise InputError(where, f"is of type {column.type}", "numbers") from None
    return np.where(np.isfinite(values), values, np.nan)


def _is_number(text: str) -> bool:
    try:
        pa.scalar(text).cast(pa.float64())
    except pa.ArrowInvalid:
        return False
    return True


def _read_ndbc(text: str, path: Path) -> Rows:
    """The rows of NDBC's standard meteorological text, of one year or several one after another."""
    head, *lines = text.splitlines()
    rows = [line for line in lines if line.strip() and line[:1] != "#" and "MM DD" not in line]
    packed = "\n".join(",".join(line.split()) for line in (head, *rows))
    table = parse_columns(packed, path, ",")
    parts: list[Any] = []
    for names, least, most in _NDBC_TIME:
        name = next((n for n in table.column_names if n in names), None)
        part = 0 if name is None else _integers_of(table[name], f"{path}: {name}", least, most)
        parts.append(part)
    years, months, days, hours, minutes = parts
    years = years + 1900 * (years < 100)
    dates = (years - 1970).astype("datetime64[Y]").astype("datetime64[M]") + (months - 1)
    days = dates.astype("datetime64[D]") + (days - 1)
    times = days.astype("datetime64[s]") + 3600 * hours + 60 * minutes
    columns = {}
    for column in table.column_names:
        if column not in _NDBC:
            continue
        name, unit, missing = _NDBC[column]
        values = _numbers_of(table[column], f"{path}: {column}", times)
        values = np.where(values >= missing, np.nan, values)
        if unit:
            size = unit_of_column(name, unit)
            assert size
            values = values * size[1].numerator / size[1].denominator
        columns[name] = values
    return Rows(times, columns)


def _integers_of(column: pa.ChunkedArray, where: str, least: int, most: int) -> np.ndarray:
    """(R,) the integers of a column of texts."""
    try:
        numbers = np.asarray(column.cast(pa.int64()).to_numpy())
    except pa.ArrowInvalid:
        raise InputError(where, "has no whole numbers", f"{least}..{most}") from None
    if numbers.min() < least or numbers.max() > most:
        raise InputError(where, f"is {numbers.min()} to {numbers.max()}", f"{least}..{most}")
    return numbers


_READERS: Mapping[str, Callable[[bytes, Path, Mapping[str, str]], Rows]] = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat"), _read_text),
    **dict.fromkeys((".parquet", ".pqt"), _read_parquet),
}
