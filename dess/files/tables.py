"""Tables in parquet files."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dess.code.memory import check_memory
from dess.errors import InputError
from dess.files.reading import read_bytes
from dess.files.writing import write_file

LIMIT = 2**30  # bytes of the largest file
# The types of columns in words, and the types of Arrow that they may have.
_WORDS = {str: "text", bool: "truth values", int: "integers", float: "numbers"}
_TYPES = {
    str: (pa.types.is_string, pa.types.is_large_string),
    bool: (pa.types.is_boolean,),
    int: (pa.types.is_integer,),
    float: (pa.types.is_integer, pa.types.is_floating),
}


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


def read_table(path: Path, columns: Mapping[str, type] | None = None) -> pa.Table:
    """Read a table.

    Args:
        path: The file.
        columns: The columns that are read, each of ``str``, ``bool``, ``int`` or ``float`` (finite
            numbers, also integers); others are left out. By default all, of any type.

    Raises:
        InputError: If there is no such file, if it is no such table, or takes more memory than
            there is.
    """
    try:
        file = pq.ParquetFile(pa.BufferReader(read_bytes(path, LIMIT)))
        wanted = [*columns] if columns else file.schema_arrow.names
        if missing := [name for name in wanted if name not in file.schema_arrow.names]:
            raise InputError(f"{path}: has no column {missing[0]}; allowed: {', '.join(wanted)}")
        check_size(path, file.metadata)
        table = file.read(wanted, use_threads=False)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: no such file; allowed: a parquet file") from None
    except InputError:
        raise
    except (OSError, KeyError, ValueError, pa.ArrowException):  # what pyarrow raises
        raise InputError(f"{path}: damaged, or no parquet file; allowed: a parquet file") from None
    for name, kind in (columns or {}).items():
        if not len(table) or not _is_of(kind, table[name]):
            raise InputError(f"{path}: {name} has other values; allowed: {_WORDS[kind]}")
    return table


def _is_of(kind: type, column: pa.ChunkedArray) -> bool:
    """Whether all values of a column are there, of a type, and finite."""
    if column.null_count or not any(of_kind(column.type) for of_kind in _TYPES[kind]):
        return False
    return kind is not float or bool(np.isfinite(column.to_numpy()).all())


def check_size(path: Path, metadata: pq.FileMetaData) -> None:
    """Refuse a file whose content is larger than the memory, although the file is small.

    Raises:
        InputError: If it is.
    """
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    columns = [group.column(n) for group in groups for n in range(metadata.num_columns)]
    size = sum(group.total_byte_size for group in groups)
    size += 8 * sum(column.num_values for column in columns)
    check_memory(f"{path}: {metadata.num_rows:,} rows", 3 * size, "a smaller table")
