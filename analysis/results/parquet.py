"""The parquet files of a results folder: records as tables, in files that are named by hashes.

The name of a file, ``CONTENT-BYTES.parquet``, has two hashes. The first identifies the cells and
replications in the file (for an event log, its cell and replication); the second is a hash of its
bytes, by which a damaged file is noticed.
"""

import json
import re
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from analysis.results.chunks import Chunk, name_of, short_hash
from dess import InputError
from dess.files import replacing, writable
from dess.record import MISSION_RECORD, UAV_RECORD, Records
from dess.state import END_NAMES

NAME = re.compile(r"[0-9a-f]{16}(-\d+)?-[0-9a-f]{16}\.parquet")
_PARTS = b"dess.parts"  # key of the metadata that lists the parts in a file, in their order
_KEY = pa.dictionary(pa.int32(), pa.string())


def _columns(record: np.dtype) -> list[tuple[str, pa.DataType]]:
    assert record.fields is not None
    return [(name, pa.from_numpy_dtype(kind[0])) for name, kind in record.fields.items()]


# The columns of the tables; ``cell`` is the key of the team and the scenario.
MISSIONS = pa.schema([("cell", _KEY), *_columns(MISSION_RECORD)])
UAVS = pa.schema(
    [("cell", _KEY), ("replication", pa.int64()), ("uav", pa.int64()), *_columns(UAV_RECORD)]
)
UAVS = UAVS.set(UAVS.get_field_index("end"), pa.field("end", pa.string()))


class Tables(NamedTuple):
    """The two tables of a chunk: one row per mission, and one row per UAV."""

    missions: pa.Table
    uavs: pa.Table


def tables_of(chunk: Chunk, records: Records) -> Tables:
    """The records of the missions of a chunk as tables, with their parts as metadata."""
    keys, lengths = zip(*((p.cell.key, len(p.replications)) for p in chunk.parts), strict=True)
    cells = np.repeat(keys, lengths)
    missions = {"cell": cells} | {n: records.missions[n] for n in MISSION_RECORD.names or ()}
    present = np.arange(records.uavs.shape[1]) < records.missions["uavs"][:, None]
    mission, uav = np.nonzero(present)
    uavs = {
        "cell": cells[mission],
        "replication": records.missions["replication"][mission],
        "uav": uav,
    }
    uavs |= {name: records.uavs[name][present] for name in UAV_RECORD.names or ()}
    uavs["end"] = np.array(END_NAMES)[uavs["end"]]
    return Tables(_table(missions, MISSIONS, chunk), _table(uavs, UAVS, chunk))


def tables_with(chunk: Chunk, missions: pd.DataFrame, uavs: pd.DataFrame) -> Tables:
    """The tables of a chunk from the rows of its missions, as ``rows_of`` returns them."""
    keys = {part.cell.point: part.cell.key for part in chunk.parts}
    tables = []
    for rows, schema in ((missions, MISSIONS), (uavs, UAVS)):
        columns = {name: rows[name].to_numpy() for name in schema.names if name != "cell"}
        columns["cell"] = rows["point"].map(keys).to_numpy()
        tables.append(_table(columns, schema, chunk))
    return Tables(*tables)


def _table(columns: dict[str, np.ndarray], schema: pa.Schema, chunk: Chunk) -> pa.Table:
    arrays = {name: pa.array(np.ascontiguousarray(values)) for name, values in columns.items()}
    arrays["cell"] = arrays["cell"].dictionary_encode()
    return pa.table(arrays, schema=schema.with_metadata({_PARTS: json.dumps(chunk.rows)}))


def check(missions: pa.Table, chunk: Chunk, seed: int) -> None:
    """Check the replications, the seed and the values of missions before they are written.

    Raises:
        ValueError: If they are not those of the chunk, or a value is not finite.
    """
    wanted = np.concatenate([part.replications for part in chunk.parts])
    if not np.array_equal(missions["replication"], wanted):
        raise ValueError("the records are not those of the requested replications")
    if set(missions["seed"].to_pylist()) != {seed}:
        raise ValueError(f"the records are not of seed {seed}")
    for field in missions.schema:
        column = missions[field.name]
        if pa.types.is_floating(field.type) and not np.isfinite(column).all():
            raise ValueError(f"the records have a {field.name} that is not a number")


def parts_in(table: pa.Table) -> list[tuple[str, int, int]]:
    """The parts in a table: the key, start and stop of each."""
    return json.loads((table.schema.metadata or {}).get(_PARTS, b"[]"))


def content_hash(path: Path) -> str:
    """The part of a file's name that identifies the content of the file."""
    return path.stem.rpartition("-")[0]


def write(folder: Path, name: str, table: pa.Table) -> Path:
    """Write a table into a folder, completely or not at all, and return its file.

    Raises:
        InputError: If it cannot be written.
    """
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    content = sink.getvalue().to_pybytes()
    path = folder / f"{name}-{short_hash(content)}.parquet"
    with writable(path):
        path.parent.mkdir(exist_ok=True)
    with replacing(path) as temporary, writable(path):
        temporary.write_bytes(content)
    return path


def read(path: Path, schema: pa.Schema | None = None) -> pa.Table | None:
    """Read a table; the result is None if the file is damaged or has another schema.

    Raises:
        InputError: If it cannot be read.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; allowed: a file") from None
    try:
        if short_hash(content) != path.stem.rpartition("-")[2]:
            return None
        table = pq.ParquetFile(pa.BufferReader(content)).read(use_threads=False)
    except (OSError, pa.ArrowException):  # what pyarrow raises
        return None
    return table if schema is None or table.schema.equals(schema) else None


def files_in(folder: Path) -> list[Path]:
    """The files in a folder that a run may have written."""
    return sorted(path for path in folder.glob("*.parquet") if NAME.fullmatch(path.name))


def tables_in(folder: Path, schema: pa.Schema) -> tuple[dict[str, pa.Table], list[Path]]:
    """The tables in a folder, by the hash of their content, and the damaged files in it.

    A file is damaged if its content is not what its name says. Two files with different records of
    the same missions both count as damaged, since it is unknown which one is right.
    """
    tables, damaged = {}, []
    sound: dict[str, list[tuple[Path, pa.Table]]] = defaultdict(list)
    for path in files_in(folder):
        table = read(path, schema)
        if table is None or name_of(parts_in(table)) != content_hash(path):
            damaged.append(path)
        else:
            sound[content_hash(path)].append((path, table))
    for name, files in sound.items():
        first = files[0][1]
        if all(table.equals(first) for _, table in files):
            tables[name] = first
        else:
            damaged += [path for path, _ in files]
    return tables, damaged


def missions_in(folder: Path) -> int:
    """The number of missions in a results folder, without those in damaged files."""
    files = folder.glob("missions/policy=*/*.parquet")
    return sum(len(table) for path in files if (table := read(path, MISSIONS)) is not None)
