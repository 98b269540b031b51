"""A results folder: parquet files that are named by hashes of their content, and a manifest.

``manifest.json`` describes the study and what it was run with. ``missions/`` and ``uavs/`` contain
the records in chunks, partitioned by policy; ``events/`` contains event logs, ``bounds/`` the upper
bounds of missions, and ``failures/`` describes what could not be computed. The name of a file has
two hashes: of its content (cells and replications), and of its bytes. So a run can resume by
computing what is missing, and a damaged file counts as missing. A file is written completely or not
at all. Nothing is pickled. The content of the folder does not depend on when, where, in which order
or by how many workers it was computed.
"""

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd
import pyarrow as pa

from analysis.results import files, parquet
from analysis.results.bounds.kept import BoundFiles
from analysis.results.chunks import Chunk, Failure, Part, absent, gaps, rows_of, split
from analysis.results.files import FOLDERS, LOCK, MANIFEST
from analysis.results.manifest import Cell, Manifest, Selected
from analysis.study.study import Study
from dess import InputError
from dess.files.locks import locked
from dess.files.reading import paths_in
from dess.files.writing import check_folder, delete, make_folder, write_file
from dess.record import Records

_BUSY = "in use by another run; allowed: another --out, or wait for its end"


class Store:
    """The files of a results folder.

    Attributes:
        folder: The folder.
        manifest: The manifest of the folder.
        damaged: The files whose content is not what their names say.
        bounds: The upper bounds of the missions, if the study has them.
    """

    def __init__(self, folder: Path, manifest: Manifest):
        self.folder, self.manifest = folder, manifest
        self._lock = ExitStack()  # what holds it
        self._tables: dict[tuple[int, str], parquet.Tables] = {}  # by team and name of the chunk
        self._present: dict[tuple[int, str], list[range]] = defaultdict(list)
        self._logs: dict[tuple[int, str], Path] = {}  # by team, cell and replication
        self.damaged: list[Path] = []
        self.bounds = BoundFiles(folder / files.BOUNDS)

    @classmethod
    def open(cls, study: Study, out: str | Path, accept_code: bool = False) -> Self:
        """Open a results folder for a study: a new one, or one that the study completes or extends.

        The folder stays locked until the end of the ``with`` block.

        Args:
            study: The study.
            out: The folder.
            accept_code: Whether to keep missions that were simulated by other code.

        Raises:
            InputError: If the folder cannot be written, holds something else, or is in use.
        """
        folder = Path(out)
        manifest = Manifest.of(study)
        store = cls(folder, _extended(folder, manifest, accept_code))
        files.check_places(folder)
        with ExitStack() as lock:
            lock.enter_context(locked(folder / LOCK, _BUSY))
            # Read again under the lock, because another run may have ended in the meantime.
            store.manifest = _extended(folder, manifest, accept_code)
            store._prepare()
            store._lock = lock.pop_all()
        return store

    @classmethod
    def read(cls, out: str | Path) -> Self:
        """Open a results folder to load from it; nothing is written or locked.

        Raises:
            InputError: If it is not a results folder, or one of another version.
        """
        store = cls(Path(out), Manifest.read(Path(out) / MANIFEST))
        store._scan()
        return store

    @classmethod
    def peek(cls, study: Study, out: str | Path, accept_code: bool = False) -> Self:
        """Open a folder only to count which missions are missing; nothing is written or locked.

        Raises:
            InputError: If the folder holds something else, or cannot be written.
        """
        store = cls(Path(out), _extended(Path(out), Manifest.of(study), accept_code))
        store._scan()
        return store

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.close()

    def _prepare(self) -> None:
        """Write the manifest, remove temporary files of a killed run, and scan the folder."""
        write_file(self.folder / MANIFEST, self.manifest.text)
        places = [self.folder / name for name in FOLDERS]
        for place in places:
            make_folder(place)
        places += [self.folder, *paths_in(self.folder, "*/policy=*")]
        for path in (path for place in places for path in paths_in(place, ".*.tmp")):
            delete(path)
        self._scan()
        while self.damaged:
            delete(self.damaged.pop())

    def _scan(self) -> None:
        """Find out which missions are present, and which files are damaged."""
        for team in range(len(self.manifest.policies)):
            uavs, damaged_uavs = parquet.tables_in(self._partition("uavs", team), parquet.UAVS)
            missions, damaged = parquet.tables_in(
                self._partition("missions", team), parquet.MISSIONS
            )
            self.damaged += damaged_uavs + damaged
            for name in sorted(missions.keys() & uavs.keys()):
                self._examine(team, name, parquet.Tables(missions[name], uavs[name]))
            for path in parquet.files_in(self._partition("events", team)):
                if parquet.read(path) is None:
                    self.damaged.append(path)
                else:
                    self._logs[team, parquet.content_hash(path)] = path
        self.damaged += self.bounds.scan(self.manifest)

    def _examine(self, team: int, name: str, tables: parquet.Tables) -> None:
        """Keep the tables of a chunk, or count its files as damaged, if they are no records."""
        try:
            parquet.check(tables, parquet.parts_in(tables.missions), self.manifest.seed)
        except ValueError:
            for kind in ("missions", "uavs"):
                paths = parquet.files_in(self._partition(kind, team))
                self.damaged += [path for path in paths if parquet.content_hash(path) == name]
        else:
            self._enter(team, name, tables)

    def _enter(self, team: int, name: str, tables: parquet.Tables) -> None:
        self._tables[team, name] = tables
        for key, start, stop in parquet.parts_in(tables.missions):
            self._present[team, key].append(range(start, stop))

    def _partition(self, kind: str, team: int) -> Path:
        return self.folder / kind / files.partition(self.manifest.policies[team].policy)

    @property
    def files(self) -> list[Path]:
        """The files of records, event logs and bounds, the damaged ones included."""
        folders = [*paths_in(self.folder, "*/policy=*"), self.bounds.folder]
        return [path for folder in folders for path in parquet.files_in(folder)]

    def missing(self, chunk: Chunk) -> Chunk | None:
        """The part of a chunk that is missing; None if all of it is present."""
        return absent(chunk, self._present)

    def missing_logs(self, cell: Cell, logged: int) -> list[int]:
        """Those of the first ``logged`` replications whose event log is missing."""
        wanted = range(cell.first, cell.first + logged)
        return [r for r in wanted if self.load_log(cell, r) is None]

    def write(self, chunk: Chunk, records: Records) -> None:
        """Store the records of a chunk.

        Raises:
            ValueError: If they are not those of the chunk.
        """
        self._keep(chunk, parquet.tables_of(chunk, records))

    def take_over(self, other: "Store", parts: Sequence[Part]) -> None:
        """Copy missing missions of some parts from another folder, as far as it has them.

        Cells with equal keys have equal records, so this only saves time. Nothing is copied from a
        folder that has two different records of a mission.

        Args:
            other: The other results folder, of any study.
            parts: Parts of the study of this folder.
        """
        whose = {key: team for team, key in other._present}
        for chunk in split(parts, sum(len(part.replications) for part in parts)):
            shared = other._shared(self.missing(chunk), whose)
            if shared:
                teams = {whose[part.cell.key] for part in shared.parts}
                held = [tables for (team, _), tables in other._tables.items() if team in teams]
                try:
                    missions, uavs = (rows_of(shared.parts, k) for k in zip(*held, strict=True))
                except InputError:
                    return
                self._keep(shared, parquet.tables_with(shared, missions, uavs))

    def count(self, other: "Store") -> None:
        """Count the missions of another folder as if they were here, to plan a run."""
        held = {key: present for (_, key), present in other._present.items()}
        for cells in self.manifest.cells:
            for cell in cells:
                self._present[cell.team, cell.key] += held.get(cell.key, [])

    def _shared(self, chunk: Chunk | None, whose: Mapping[str, int]) -> Chunk | None:
        """The part of a chunk that another folder has; None if it has none of it.

        Args:
            chunk: The chunk; its cells have teams and points of the other folder.
            whose: The team of every cell here, by its key.
        """
        parts = []
        for part in chunk.parts if chunk else ():
            key = part.cell.key
            present = self._present[whose[key], key] if key in whose else []
            absent = gaps(part.replications, present)
            parts += [Part(part.cell, there) for there in gaps(part.replications, absent)]
        return Chunk(chunk.team, tuple(parts)) if chunk and parts else None

    def _keep(self, chunk: Chunk, tables: parquet.Tables) -> None:
        """Write the tables of a chunk."""
        parquet.check(tables, chunk.rows, self.manifest.seed)
        # Missions last: a chunk is present when they are.
        parquet.write(self._partition("uavs", chunk.team), chunk.name, tables.uavs)
        parquet.write(self._partition("missions", chunk.team), chunk.name, tables.missions)
        self._enter(chunk.team, chunk.name, tables)
        delete(self._failure(chunk))

    def write_log(self, cell: Cell, replication: int, columns: dict[str, np.ndarray]) -> None:
        """Store the event log of a replication of a cell."""
        name = f"{cell.key}-{replication:06}"
        folder = self._partition("events", cell.team)
        self._logs[cell.team, name] = parquet.write(folder, name, pa.table(columns))

    def write_failure(self, chunk: Chunk, failure: Failure) -> Path:
        """Store why a chunk could not be computed, and return the path of the file."""
        path = self._failure(chunk)
        write_file(path, json.dumps(asdict(failure), indent=2) + "\n")
        return path

    def _failure(self, chunk: Chunk) -> Path:
        return self.folder / "failures" / f"{chunk.name}.json"

    def _failures(self) -> list[Path]:
        return paths_in(self.folder / "failures", "*.json")

    def finish(self, missions: Sequence[Sequence[int]], selected: Sequence[Selected]) -> None:
        """Write into the manifest that all missions are present, and how many there are."""
        update = {"missions": missions, "selected": selected, "complete": True}
        self.manifest = self.manifest.model_copy(update=update)
        write_file(self.folder / MANIFEST, self.manifest.text)
        for path in self._failures():
            delete(path)

    def missions(self, parts: Sequence[Part]) -> pd.DataFrame:
        """The missions of some parts of one team, with their ``point``, in the order of the parts.

        If the study has prices, the missions have a ``cost``.

        Raises:
            InputError: If some are missing or damaged.
        """
        missions = rows_of(parts, [tables.missions for tables in self._tables_with(parts)])
        if costs := self.manifest.costs:
            cost = costs.parts(self.manifest.scenarios, missions, self.uavs(parts))
            missions["cost"] = sum(cost.values())
        return missions

    def uavs(self, parts: Sequence[Part]) -> pd.DataFrame:
        """The UAVs of these missions, in the same order.

        Raises:
            InputError: If some are missing or damaged.
        """
        return rows_of(parts, [tables.uavs for tables in self._tables_with(parts)])

    def samples(self, parts: Sequence[Part]) -> list[dict[str, np.ndarray]]:
        """For each part of one team, the metrics of its missions.

        Raises:
            InputError: If some are missing or damaged.
        """
        missions = self.missions(parts)
        ends = np.cumsum([len(part.replications) for part in parts])
        columns = {name: np.split(missions[name].to_numpy(), ends[:-1]) for name in missions}
        return [{name: values[k] for name, values in columns.items()} for k in range(len(parts))]

    def _tables_with(self, parts: Sequence[Part]) -> list[parquet.Tables]:
        """The tables that contain parts of one team, all of which must be present."""
        for part in parts:
            present = self._present[part.cell.team, part.cell.key]
            for gap in gaps(part.replications, present)[:1]:
                raise InputError(self._incomplete(part, gap))
        team = parts[0].cell.team
        return [tables for (whose, _), tables in self._tables.items() if whose == team]

    def _incomplete(self, part: Part, gap: range) -> str:
        team, values = part.cell.team, self.manifest.points[part.cell.point].values
        where = f" at {json.dumps(values)}" if values else ""
        present = f"the first {gap.start - part.replications.start} of {len(part.replications)}"
        line = f"{self.folder}: incomplete, {present} missions of "
        line += f"{self.manifest.policies[team].policy}{where}"
        if self.damaged:
            line += f" (damaged: {self.damaged[0]})"
        if failed := self._failures():
            line += f" ({len(failed)} chunks failed, see {failed[0]})"
        return f"{line}; allowed: run the study again to complete it"

    @property
    def logged(self) -> list[tuple[Cell, int]]:
        """The missions whose event logs are present."""
        cells = {(cell.team, cell.key): cell for cells in self.manifest.cells for cell in cells}
        logs = [(team, *name.rpartition("-")) for team, name in self._logs]
        return [(cells[t, key], int(number)) for t, key, _, number in logs if (t, key) in cells]

    def load_log(self, cell: Cell, replication: int) -> pa.Table | None:
        """The event log of a replication of a cell, if it is present."""
        path = self._logs.get((cell.team, f"{cell.key}-{replication:06}"))
        return parquet.read(path) if path else None


def _extended(folder: Path, manifest: Manifest, accept_code: bool) -> Manifest:
    """The manifest for a folder into which this study will be written.

    Raises:
        InputError: If the folder contains something else.
    """
    path = folder / MANIFEST
    check_folder(folder)
    if not path.exists():
        if any(not files.is_ours(other) for other in paths_in(folder)):
            raise InputError(
                f"{folder}: holds other files and no {MANIFEST}; "
                "allowed: a results folder, or a new or empty one (another --out)"
            )
        return manifest
    held = Manifest.read(path)
    return held.extended_to(manifest, path, parquet.missions_in(folder) if accept_code else None)
