"""Tables in parquet files."""

import csv
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pcsv
import pyarrow.parquet as pq

from dess.base.errors import InputError
from dess.base.files.reading import read_bytes
from dess.base.files.writing import write_file

LIMIT = 2**30  # bytes of the largest file


def write_table(path: Path, table: pa.Table) -> None:
    """Write a table, completely or not at all.

    Raises:
        InputError: If it cannot be written.
    """
    write_file(path, parquet_of(table))


def parquet_of(table: pa.Table) -> bytes:
    """The content of the parquet file of a table."""
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    return sink.getvalue().to_pybytes()


def read_table(path: Path, schema: pa.Schema | None = None) -> pa.Table:
    """Read a table.

    Args:
        path: The file.
        schema: The columns that are read, with their types; none of their values may be missing or
            infinite. Other columns are left out. By default all columns are read as they are.

    Raises:
        InputError: If there is no such file, or it is no such table.
    """
    return parse_table(read_bytes(path, LIMIT, "a parquet file"), path, schema)


def parse_table(content: bytes, path: Path, schema: pa.Schema | None = None) -> pa.Table:
    """The table in the content of a parquet file, as ``read_table`` reads it."""
    place = ""
    try:
        table = pq.ParquetFile(pa.BufferReader(content)).read(use_threads=False)
        if schema:
            for place in schema.names:
                if not _is_sound(table[place].cast(schema.field(place).type)):
                    raise ValueError
            table = table.select(schema.names).cast(schema)
        return table
    except (OSError, KeyError, ValueError, pa.ArrowException):  # what pyarrow raises
        wrong = "damaged, or no parquet file"
        if place:
            wrong = f"has no sound column {place}"
        raise InputError(path, wrong, "a parquet file") from None


def parse_columns(text: str, path: Path, delimiter: str) -> pa.Table:
    """The columns of a CSV text, all as text without spaces around it; the first line names them.

    Args:
        text: The text.
        path: The file, for messages.
        delimiter: What parts the columns.

    Raises:
        InputError: If its lines have other columns than the first one.
    """
    first, _, lines = text.partition("\n")
    if not lines.strip():
        raise InputError(path, "has no lines below the first one", "rows of a table")
    names = next(csv.reader([first], delimiter=delimiter), [])
    try:
        columns = {f"f{number}": pa.string() for number in range(len(names))}
        table = pcsv.read_csv(
            pa.BufferReader(lines.encode()),
            pcsv.ReadOptions(use_threads=False, column_names=[*columns]),
            pcsv.ParseOptions(delimiter=delimiter),
            pcsv.ConvertOptions(column_types=columns, strings_can_be_null=False),
        )
    except pa.ArrowException as error:
        problem = f"is not a CSV file: {str(error).partition(chr(10))[0]}"
        raise InputError(path, problem, "lines of as many columns as the first one") from None
    texts = [pc.utf8_trim_whitespace(column) for column in table.columns]
    return pa.table(texts, [name.strip() for name in names])


def _is_sound(column: pa.ChunkedArray) -> bool:
    """Whether a column has values, and all of them, and finite ones."""
    is_finite = not pa.types.is_floating(column.type) or pc.all(pc.is_finite(column)).as_py()
    return len(column) > 0 and not column.null_count and is_finite
