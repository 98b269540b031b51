"""CSV files of places: a row for each, whose columns are known by their names (``COLUMNS``)."""

import csv
import io
import re
from pathlib import Path

import numpy as np

from dess.base.errors import InputError, shown
from dess.base.files.reading import TEXT_LIMIT, read_text
from dess.scenario.places import GEOGRAPHIC, LIMITS, POINT, ROUNDING, Place, Places
from dess.scenario.quantities import may_part_thousands

# What columns of a place are called; letters may be small or large.
COLUMNS = {"lon": ("lon", "lng", "long", "longitude"), "lat": ("lat", "latitude")}
COLUMNS |= {"x": ("x",), "y": ("y",)}
# With this first line Excel says what parts the columns.
_NAMED_DELIMITER = re.compile("sep=(.)", re.IGNORECASE)


def read_table(path: Path) -> Places:
    """The places in a CSV file, in the order of its lines; commas, semicolons or tabs part columns.

    Raises:
        InputError: If it cannot be read, has other columns, or a place is no number.
    """
    try:
        text = read_text(path, TEXT_LIMIT, "utf-8-sig", "a CSV file")
        text, delimiter = without_delimiter(text)
        lines = csv.reader(io.StringIO(text), strict=True, delimiter=delimiter)
        columns = [name.strip() for name in next(filter(None, lines), [])]
        rows = [(f"line {lines.line_num}", row) for row in lines if any(map(str.strip, row))]
    except csv.Error as error:
        raise InputError(path, f"is not a CSV file: {error}", "CSV with commas") from None
    axes = {axis: [c for c in columns if c.lower() in COLUMNS[axis]] for axis in COLUMNS}
    pairs = [pair for pair in LIMITS if all(len(axes[axis]) == 1 for axis in pair)]
    if len(pairs) != 1:
        present = ", ".join(columns) or "none"
        allowed = "x and y, or lon and lat"
        if pairs:
            allowed = "one pair: x and y are cells, lon and lat degrees"
        raise InputError(path, f"has columns {present}", allowed)
    is_geographic = pairs == [GEOGRAPHIC]
    places = []
    for line, texts in rows:
        filled = zip(columns, map(str.strip, texts), strict=False)
        values = dict.fromkeys(columns, "") | dict(filled)
        numbers = [
            _number(values[axes[axis][0]], f"{path}: {line}: {axis}", most, is_geographic)
            for axis, most in zip(pairs[0], LIMITS[pairs[0]], strict=True)
        ]
        places.append(Place(line, values, [(POINT, [np.array([numbers])])]))
    return Places(is_geographic, places)


def without_delimiter(text: str) -> tuple[str, str]:
    """The text of a CSV file without the line that says what parts its columns, and what does.

    The numbers of its lines stay. Without such a line, the first line tells the most frequent of
    comma, semicolon and tab.
    """
    text = text.lstrip("\r\n")
    first, _, others = text.partition("\n")
    named = _NAMED_DELIMITER.fullmatch(first.rstrip("\r"))
    if named:
        return f"\n{others}", named[1]
    return text, max(",;\t", key=first.count)


def number_of(text: str, place: str) -> float:
    """A number, with a decimal point or comma.

    Raises:
        InputError: If it is none; ``place`` says where it stands.
    """
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise InputError("", f"{place} is {shown(text)}", "a number") from None


def amount_of(text: str, place: str) -> float:
    """A number whose comma, if it has one, parts decimals for certain.

    Raises:
        InputError: If it is none, or ``1,000`` could be a thousand; ``place`` says where it stands.
    """
    if may_part_thousands(text.strip()):
        allowed = f"{text.replace(',', '')} or {text.replace(',', '.')}"
        problem = "has a comma that may part thousands or decimals"
        raise InputError(place, f"{shown(text)} {problem}", allowed)
    return number_of(text, place)


def _number(text: str, place: str, most: int, is_geographic: bool) -> float:
    """A number of at most this size; a cell has integers."""
    number = number_of(text, place)
    if not -most - ROUNDING <= number <= most + ROUNDING:
        raise InputError("", f"{place} is {number:g}", f"{-most:,}..{most:,}")
    if not is_geographic and not number.is_integer():
        raise InputError(
            "", f"{place} is {number:g}", "an integer (a cell); degrees are lon and lat"
        )
    return min(max(number, -most), most)
