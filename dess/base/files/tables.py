"""Tables in parquet files."""

from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
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
    place = ""
    try:
        file = pq.ParquetFile(pa.BufferReader(read_bytes(path, LIMIT, "a parquet file")))
        table = file.read(use_threads=False)
        if schema:
            for place in schema.names:
                if not _is_sound(table[place].cast(schema.field(place).type)):
                    raise ValueError
            table = table.select(schema.names).cast(schema)
        return table
    except InputError:
        raise
    except (OSError, KeyError, ValueError, pa.ArrowException):  # what pyarrow raises
        wrong = "damaged, or no parquet file"
        if place:
            wrong = f"has no sound column {place}"
        raise InputError(path, wrong, "a parquet file") from None


def _is_sound(column: pa.ChunkedArray) -> bool:
    """Whether a column has values, and all of them, and finite ones."""
    is_finite = not pa.types.is_floating(column.type) or pc.all(pc.is_finite(column)).as_py()
    return len(column) > 0 and not column.null_count and is_finite
