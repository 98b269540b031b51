"""Results folders as somebody would make them who wants to harm their reader.

The files are valid: parquet files have the hashes in their names, and the cells have their keys. So
a command that reads such a folder gets as far as with sound results, and shows the strings.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from dess.analysis.results import parquet
from dess.analysis.results.chunks import FOLDERS, Chunk
from dess.analysis.results.manifest import CellPart, Manifest
from dess.analysis.results.rows import rows_of, stack_tables
from dess.analysis.results.store import Store

LONGEST = 120  # bytes of a file's name that are made of the text


def hostile_folder(sound: Path, into: Path, text: str) -> Path:
    """Copy a small complete results folder, with a text in its strings and in names of files.

    The text enters every string that is free: the names of policies, of their members, weights and
    learners, the description, the scenario and the currency of the study. All other strings, such
    as hashes and versions, have a form that reading checks. The names of the policies end in their
    numbers, since they have to differ.

    Args:
        sound: The results folder; it is not changed.
        into: The folder to write, which must not exist.
        text: The text. Reading refuses it if it has characters that cannot be printed.

    Returns:
        The folder ``into``.
    """
    source = Store.read(sound)
    # Nothing is validated, so that texts that reading refuses reach the folder as well.
    manifest = source.manifest.model_copy(update=_changed(source.manifest, text))
    into.mkdir(parents=True)
    store = Store(into, manifest)
    for name in FOLDERS:
        (into / name).mkdir()
    for team, cells in enumerate(manifest.cells):
        for parts in (source.manifest.parts_of_team(team), source.manifest.parts_of_check(team)):
            if parts:
                _copy(source, store, parts, [cells[part.cell.point] for part in parts])
    for cell, replication in source.contents.logged:
        log = source.contents.load_log(cell, replication)
        assert log is not None
        columns = dict(zip(log.column_names, log.columns, strict=True))
        store.keep_log(manifest.cells[cell.team][cell.point], replication, columns)
    (into / "manifest.json").write_text(manifest.text, "utf-8")
    _add_files(into, text)
    return into


def forged(path: Path, column: str, change: Callable[[list], list]) -> Path:
    """Change a column of a parquet file, under the name that belongs to its bytes."""
    table = pq.read_table(path, partitioning=None)
    path.unlink()
    number = table.schema.get_field_index(column)
    values = [change(table[column].to_pylist())]
    table = table.set_column(number, table.schema.field(number), values)
    return parquet.write(path.parent, parquet.content_hash(path), table)


def _changed(manifest: Manifest, text: str) -> dict[str, Any]:
    """The fields of the manifest that contain free strings."""
    names = {team.policy: f"{text}{n}" for n, team in enumerate(manifest.policies)}
    teams = []
    for team in manifest.policies:
        strings = {"name": text, "weights": text, "learner": text}
        members = [member.model_copy(update=strings) for member in team.members]
        teams.append(team.model_copy(update={"policy": names[team.policy], "members": members}))
    study = {
        "policies": tuple(names.values()),
        "description": text,
        "scenario": text.replace("/", "\u2215"),  # the name of a file
    }
    if costs := manifest.study.costs:
        study["costs"] = costs.model_copy(update={"currency": text[:16]})
    return {"policies": teams, "study": manifest.study.model_copy(update=study)}


def _copy(source: Store, store: Store, parts: list[CellPart], cells: Any) -> None:
    """Copy missions as one file under the keys of other cells."""
    chunk = Chunk(
        parts[0].cell.team,
        tuple(CellPart(cell, p.replications) for cell, p in zip(cells, parts, strict=True)),
    )
    tables = zip(*source.contents.tables_with("missions", parts), strict=True)
    rows = [rows_of(parts, stack_tables(of_kind)) for of_kind in tables]
    keys = {part.cell.key: cell.key for part, cell in zip(parts, cells, strict=True)}
    columns = [{str(n): of[n].to_numpy() for n in of} for of in rows]
    columns = [of | {"cell": np.array([keys[key] for key in of["cell"]])} for of in columns]
    store.keep("missions", chunk, parquet.tables_with(chunk, *columns))


def _add_files(folder: Path, text: str) -> None:
    """Files and folders with the text in their names, among those that belong to the results."""
    safe = text.replace("/", "\u2215").replace("\0", "\u2400")
    name = safe.encode("utf-8", "replace")[:LONGEST].decode("utf-8", "ignore")
    for parent in (folder, *(folder / kind for kind in FOLDERS)):
        (parent / f"{name}.json").write_text(json.dumps(text))
        (parent / f"policy={name}").mkdir(exist_ok=True)
        (parent / f"policy={name}" / f"{name}.parquet").write_bytes(b"PAR1")
