"""The parquet files of a results folder: records as tables, in files that are named by hashes.

The name of a file, ``CONTENT-BYTES.parquet``, has two hashes. The first identifies the cells and
replications in the file (for an event log, its cell and replication); the second is a hash of its
bytes, by which a damaged file is noticed.
"""

import json
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pydantic import Field, TypeAdapter

from dess.analysis.bound import Bound
from dess.analysis.metrics import HOME, NODE_AGES, NODE_RATIOS, WINDOWS
from dess.analysis.results.chunks import Chunk, name_of, short_hash
from dess.base.files.reading import paths_in, read_bytes
from dess.base.files.tables import LIMIT, parquet_of
from dess.base.files.writing import write_file
from dess.model.events import EVENT_COLUMNS, EVENT_NAMES
from dess.model.record import (
    MISSION_RECORD,
    OPERATIONS,
    UAV_RECORD,
    YEAR_OPERATIONS,
    YEAR_RECORD,
    Records,
    node_ratios,
    nodes_of,
)
from dess.model.state import END_NAMES
from dess.physics.streams import MAX_REPLICATION
from dess.scenario.fields import MOST_CELLS, MOST_NODES, MOST_SLOTS, MOST_UAVS

NAME = re.compile(r"[0-9a-f]{16}(-\d+)?-[0-9a-f]{16}\.parquet")
PARTS = b"dess.parts"  # key of the metadata that lists the parts in a file, in their order
KEY = pa.dictionary(pa.int32(), pa.string())
Columns = Mapping[str, Any]  # the values of every column of a table
Number = Annotated[int, Field(ge=0, le=MAX_REPLICATION + 1)]
Row = tuple[str, Number, Number]  # the key of a cell, with the start and stop of its replications
_ROWS = TypeAdapter(Annotated[list[Row], Field(min_length=1)])
MEASURED = YEAR_OPERATIONS.names or ()  # nan where a mission lacks it
# The columns of words, and the words.
WORDS = {"end": END_NAMES, "event": EVENT_NAMES}


def _record_columns(record: np.dtype) -> list[tuple[str, pa.DataType]]:
    assert record.fields is not None
    return [(name, pa.from_numpy_dtype(kind[0])) for name, kind in record.fields.items()]


# The columns of the tables; ``cell`` is the key of the team and the scenario.
MISSIONS = pa.schema([("cell", KEY), *_record_columns(MISSION_RECORD)])
# With what extended scenarios measure; nan where a mission lacks it.
EXTENDED_MISSIONS = pa.schema([*MISSIONS, *_record_columns(OPERATIONS)])
# With the ratio and the age of every node [slots], where scenarios have a data sheet.
NODES = (NODE_RATIOS, NODE_AGES)
SHEET_MISSIONS = pa.schema(
    [*EXTENDED_MISSIONS, *((name, pa.list_(pa.float64())) for name in NODES)]
)
# Of years with weather.
YEARS = pa.schema(
    [
        ("cell", KEY),
        *_record_columns(YEAR_RECORD),
        *_record_columns(YEAR_OPERATIONS),
        *((name, pa.list_(pa.float64())) for name in NODES),
    ]
)
UAVS = pa.schema(
    [("cell", KEY), ("replication", pa.int64()), ("uav", pa.int64()), *_record_columns(UAV_RECORD)]
)
UAVS = UAVS.set(UAVS.get_field_index("end"), pa.field("end", pa.string()))
# ``prices`` has a value for every cut and node, the nodes of the first cut first.
BOUNDS = pa.schema(
    [
        ("cell", KEY),
        ("replication", pa.int64()),
        ("ratio", pa.float64()),
        ("iterations", pa.int64()),
        ("cuts", pa.list_(pa.int64())),
        ("prices", pa.list_(pa.float64())),
    ]
)
EVENTS = pa.schema(
    (name, pa.string() if kind is object else pa.from_numpy_dtype(kind))
    for name, kind in EVENT_COLUMNS.items()
)

# The columns that files of earlier versions lack, the latest first. Version 0.2 had no ways home,
# and fewer columns of the event log; earlier ones of version 0.3 do not say what was charged and
# which UAVs are down.
_ADDED_TO_MISSIONS = ((HOME,),)
_ADDED_TO_UAVS = (("charged", "down"), ("way_home",))
_ADDED_TO_EVENTS = (tuple(EVENTS.names[7:]),)


def _with_earlier(schema: pa.Schema, added: Iterable[Sequence[str]]) -> list[pa.Schema]:
    """A schema, and those of earlier versions: each lacks what was added next."""
    schemas = [schema]
    for names in added:
        schemas.append(pa.schema([field for field in schemas[-1] if field.name not in names]))
    return schemas


_OF_MISSIONS = (_with_earlier(kind, _ADDED_TO_MISSIONS) for kind in (MISSIONS, EXTENDED_MISSIONS))
# The schemas that files may have.
SCHEMAS = {
    "missions": [SHEET_MISSIONS, YEARS, *chain(*zip(*_OF_MISSIONS, strict=True))],
    "uavs": _with_earlier(UAVS, _ADDED_TO_UAVS),
    "bounds": [BOUNDS],
    "events": _with_earlier(EVENTS, _ADDED_TO_EVENTS),
}
# The least and the largest value of the columns that are used as indices and as sizes.
INDICES = {
    "time": (0, MOST_SLOTS),
    "uavs": (1, MOST_UAVS),
    "uav": (-1, MOST_UAVS - 1),
    "other": (-1, MOST_UAVS - 1),
    "node": (-1, MOST_NODES - 1),
    "x": (-1, MOST_CELLS),
    "y": (-1, MOST_CELLS),
}
_MOST = float(np.finfo(float).max)
# The columns of floats that may be nan; all others are finite.
MAYBE = {*MEASURED, "snr", "generated"}


def tables_of(chunk: Chunk, records: Records) -> list[pa.Table]:
    """The records of the missions of a chunk, and of their UAVs, with their parts as metadata."""
    cells = _cell_columns(chunk)
    missions = {"cell": cells} | {n: records.missions[n] for n in MISSION_RECORD.names or ()}
    if len(records.operations):
        missions |= {n: records.operations[n] for n in records.operations.dtype.names or ()}
    if len(records.nodes):
        missions |= columns_of_nodes(records)
    present = np.arange(records.uavs.shape[1]) < records.missions["uavs"][:, None]
    mission, uav = np.nonzero(present)
    uavs = {
        "cell": cells[mission],
        "replication": records.missions["replication"][mission],
        "uav": uav,
    }
    uavs |= {name: records.uavs[name][present] for name in UAV_RECORD.names or ()}
    uavs["end"] = np.array(END_NAMES)[uavs["end"]]
    return tables_with(chunk, missions, uavs)


def columns_of_nodes(records: Records) -> dict[str, Any]:
    """What is kept of the nodes of missions with a data sheet: for each mission (K,) values."""
    nodes = [nodes_of(row) for row in records.nodes]
    return {
        NODE_RATIOS: [node_ratios(of_mission) for of_mission in nodes],
        NODE_AGES: [of_mission["age"] for of_mission in nodes],
    }


def tables_with(
    chunk: Chunk, missions: Mapping[str, Any], uavs: Mapping[str, Any]
) -> list[pa.Table]:
    """The tables of a chunk from their columns, such as those of ``rows_of``."""
    is_extended = any(name in missions and not np.isnan(missions[name]).all() for name in MEASURED)
    if WINDOWS in missions:
        schema = YEARS
    elif all(name in missions for name in NODES):
        schema = SHEET_MISSIONS
    elif is_extended:
        schema = EXTENDED_MISSIONS
    else:
        schema = MISSIONS
    return [_arrow_table(missions, schema, chunk), _arrow_table(uavs, UAVS, chunk)]


def table_of_bounds(chunk: Chunk, bounds: Sequence[Bound]) -> pa.Table:
    """The bounds of the missions of a chunk as a table, with their parts as metadata."""
    columns = {
        "cell": _cell_columns(chunk),
        "replication": np.concatenate([part.replications for part in chunk.parts]),
        "ratio": [bound.ratio for bound in bounds],
        "iterations": [bound.iterations for bound in bounds],
        "cuts": [bound.cuts.tolist() for bound in bounds],
        "prices": [bound.prices.ravel().tolist() for bound in bounds],
    }
    return _arrow_table(columns, BOUNDS, chunk)


def _cell_columns(chunk: Chunk) -> np.ndarray:
    """The key of the cell of every mission."""
    keys, lengths = zip(*((p.cell.key, len(p.replications)) for p in chunk.parts), strict=True)
    return np.repeat(keys, lengths)


def _arrow_table(columns: Columns, schema: pa.Schema, chunk: Chunk) -> pa.Table:
    arrays = {name: pa.array(columns[name]) for name in schema.names}
    arrays["cell"] = arrays["cell"].dictionary_encode()
    return pa.table(arrays, schema=schema.with_metadata({PARTS: json.dumps(chunk.rows)}))


def are_of(tables: Sequence[pa.Table], rows: Sequence[Row]) -> bool:
    """Whether every table has the missions of some parts, in their order, with all UAVs.

    What a record says of its mission is not checked: ``dess verify`` simulates missions again.

    Args:
        tables: The records of missions and those of their UAVs, or the bounds of missions.
        rows: The key, start and stop of every part, in the order of the records.
    """
    keys, starts, stops = zip(*rows, strict=True)
    lengths = np.subtract(stops, starts)
    missions, *others = tables
    if lengths.sum() != len(missions):  # before memory is taken for them
        return False
    cells = np.repeat(np.array(keys, object), lengths)
    replications = np.concatenate([*map(np.arange, starts, stops)])
    if not others:
        return _are_of(missions, cells, replications)
    fleet = missions["uavs"].to_numpy()
    (uavs,) = others
    first = np.repeat(np.cumsum(fleet) - fleet, fleet)
    return (
        _are_of(missions, cells, replications)
        and np.array_equal(uavs["uav"], np.arange(len(first)) - first)
        and _are_of(uavs, np.repeat(cells, fleet), np.repeat(replications, fleet))
    )


def _are_of(table: pa.Table, cells: np.ndarray, replications: np.ndarray) -> bool:
    """Whether the rows of a table are those of some missions."""
    keys = table["cell"].unify_dictionaries().combine_chunks()
    names = np.array(keys.dictionary.to_pylist(), object)
    return np.array_equal(table["replication"], replications) and np.array_equal(
        names[keys.indices.to_numpy()], cells
    )


def parts_in(table: pa.Table) -> list[Row]:
    """The parts in a table: the key, start and stop of each.

    Raises:
        ValueError: If the file lists none, or some that are no parts.
    """
    rows = _ROWS.validate_json((table.schema.metadata or {}).get(PARTS, b""))
    if any(start >= stop for _, start, stop in rows):
        raise ValueError("a part has no replications")
    return rows


def is_log(path: Path) -> bool:
    """Whether a file is an event log without damage."""
    return _is_log(*_file_state(path))


@lru_cache(2**16)
def _is_log(path: Path, *_: int) -> bool:
    return read(path) is not None


File = tuple[Path, int, int, int]


def _file_state(path: Path) -> File:
    """A file with its number, size and time; if they stay the same, it is not read again."""
    status = path.stat()
    return path, status.st_ino, status.st_size, status.st_mtime_ns


def content_hash(path: Path) -> str:
    """The part of a file's name that identifies the content of the file."""
    return path.stem.rpartition("-")[0]


def write(folder: Path, name: str, table: pa.Table) -> Path:
    """Write a table into a folder, completely or not at all, and return its file.

    Raises:
        InputError: If it cannot be written.
    """
    content = parquet_of(table)
    path = folder / f"{name}-{short_hash(content)}.parquet"
    write_file(path, content)
    return path


def read(path: Path, kind: str = "events") -> pa.Table | None:
    """Read a table; the result is None if the file is damaged or has another schema.

    Args:
        path: The file.
        kind: One of ``SCHEMAS``; by default an event log.

    Raises:
        InputError: If it cannot be read.
    """
    content = read_bytes(path, LIMIT, "a file of results")
    if short_hash(content) != path.stem.rpartition("-")[2]:
        return None
    try:
        table = pq.ParquetFile(pa.BufferReader(content)).read(use_threads=False)
        is_known = any(map(table.schema.equals, SCHEMAS[kind])) and _are_valid(table)
    except (OSError, KeyError, ValueError, pa.ArrowException):  # what pyarrow raises
        return None
    return table if is_known else None


def _are_valid(table: pa.Table) -> bool:
    """Whether no value is missing, and every number and word is one that its column may have."""
    for name, column in zip(table.column_names, table.columns, strict=True):
        if column.null_count:
            return False
        if name in WORDS and not pc.all(pc.is_in(column, pa.array(WORDS[name]))).as_py():
            return False
        if limits := _column_limits(name, column.type):
            low, high = limits
            values = column.to_numpy()
            if not ((values >= low) & (values <= high)).all():
                return False
    for name in (name for name in NODES if name in table.column_names):
        counts = pc.list_value_length(table[name]).to_numpy()
        values = pc.list_flatten(table[name]).to_numpy()
        if not ((counts > 0) & (counts <= MOST_NODES)).all() or not np.isfinite(values).all():
            return False
    if "cuts" in table.column_names:  # there are prices for every cut, as many of each
        cuts, prices = (pc.list_value_length(table[name]).to_numpy() for name in ("cuts", "prices"))
        return bool((cuts > 0).all() and not (prices % cuts).any())
    return "event" not in table.column_names or "mission_end" in table["event"].to_pylist()


def _column_limits(name: str, kind: pa.DataType) -> tuple[float, float] | None:
    """The least and the largest value of a column, if it has any."""
    if name in INDICES:
        return INDICES[name]
    if pa.types.is_floating(kind) and name not in MAYBE:
        return (-_MOST, _MOST)
    return None


def files_in(folder: Path, pattern: str = "*.parquet") -> list[Path]:
    """The files in a folder that a run may have written, of those that match a pattern."""
    paths = (path for path in paths_in(folder, pattern) if NAME.fullmatch(path.name))
    return [path for path in paths if path.is_file() and not path.is_symlink()]


Found = tuple[dict[str, pa.Table], list[Path]]


def tables_in(folder: Path, kind: str) -> Found:
    """The tables in a folder, by the hash of their content, and the damaged files in it.

    A file is damaged if its content is not what its name says. Two files with different records of
    the same missions both count as damaged, since it is unknown which one is right.
    """
    return _tables_of(tuple(map(_file_state, files_in(folder))), kind)


@lru_cache(64)
def _tables_of(files: tuple[File, ...], kind: str) -> Found:
    damaged = []
    sound: dict[str, dict[Path, pa.Table]] = defaultdict(dict)
    for path, *_ in files:
        table = read(path, kind)
        if table is not None and _name_in(table) == content_hash(path):
            sound[content_hash(path)][path] = table
        else:
            damaged.append(path)
    tables = {}
    for name, same in sound.items():
        first, *others = same.values()
        if all(_are_equal(other, first) for other in others):
            tables[name] = first
        else:
            damaged += same
    return tables, damaged


def _are_equal(a: pa.Table, b: pa.Table) -> bool:
    """Whether two tables are equal, where nan equals nan; arrow holds that it does not."""
    return a.equals(b) or a.to_pandas().equals(b.to_pandas())


def _name_in(table: pa.Table) -> str:
    """The first half of the name that the file of a table must have; empty without valid parts."""
    try:
        return name_of(parts_in(table))
    except ValueError:
        return ""


def missions_in(folder: Path) -> int:
    """The number of missions in a results folder, without those in damaged files."""
    tables = (read(path, "missions") for path in files_in(folder, "missions/policy=*/*.parquet"))
    return sum(len(table) for table in tables if table is not None)
