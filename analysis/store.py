"""A results folder: parquet chunks named after what they hold, and ``manifest.json``.

``manifest.json`` says what the folder is about. ``missions/`` and ``uavs/`` hold the records in
chunks, ``events/`` the event logs. A file is named after its cell - scenario, team, seed and the
code that computed it - and its replications, and is there whole or not at all; so a run resumes by
computing what is missing. A file that is damaged counts as missing. Nothing is pickled, and nothing
in the folder depends on when, where or by how many workers it was computed.
"""

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from analysis.manifest import Cell, Manifest
from analysis.study import Study
from dess.errors import InputError
from dess.record import MISSION_RECORD, UAV_RECORD, Records
from dess.scenario import ScenarioSpace
from dess.state import END_NAMES

MANIFEST = "manifest.json"
FOLDERS = ("missions", "uavs", "events")

_CELL = b"dess.cell"  # the parquet metadata that says which cell a file belongs to


class Store:
    """The files of a results folder."""

    def __init__(self, folder: Path, manifest: Manifest):
        self.folder, self.manifest = folder, manifest

    @classmethod
    def open(cls, study: Study, out: str | Path) -> "Store":
        """Open a results folder for a study: a new one, or one that the study completes or extends.

        Raises:
            InputError: If the folder cannot be written, or holds something else.
        """
        folder, manifest = Path(out), Manifest.of(study)
        path = folder / MANIFEST
        with _writable(folder):
            if path.exists():
                Manifest.read(path).check_extended_by(manifest, path)
            elif folder.is_dir() and any(not _is_temporary(entry) for entry in folder.iterdir()):
                raise InputError(
                    f"{folder}: holds other files and no {MANIFEST}; "
                    "allowed: a results folder, or a new or empty one (another --out)"
                )
            folder.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary, _writable(path):
            temporary.write_text(json.dumps(manifest.data, indent=2) + "\n", "utf-8")
        for name in FOLDERS:
            with _writable(folder / name):
                (folder / name).mkdir(exist_ok=True)
        return cls(folder, manifest)

    def missing(self, cell: Cell, missions: int, chunk: int) -> list[range]:
        """The replications of a cell that are not there, in chunks of at most that many."""
        gaps, begin = [], 0
        present = [part for part, tables in self._chunks(cell) if tables]
        for part in [*present, range(missions, missions)]:
            end = min(part.start, missions)
            gaps += [range(first, min(first + chunk, end)) for first in range(begin, end, chunk)]
            begin = max(begin, part.stop)
        return gaps

    def missing_logs(self, cell: Cell, logged: int) -> list[int]:
        """The replications below ``logged`` whose event log is not there."""
        return [r for r in range(logged) if self.load_log(cell, r) is None]

    def write(self, cell: Cell, part: range, records: Records) -> None:
        """Keep the records of consecutive replications of a cell."""
        # Missions last: a chunk is there when they are.
        self._write(self._chunk("uavs", cell, part), cell, _uav_table(records))
        self._write(self._chunk("missions", cell, part), cell, _mission_table(records))

    def write_log(self, cell: Cell, replication: int, columns: dict[str, np.ndarray]) -> None:
        """Keep the event log of a replication of a cell."""
        self._write(self._log(cell, replication), cell, pa.table(columns))

    def load(self, cell: Cell, missions: int) -> tuple[pa.Table, pa.Table]:
        """The first missions of a cell, and their UAVs.

        Raises:
            InputError: If some are missing or damaged.
        """
        tables, damaged, begin = [], "", 0
        for part, chunk in self._chunks(cell):
            if chunk is None:
                damaged = damaged or f" (damaged: {self._chunk('missions', cell, part).name})"
            elif part.start == begin:
                tables.append(chunk)
                begin = part.stop
        if begin < missions:
            raise InputError(
                f"{self.folder}: incomplete, the first {begin} of {missions} missions of "
                f"{cell}{damaged}; allowed: run the study again to complete it"
            )
        of_missions, of_uavs = (pa.concat_tables(kind) for kind in zip(*tables, strict=True))
        wanted = pc.less(of_uavs["replication"], missions)
        return of_missions.slice(0, missions), of_uavs.filter(wanted)

    def load_log(self, cell: Cell, replication: int) -> pa.Table | None:
        """The event log of a replication of a cell, if it is there."""
        return _read(self._log(cell, replication), cell)

    def _chunks(self, cell: Cell) -> list[tuple[range, tuple[pa.Table, pa.Table] | None]]:
        """The chunks of a cell in order, with their missions and UAVs unless these are damaged."""
        pattern = re.compile(rf"{cell.key}-(\d+)-(\d+)\.parquet")
        names = (entry.name for entry in (self.folder / "missions").glob("*.parquet"))
        found = (pattern.fullmatch(name) for name in names)
        parts = (range(int(match[1]), int(match[2])) for match in found if match)
        ordered = sorted(parts, key=lambda part: (part.start, part.stop))
        return [(part, self._records(cell, part)) for part in ordered]

    def _records(self, cell: Cell, part: range) -> tuple[pa.Table, pa.Table] | None:
        missions = _read(self._chunk("missions", cell, part), cell)
        uavs = _read(self._chunk("uavs", cell, part), cell)
        if missions is None or uavs is None:
            return None
        in_place = np.array_equal(missions["replication"], part)
        return (missions, uavs) if in_place else None

    def _chunk(self, kind: str, cell: Cell, part: range) -> Path:
        return self.folder / kind / f"{cell.key}-{part.start:06}-{part.stop:06}.parquet"

    def _log(self, cell: Cell, replication: int) -> Path:
        return self.folder / "events" / f"{cell.key}-{replication:06}.parquet"

    def _write(self, path: Path, cell: Cell, table: pa.Table) -> None:
        write_table(table.replace_schema_metadata({_CELL: cell.text}), path)


@dataclass(frozen=True, eq=False)
class Results:
    """The results of a study.

    Attributes:
        store: The folder that they come from.
        missions: A row per mission: ``policy``, ``point`` (number of the design point), the swept
            fields that are no fields of the record, and those of ``MISSION_RECORD``; in the order
            of policy (as the study names them), point and replication.
        uavs: A row per UAV of each: ``policy``, ``point``, ``replication``, ``uav`` and the fields
            of ``UAV_RECORD``, with the name of its ``end``.
    """

    store: Store
    missions: pd.DataFrame
    uavs: pd.DataFrame

    @property
    def manifest(self) -> dict[str, Any]:
        """What the results are about, as plain data."""
        return self.store.manifest.data

    def scenario(self, point: int = 0) -> ScenarioSpace:
        """The scenario of a design point."""
        return ScenarioSpace.of(**self.store.manifest.points[point].scenario)

    def events(self, policy: str, point: int = 0, replication: int = 0) -> pd.DataFrame:
        """The event log of a mission, with the columns of ``dess.record.EventLog``.

        Raises:
            InputError: If it has not been kept.
        """
        manifest = self.store.manifest
        teams = [team.policy for team in manifest.policies]
        if policy not in teams:
            raise InputError(f"policy: {policy!r} is not in the study; allowed: {', '.join(teams)}")
        if not 0 <= point < len(manifest.points):
            last = len(manifest.points) - 1
            raise InputError(f"point: {point} is not in the study; allowed: 0..{last}")
        log = self.store.load_log(manifest.cell(teams.index(policy), point), replication)
        if log is None:
            raise InputError(
                f"{self.store.folder}: no event log of {policy}, point {point}, replication "
                f"{replication}; allowed: 0..logged - 1, logged = {manifest.study['logged']}"
            )
        return log.to_pandas()


def load_results(out: str | Path) -> Results:
    """Load the results of a study.

    Raises:
        InputError: If the folder holds none, or they are incomplete, damaged or of another version.
    """
    store = Store(Path(out), Manifest.read(Path(out) / MANIFEST))
    missions, uavs = [], []
    for team, point, cell in store.manifest.cells:
        of_missions, of_uavs = store.load(cell, store.manifest.study["missions"])
        labels = {"policy": store.manifest.policies[team].policy, "point": point}
        missions.append(_labelled(of_missions, labels | _swept(store.manifest, point)))
        uavs.append(_labelled(of_uavs, labels))
    return Results(
        store, pd.concat(missions, ignore_index=True), pd.concat(uavs, ignore_index=True)
    )


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside ``path`` that takes its place in the end; if that fails, it goes.

    Raises:
        InputError: At once, if no file can be written there.
    """
    if path.is_dir():
        raise InputError(f"{path}: is a folder; allowed: a file")
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with _writable(path):
        temporary.touch()
    try:
        yield temporary
        with _writable(path):
            os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_table(table: pa.Table, path: Path) -> None:
    """Write a parquet file, whole or not at all; its pages carry checksums.

    Raises:
        InputError: If it cannot be written.
    """
    with replacing(path) as temporary, _writable(path):
        pq.write_table(table, temporary, compression="zstd", write_page_checksum=True)


@contextmanager
def _writable(path: Path) -> Iterator[None]:
    """Turn what the operating system says into one line."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{path}: cannot be written: {reason}; allowed: another path") from None


def _is_temporary(path: Path) -> bool:
    """Whether a killed run may have left the file behind."""
    return path.name.startswith(".") and path.suffix == ".tmp"


def _mission_table(records: Records) -> pa.Table:
    fields = MISSION_RECORD.names or ()
    return pa.table({field: np.ascontiguousarray(records.missions[field]) for field in fields})


def _uav_table(records: Records) -> pa.Table:
    present = np.arange(records.uavs.shape[1]) < records.missions["uavs"][:, None]
    mission, uav = np.nonzero(present)
    columns = {"replication": records.missions["replication"][mission], "uav": uav}
    columns |= {field: records.uavs[field][present] for field in UAV_RECORD.names or ()}
    columns["end"] = np.array(END_NAMES)[columns["end"]]
    return pa.table(columns)


def _read(path: Path, cell: Cell) -> pa.Table | None:
    """A parquet file of a cell; nothing if it is not there, damaged, or of another cell."""
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            table = file.read()
    except (OSError, pa.ArrowException):
        return None
    of_cell = (table.schema.metadata or {}).get(_CELL) == cell.text.encode()
    return table if of_cell else None


def _swept(manifest: Manifest, point: int) -> dict[str, Any]:
    """The values of the swept fields that no record has; as JSON text where some are lists."""
    designs = [p.values for p in manifest.points]
    labels = {}
    for field, value in designs[point].items():
        if field not in (MISSION_RECORD.names or ()):
            plain = not any(isinstance(design[field], list) for design in designs)
            labels[field] = value if plain else json.dumps(value)
    return labels


def _labelled(table: pa.Table, labels: dict[str, Any]) -> pd.DataFrame:
    frame = table.to_pandas()
    return pd.concat([pd.DataFrame(labels, index=frame.index), frame], axis="columns")
