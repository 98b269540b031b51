"""The parquet files of a results folder: records as tables, in files that are named by hashes.

The name of a file, ``CONTENT-BYTES.parquet``, has two hashes. The first identifies the cells and
replications in the file (for an event log, its cell and replication); the second is a hash of its
bytes, by which a damaged file is noticed.
"""

import json
import re
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import Field, TypeAdapter

from analysis.results.chunks import Chunk, name_of, short_hash
from analysis.results.documents import Key, Replication
from dess import InputError
from dess.files.reading import paths_in, read_bytes
from dess.files.tables import LIMIT, check_size, parquet_of
from dess.files.writing import write_file
from dess.record import EVENT_NAMES, MISSION_RECORD, OPERATIONS, UAV_RECORD, Records
from dess.scenario import MOST_CELLS, MOST_NODES, MOST_SLOTS, MOST_UAVS
from dess.state import END_NAMES
from dess.streams import MAX_REPLICATION

NAME = re.compile(r"[0-9a-f]{16}(-\d+)?-[0-9a-f]{16}\.parquet")
PARTS = b"dess.parts"  # key of the metadata that lists the parts in a file, in their order
KEY = pa.dictionary(pa.int32(), pa.string())
Row = tuple[Key, Replication, Annotated[int, Field(ge=1, le=MAX_REPLICATION + 1)]]
_ROWS = TypeAdapter(Annotated[list[Row], Field(min_length=1)])
# The columns of words, and the words.
WORDS = {"end": END_NAMES, "event": EVENT_NAMES}


def _columns(record: np.dtype) -> list[tuple[str, pa.DataType]]:
    assert record.fields is not None
    return [(name, pa.from_numpy_dtype(kind[0])) for name, kind in record.fields.items()]


# The columns of the tables; ``cell`` is the key of the team and the scenario.
MISSIONS = pa.schema([("cell", KEY), *_columns(MISSION_RECORD)])
# With what extended scenarios measure; nan where a mission lacks it.
EXTENDED_MISSIONS = pa.schema([*MISSIONS, *_columns(OPERATIONS)])
UAVS = pa.schema(
    [("cell", KEY), ("replication", pa.int64()), ("uav", pa.int64()), *_columns(UAV_RECORD)]
)
UAVS = UAVS.set(UAVS.get_field_index("end"), pa.field("end", pa.string()))
EVENTS = pa.schema(
    [
        ("time", pa.float64()),
        ("event", pa.string()),
        ("uav", pa.int64()),
        ("node", pa.int64()),
        *((name, pa.float64()) for name in ("value", "x", "y")),
        ("battery", pa.int64()),
        ("other", pa.int64()),
        ("snr", pa.float64()),
        ("packet", pa.int64()),
        ("generated", pa.float64()),
    ]
)
# Event logs of before had the first columns only.
FORMER_EVENTS = pa.schema([EVENTS.field(name) for name in EVENTS.names[:7]])


class Tables(NamedTuple):
    """The two tables of a chunk: one row per mission, and one row per UAV."""

    missions: pa.Table
    uavs: pa.Table


def tables_of(chunk: Chunk, records: Records) -> Tables:
    """The records of the missions of a chunk as tables, with their parts as metadata."""
    keys, lengths = zip(*((p.cell.key, len(p.replications)) for p in chunk.parts), strict=True)
    cells = np.repeat(keys, lengths)
    missions = {"cell": cells} | {n: records.missions[n] for n in MISSION_RECORD.names or ()}
    if len(records.operations):
        missions |= {n: records.operations[n] for n in OPERATIONS.names or ()}
    present = np.arange(records.uavs.shape[1]) < records.missions["uavs"][:, None]
    mission, uav = np.nonzero(present)
    uavs = {
        "cell": cells[mission],
        "replication": records.missions["replication"][mission],
        "uav": uav,
    }
    uavs |= {name: records.uavs[name][present] for name in UAV_RECORD.names or ()}
    uavs["end"] = np.array(END_NAMES)[uavs["end"]]
    return Tables(_missions_table(missions, chunk), _table(uavs, UAVS, chunk))


def tables_with(chunk: Chunk, missions: pd.DataFrame, uavs: pd.DataFrame) -> Tables:
    """The tables of a chunk from the rows of its missions, as ``rows_of`` returns them."""
    keys = {part.cell.point: part.cell.key for part in chunk.parts}

    def columns_of(rows: pd.DataFrame) -> dict[str, np.ndarray]:
        columns = {str(name): rows[name].to_numpy() for name in rows if name != "point"}
        return columns | {"cell": rows["point"].map(keys).to_numpy()}

    return Tables(
        _missions_table(columns_of(missions), chunk), _table(columns_of(uavs), UAVS, chunk)
    )


def _missions_table(columns: dict[str, np.ndarray], chunk: Chunk) -> pa.Table:
    """The table of the missions of a chunk: an extended one, if anything beyond was measured."""
    names = [name for name in OPERATIONS.names or () if name in columns]
    if any(not np.isnan(columns[name]).all() for name in names):
        return _table(columns, EXTENDED_MISSIONS, chunk)
    return _table({n: v for n, v in columns.items() if n not in names}, MISSIONS, chunk)


def _table(columns: dict[str, np.ndarray], schema: pa.Schema, chunk: Chunk) -> pa.Table:
    arrays = {name: pa.array(np.ascontiguousarray(values)) for name, values in columns.items()}
    arrays["cell"] = arrays["cell"].dictionary_encode()
    return pa.table(arrays, schema=schema.with_metadata({PARTS: json.dumps(chunk.rows)}))


def check(tables: Tables, rows: Sequence[Row], seed: int) -> None:
    """Check that tables have the records of some parts, and nothing that no mission can have.

    Args:
        tables: The records, such as those of a worker or of a file that anybody may have written.
        rows: The key, start and stop of every part, in the order of the records.
        seed: The seed of the missions.

    Raises:
        ValueError: If the records are those of other missions, or a value is out of range.
    """
    missions, uavs = tables
    keys, lengths = [key for key, _, _ in rows], [stop - start for _, start, stop in rows]
    wanted = np.concatenate([range(start, stop) for _, start, stop in rows])
    replications = missions["replication"].to_numpy()
    if not np.array_equal(replications, wanted):
        raise ValueError("the records are not those of the requested replications")
    if (missions["seed"].to_numpy() != seed).any():
        raise ValueError(f"the records are not of seed {seed}")
    _check_numbers(missions)
    _check_numbers(uavs)
    fleet = missions["uavs"].to_numpy()
    if fleet.min() < 1 or fleet.max() > MOST_UAVS or fleet.sum() != len(uavs):
        raise ValueError("the records are not those of all UAVs")
    first = np.repeat(np.cumsum(fleet) - fleet, fleet)
    if not (
        np.array_equal(uavs["replication"], np.repeat(replications, fleet))
        and np.array_equal(uavs["uav"], np.arange(len(uavs)) - first)
    ):
        raise ValueError("the records are not those of all UAVs")
    cells = np.repeat(np.arange(len(rows)), lengths)
    _check_cells(missions, keys, cells)
    _check_cells(uavs, keys, np.repeat(cells, fleet))


def _check_numbers(table: pa.Table) -> None:
    """Check that the numbers are finite, or not measured, and none but a reward is below 0."""
    for name, column in zip(table.column_names, table.columns, strict=True):
        if column.null_count:
            raise ValueError(f"the records have no {name}")
        values = column.to_numpy() if pa.types.is_floating(column.type) else np.zeros(0)
        if name in (OPERATIONS.names or ()):
            values = values[~np.isnan(values)]
        if not np.isfinite(values).all():
            raise ValueError(f"the records have a {name} that is not a number")
        is_number = pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
        if is_number and name != "reward" and (column.to_numpy() < 0).any():
            raise ValueError(f"the records have a {name} below 0")


def _check_cells(table: pa.Table, keys: Sequence[str], wanted: np.ndarray) -> None:
    """Check that the cell of every row is the wanted one, by its place among the keys."""
    places = {key: place for place, key in reversed([*enumerate(keys)])}
    numbers = [places[keys[place]] for place in range(len(keys))]
    found = [
        np.array([places.get(key, -1) for key in chunk.dictionary.to_pylist()], int)[chunk.indices]
        for chunk in table["cell"].chunks
    ]
    if not np.array_equal(np.concatenate(found), np.array(numbers)[wanted]):
        raise ValueError("the records are not those of the requested cells")


def parts_in(table: pa.Table) -> list[Row]:
    """The parts in a table: the key, start and stop of each.

    Raises:
        ValueError: If the file lists none, or some that are no parts.
    """
    rows = _ROWS.validate_json((table.schema.metadata or {}).get(PARTS, b""))
    if any(start >= stop for _, start, stop in rows):
        raise ValueError("a part has no replications")
    return rows


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


def read(path: Path, schema: pa.Schema = EVENTS) -> pa.Table | None:
    """Read a table; the result is None if the file is damaged or has another schema.

    Args:
        path: The file.
        schema: The schema; by default that of an event log, whose values are checked as well. The
            schema of missions stands for that of extended missions too, and that of event logs
            for that of before.

    Raises:
        InputError: If it cannot be read, or takes more memory than there is.
    """
    content = read_bytes(path, LIMIT, "a file of results")
    if short_hash(content) != path.stem.rpartition("-")[2]:
        return None
    words = [name for name in schema.names if name in WORDS]
    try:
        # Texts stay numbers until it is known that they are few: a long one may be in every row.
        file = pq.ParquetFile(pa.BufferReader(content), read_dictionary=words)
        if schema is MISSIONS and file.schema_arrow.names == EXTENDED_MISSIONS.names:
            schema = EXTENDED_MISSIONS
        if schema is EVENTS and file.schema_arrow.names == FORMER_EVENTS.names:
            schema = FORMER_EVENTS
        if file.schema_arrow.names != schema.names:
            return None
        check_size(path, file.metadata)
        table = file.read(use_threads=False)
        for name in words:
            table = table.set_column(*_spelled(table, name))
    except InputError:
        raise
    except (OSError, KeyError, ValueError, pa.ArrowException):  # what pyarrow raises
        return None
    if not table.schema.equals(schema):
        return None
    return table if schema not in (EVENTS, FORMER_EVENTS) or _is_log(table) else None


def _spelled(table: pa.Table, name: str) -> tuple[int, str, pa.ChunkedArray]:
    """The place, name and words of a column of words.

    Raises:
        ValueError: If there are other words.
    """
    column = table[name]
    for chunk in column.chunks:
        if not {*chunk.dictionary.to_pylist()} <= {*WORDS[name]}:
            raise ValueError(f"{name}: has other words")
    return table.column_names.index(name), name, column.cast(pa.string())


def _is_log(table: pa.Table) -> bool:
    """Whether a table may be the event log of a mission, with a time and cells that exist."""
    if not len(table) or any(column.null_count for column in table.columns):
        return False
    limits = {"uav": (-1, MOST_UAVS - 1), "node": (-1, MOST_NODES - 1), "time": (0, MOST_SLOTS)}
    limits |= dict.fromkeys(("x", "y"), (-1, MOST_CELLS))
    if "battery" in table.column_names:
        limits |= {"battery": (-1, 100), "other": (-1, MOST_UAVS - 1)}
    columns = {name: table[name].to_numpy() for name in limits}  # nan is in none of the limits
    return (
        all(low <= columns[name].min() for name, (low, _) in limits.items())
        and all(columns[name].max() <= high for name, (_, high) in limits.items())
        and bool(np.isfinite(table["value"]).all())
        and "mission_end" in table["event"].to_pylist()
    )


def files_in(folder: Path) -> list[Path]:
    """The files in a folder that a run may have written."""
    paths = (path for path in paths_in(folder, "*.parquet") if NAME.fullmatch(path.name))
    return [path for path in paths if path.is_file() and not path.is_symlink()]


def tables_in(folder: Path, schema: pa.Schema) -> tuple[dict[str, pa.Table], list[Path]]:
    """The tables in a folder, by the hash of their content, and the damaged files in it.

    A file is damaged if its content is not what its name says. Two files with different records of
    the same missions both count as damaged, since it is unknown which one is right.
    """
    tables, damaged = {}, []
    sound: dict[str, list[tuple[Path, pa.Table]]] = defaultdict(list)
    for path in files_in(folder):
        table = read(path, schema)
        if table is not None and _name_in(table) == content_hash(path):
            sound[content_hash(path)].append((path, table))
        else:
            damaged.append(path)
    for name, files in sound.items():
        first = files[0][1]
        if all(_are_equal(table, first) for _, table in files):
            tables[name] = first
        else:
            damaged += [path for path, _ in files]
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
    files = (path for part in paths_in(folder, "missions/policy=*") for path in files_in(part))
    return sum(len(table) for path in files if (table := read(path, MISSIONS)) is not None)
