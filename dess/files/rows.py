"""The rows of CSV files, with the lines on which they stand."""

import csv
import io
from pathlib import Path
from typing import NamedTuple

from dess.errors import InputError, shown
from dess.files.reading import read_text

LIMIT = 2**20  # bytes of the largest file


class Row(NamedTuple):
    """A row of a CSV file.

    Attributes:
        path: The file.
        line: The line, such as ``line 3``.
        cells: The text of every column of the header line.
    """

    path: Path
    line: str
    cells: dict[str, str]

    def number(self, column: str, least: float, most: float) -> float:
        """The number in a column.

        Raises:
            InputError: If there is no number, or one out of the limits.
        """
        text, place = self.cells[column], f"{self.path}: {self.line}: {column}"
        try:
            number = float(text)
        except ValueError:
            raise InputError(f"{place} is {shown(text)}; allowed: a number") from None
        if not least <= number <= most:
            raise InputError(f"{place} is {number:g}; allowed: {least:,g}..{most:,g}")
        return number


def rows_in(path: Path) -> tuple[list[str], list[Row]]:
    """The columns that the header line of a CSV file names, and the rows that are not empty.

    Raises:
        InputError: If the file cannot be read, or is no CSV file.
    """
    try:
        text = read_text(path, LIMIT, "utf-8-sig", "a CSV file")
        lines = csv.reader(io.StringIO(text), strict=True)
        columns = [name.strip() for name in next(lines, [])]
        rows = []
        for row in lines:
            texts = [text.strip() for text in row]
            if any(texts):
                cells = dict.fromkeys(columns, "") | dict(zip(columns, texts, strict=False))
                rows.append(Row(path, f"line {lines.line_num}", cells))
    except csv.Error as error:
        raise InputError(f"{path}: is not a CSV file: {error}; allowed: CSV with commas") from None
    return columns, rows
