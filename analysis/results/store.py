"""A results folder: parquet files that are named by hashes of their content, and a manifest.

``manifest.json`` describes the study and what it was run with. ``missions/`` and ``uavs/`` contain
the records in chunks, partitioned by policy; ``events/`` contains event logs, ``bounds/`` the upper
bounds of missions, ``failures/`` describes what could not be computed, and ``derived/`` has what
answers and pages have computed from the missions (``derived.py``), and ``shards/`` which shards are
complete, until all are (``shards.py``). The name of a file has two hashes: of its content (cells
and replications), and of its bytes. So a run can resume by computing what is missing, and a damaged
file counts as missing. A file is written completely or not at all. Nothing is pickled. The content
of the folder does not depend on when, where, in which order or by how many workers it was computed,
but for ``derived/``.
"""

import json
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import pandas as pd
import pyarrow as pa

from dess import InputError
from dess.analysis.bound import Bound
from dess.analysis.metric_ranges import longest_wait
from dess.analysis.metrics import (
    COST,
    IDLE,
    LEAST_COST,
    MOST_COST,
    MOST_SLOTS,
    MOST_WAITING,
    columns_in_units,
)
from dess.analysis.results import chunks, parquet, shards
from dess.analysis.results.contents import Contents
from dess.analysis.results.derived import Derived
from dess.analysis.results.manifest import (
    NO_TEAM,
    Cell,
    CellPart,
    Manifest,
    Selected,
)
from dess.analysis.results.replications import gaps_between, joined_ranges
from dess.analysis.results.rows import tables_of, with_worst_nodes
from dess.analysis.study.fields import CHECK
from dess.analysis.study.prices import PURCHASE
from dess.analysis.study.study import Study
from dess.base.files.locks import locked
from dess.base.files.reading import paths_in, read_bytes
from dess.base.files.tables import LIMIT
from dess.base.files.writing import (
    check_folder,
    check_place,
    delete,
    is_read_only,
    make_folder,
    write_file,
)


class Count(NamedTuple):
    """How much of something a folder must have, and how much of it it lacks."""

    needed: int
    missing: int


@dataclass(frozen=True)
class Work:
    """What there is to do until a folder is complete, as far as it is known now.

    Attributes:
        missions: Of every team, the number of missions.
        logs: Of every team, the number of event logs.
        bounds: The number of upper bounds.
    """

    missions: list[Count]
    logs: list[Count]
    bounds: Count


@dataclass(frozen=True)
class Failure:
    """A chunk that could not be computed.

    Attributes:
        policy: The team.
        missions: Number of missions that are missing because of it.
        error: What went wrong, in one line.
        command: A command that reproduces the error.
        traceback: Where it went wrong.
    """

    policy: str
    missions: int
    error: str
    command: str
    traceback: str


class Store:
    """The files of a results folder.

    Attributes:
        folder: The folder.
        manifest: The manifest of the folder.
        contents: What is in the folder.
        is_read_only: Whether nothing can be written into the folder.
    """

    def __init__(self, folder: Path, manifest: Manifest):
        self.folder = folder
        self.manifest = manifest
        self.contents = Contents(folder, manifest)
        self.is_read_only = False
        self._lock = ExitStack()  # what holds it
        self._no_files: list[Path] = []  # what has the name of a file of missions and is none

    @classmethod
    def open(cls, manifest: Manifest, out: str | Path, accept_code: bool = False) -> Self:
        """Open a results folder for a study: a new one, or one that the study completes or extends.

        The folder stays locked until the end of the ``with`` block. One that is there and cannot
        be written is only read, which is enough if nothing is missing.

        Args:
            manifest: The study, and what it is run with.
            out: The folder.
            accept_code: Whether to keep missions that were simulated by other code.

        Raises:
            InputError: If a new folder cannot be written, it holds something else, or is in use.
        """
        folder = Path(out)
        store = cls(folder, _extended_manifest(folder, manifest, accept_code))
        if is_read_only(folder):
            store.is_read_only = True
            store._scan()
            return store
        chunks.check_places(folder)
        with ExitStack() as lock:
            lock.enter_context(locked(folder / chunks.LOCK, *chunks.BUSY))
            lock.enter_context(shards.without_shards(folder))
            # Read again under the lock, because another run may have ended in the meantime.
            store.manifest = _extended_manifest(folder, manifest, accept_code)
            store._write_manifest()
            store._remove_temporaries()
            store._check_files()
            store._scan()
            while store.contents.damaged:
                delete(store.contents.damaged.pop())
            store._lock = lock.pop_all()
        return store

    @classmethod
    def open_shard(
        cls, manifest: Manifest, out: str | Path, shard: shards.Shard, accept_code: bool = False
    ) -> Self:
        """Open a results folder for a shard of a study, as ``open`` does.

        Other shards may run there at the same time: only this shard stays locked.
        """
        folder = Path(out)
        chunks.check_places(folder)
        with ExitStack() as lock:
            with locked(folder / chunks.LOCK, *chunks.BUSY, shards.PATIENCE):
                store = cls(folder, _extended_manifest(folder, manifest, accept_code))
                if not store._has_manifest():
                    with shards.without_shards(folder):
                        store._write_manifest()
                lock.enter_context(locked(shard.lock(folder), *chunks.BUSY))
                if not store.manifest.complete:
                    shard.mark(folder, is_complete=False)
            store._check_files()
            store._scan()
            store._lock = lock.pop_all()
        return store

    @classmethod
    def read(cls, out: str | Path) -> Self:
        """Open a results folder to load from it; nothing is written or locked.

        Raises:
            InputError: If it is not a results folder, or one of another version.
        """
        folder = Path(out)
        return cls.scan_folder(folder, Manifest.read(folder / chunks.MANIFEST))

    @classmethod
    def peek(
        cls, study: Study, out: str | Path, accept_code: bool = False, reuse: Iterable[Path] = ()
    ) -> Self:
        """Open a folder only to count which missions are missing; nothing is written or locked.

        Args:
            study: The study.
            out: The folder.
            accept_code: Whether missions that other code has simulated count as present.
            reuse: Other results folders, whose missions count as if they were here.

        Raises:
            InputError: If the folder holds something else, or cannot be written.
        """
        folder = Path(out)
        manifest = _extended_manifest(folder, Manifest.of(study), accept_code)
        store = cls.scan_folder(folder, manifest)
        for other in source_folders(reuse, manifest):
            store.contents.count_missions_of(other.contents)
        return store

    @classmethod
    def scan_folder(cls, folder: Path, manifest: Manifest) -> Self:
        """A folder whose manifest is known, to load from it; nothing is written or locked."""
        store = cls(folder, manifest)
        store._scan()
        return store

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.close()

    def _has_manifest(self) -> bool:
        """Whether the manifest is in the folder as it is here."""
        path = self.folder / chunks.MANIFEST
        return path.exists() and Manifest.read(path).text == self.manifest.text

    def _write_manifest(self) -> None:
        """Write the manifest, and make the folders; shards of another study are forgotten.

        Raises:
            InputError: If something else is in the place of a file of the study.
        """
        if not self._has_manifest():
            shards.forget_shards(self.folder)
            write_file(self.folder / chunks.MANIFEST, self.manifest.text)
        for name in chunks.FOLDERS:
            make_folder(self.folder / name)

    def _remove_temporaries(self) -> None:
        """Delete the temporary files of a killed run."""
        places = [self.folder / name for name in (*chunks.FOLDERS, chunks.SHARDS)]
        places += [self.folder, *paths_in(self.folder, "*/policy=*")]
        for path in (path for place in places for path in paths_in(place, ".*.tmp")):
            delete(path)

    def _check_files(self) -> None:
        """Note what has the name of a file and is a folder, say; refuse it in the way of a run.

        It is in the way in the place of an event log, or beside the other file of the same
        missions: a run would fail only when its missions are done. What has the name of a file of
        other missions is left alone.
        """
        keys = {cell.key for cells in self.manifest.cells for cell in cells}
        patterns = ("*/policy=*/*.parquet", f"{chunks.BOUNDS}/*.parquet")
        for path in (path for pattern in patterns for path in paths_in(self.folder, pattern)):
            if not parquet.NAME.fullmatch(path.name) or path.is_symlink() or path.is_file():
                continue
            self._no_files.append(path)
            is_log = path.parent.parent.name == "events" and path.name.partition("-")[0] in keys
            same = f"*/{path.parent.name}/{parquet.content_hash(path)}-*.parquet"
            others = [other for other in paths_in(self.folder, same) if not other.is_symlink()]
            if is_log or any(other.is_file() for other in others):
                check_place(path)

    def check_files(self, of_run: Iterable[chunks.Chunk]) -> None:
        """Refuse what is no file in the place of a file of chunks that are to be simulated.

        Raises:
            InputError: If there is something else, such as a folder.
        """
        if self._no_files:
            names = {chunk.name for chunk in of_run}
            for path in self._no_files:
                if parquet.content_hash(path) in names:
                    check_place(path)

    def _scan(self) -> None:
        """Find out what is in the folder."""
        self.contents = Contents.found_in(self.folder, self.manifest)

    @property
    def derived(self) -> Derived:
        """What answers and pages have computed from the missions that are there now."""
        return Derived(self.folder, self.manifest.key)

    @property
    def files(self) -> list[Path]:
        """The files of records, event logs and bounds, the damaged ones included."""
        folders = [*paths_in(self.folder, "*/policy=*"), self.folder / chunks.BOUNDS]
        return [path for folder in folders for path in parquet.files_in(folder)]

    def begun(self, team: int) -> list[CellPart]:
        """The missions that every cell of a team has, up to the first one that it lacks."""
        parts = []
        for cell in self.manifest.cells[team]:
            whole = CellPart(cell, range(cell.first, CHECK))
            gaps = self.contents.missing("missions", [whole])
            present = range(cell.first, gaps[0].replications.start)
            if present:
                parts.append(CellPart(cell, present))
        return parts

    def work(self) -> Work:
        """What there is to do."""
        manifest = self.manifest
        teams = range(len(manifest.policies))
        logged = [manifest.study.logged] * len(manifest.points)
        missions = [manifest.parts_of_team(t) + manifest.parts_of_check(t) for t in teams]
        logs = [manifest.parts_of_team(team, logged) for team in teams]
        return Work(
            missions=[self._count("missions", parts) for parts in missions],
            logs=[self._count("events", parts) for parts in logs],
            bounds=self._count("bounds", manifest.parts_with_bounds()),
        )

    def _count(self, kind: str, parts: Sequence[CellPart]) -> Count:
        """How many missions some parts have, and how many of them are missing."""
        return Count(sum(map(len, parts)), sum(map(len, self.contents.missing(kind, parts))))

    def keep(self, kind: str, chunk: chunks.Chunk, tables: Sequence[pa.Table]) -> None:
        """Store the tables of a chunk."""
        places = self.contents.places(kind, chunk.team)
        for (folder, _), table in [*zip(places, tables, strict=True)][::-1]:
            parquet.write(folder, chunk.name, table)
        self.contents.enter(kind, chunk.rows, tables)
        delete(self._failure(chunk))

    def keep_log(self, cell: Cell, replication: int, columns: dict[str, Any]) -> None:
        """Store the event log of a replication of a cell."""
        ((folder, _),) = self.contents.places("events", cell.team)
        path = parquet.write(folder, chunks.log_name(cell, replication), pa.table(columns))
        self.contents.enter_log(cell.key, replication, path)

    def take_over(self, other: "Store", parts: Iterable[CellPart]) -> None:
        """Copy missing missions of some parts from another folder, as far as it has them.

        Cells with equal keys have equal records, so this only saves time. Nothing is copied from a
        folder that has two different records of a mission.

        Args:
            other: The other results folder, of any study.
            parts: Parts of the study of this folder.
        """
        missing = self.contents.missing("missions", parts)
        for team, of_team in groupby(missing, lambda part: part.cell.team):
            if shared := other.contents.missions_of([*of_team]):
                try:
                    frames = other.contents.frames(shared)
                except InputError:
                    return
                chunk = chunks.Chunk(team, tuple(shared))
                (tables,) = tables_of([chunk], frames)
                self.keep("missions", chunk, tables)

    def copy_files(self, other: "Store") -> None:
        """Copy the files that a shard of the same study has and that are not here."""
        teams = range(len(self.manifest.policies))
        kinds = [(kind, team) for kind in ("missions", "events") for team in teams]
        for kind, team in [*kinds, ("bounds", NO_TEAM)]:
            places_here = self.contents.places(kind, team)
            places_there = other.contents.places(kind, team)
            for (here, _), (there, _) in zip(places_here, places_there, strict=True):
                for path in parquet.files_in(there):
                    if path not in other.contents.damaged and not (here / path.name).exists():
                        write_file(here / path.name, read_bytes(path, LIMIT))
        self._scan()

    def merge(self, large: Sequence[chunks.Chunk]) -> None:
        """Keep the missions of a team in the files of these large chunks, in place of small ones.

        A file that has other missions as well stays.
        """
        if self.is_read_only:
            return
        parts = [part for chunk in large for part in chunk.parts]
        names = {c.name for c in large}
        present = self.contents.tables_with("missions", parts)
        rows = [parquet.parts_in(tables[0]) for tables in present]
        large_files = {chunks.name_of(of_file): of_file for of_file in rows}
        if large_files.keys() == names:
            return
        new = [chunk for chunk in large if chunk.name not in large_files]
        for chunk, tables in zip(new, tables_of(new, self.contents.frames(parts)), strict=True):
            self.keep("missions", chunk, tables)
        merged = joined_ranges(parts)
        gone = {
            name
            for name, of_file in large_files.items()
            if not any(
                gaps_between(range(start, stop), merged[key]) for key, start, stop in of_file
            )
        }
        gone -= names
        for folder, _ in self.contents.places("missions", large[0].team):
            for path in parquet.files_in(folder):
                if parquet.content_hash(path) in gone:
                    delete(path)
        self._scan()

    def write_failure(self, chunk: chunks.Chunk, failure: Failure) -> Path:
        """Store why a chunk could not be computed, and return the path of the file."""
        path = self._failure(chunk)
        write_file(path, json.dumps(asdict(failure), indent=2) + "\n")
        return path

    def _failure(self, chunk: chunks.Chunk) -> Path:
        return self.folder / "failures" / f"{chunk.name}.json"

    def _failures(self) -> list[Path]:
        return paths_in(self.folder / "failures", "*.json")

    def finish(self, missions: Sequence[Sequence[int]], selected: Sequence[Selected]) -> None:
        """Write into the manifest that all missions are present, and how many there are."""
        update = {"missions": missions, "selected": selected, "complete": True}
        self.manifest = self.manifest.model_copy(update=update)
        if self.is_read_only:
            return
        write_file(self.folder / chunks.MANIFEST, self.manifest.text)
        for path in self._failures():
            delete(path)
        shards.forget_shards(self.folder)

    def missions(self, parts: Sequence[CellPart]) -> pd.DataFrame:
        """The missions of some parts, with their ``point``, in the order of the parts.

        ``most_slots`` is the longest that each may last, ``most_waiting`` the longest that a UAV
        may wait in it, and ``idle``, where nodes were idle before it, for how long. If the study
        has prices, the missions have a ``cost``, and the least and the most that each may cost;
        with a data sheet, what they measure is there in units as well
        (``metrics.columns_in_units``).

        Raises:
            InputError: If some are missing or damaged.
        """
        missions = with_worst_nodes(self._rows("missions", parts))
        spaces = self.manifest.scenarios
        points = missions["point"].to_numpy()
        missions[MOST_SLOTS] = np.array([space.longest_slots for space in spaces])[points]
        missions[MOST_WAITING] = np.array([longest_wait(space) for space in spaces])[points]
        idle = np.array([space.idle_slots for space in spaces])
        if idle.any():
            missions[IDLE] = idle[points]
        if costs := self.manifest.study.costs:
            cost = costs.parts(spaces, missions, self.uavs(parts))
            missions[COST] = sum(cost.values())
            missions[LEAST_COST] = cost[PURCHASE]
            missions[MOST_COST] = missions[LEAST_COST] + costs.most_running(spaces, missions)
        if units := self.manifest.units_at(points):
            missions = missions.assign(**columns_in_units(missions, units))
        return missions

    def uavs(self, parts: Sequence[CellPart]) -> pd.DataFrame:
        """The UAVs of these missions, in the same order.

        Raises:
            InputError: If some are missing or damaged.
        """
        return self._rows("missions", parts, 1)

    def bounds_of(self, parts: Sequence[CellPart]) -> dict[tuple[int, int], Bound]:
        """The bounds of some parts, by design point and replication.

        Raises:
            InputError: If some are missing or damaged, or two files differ.
        """
        if not parts:
            return {}
        return {
            (row["point"], row["replication"]): Bound(
                ratio=row["ratio"],
                prices=np.reshape(row["prices"], (len(row["cuts"]), -1)),
                cuts=np.array(row["cuts"], np.int64),
                iterations=row["iterations"],
            )
            for row in self._rows("bounds", parts).to_dict("records")
        }

    def samples(self, parts: Sequence[CellPart]) -> list[dict[str, np.ndarray]]:
        """For each part, the metrics of its missions.

        Raises:
            InputError: If some are missing or damaged.
        """
        missions = self.missions(parts)
        ends = np.cumsum([len(part.replications) for part in parts])
        columns = {name: np.split(missions[name].to_numpy(), ends[:-1]) for name in missions}
        return [{name: values[k] for name, values in columns.items()} for k in range(len(parts))]

    def _rows(self, kind: str, parts: Sequence[CellPart], table: int = 0) -> pd.DataFrame:
        """The rows of some parts, all of which must be present, in the tables of their kind."""
        for gap in self.contents.missing(kind, parts)[:1]:
            whole = next(part for part in parts if part.cell == gap.cell)
            raise self._incomplete(whole, gap.replications)
        return self.contents.rows(kind, parts, table)

    def _incomplete(self, part: CellPart, gap: range) -> InputError:
        team = part.cell.team
        values = self.manifest.points[part.cell.point].values
        where = ""
        if values:
            where = f" at {json.dumps(values)}"
        present = f"the first {gap.start - part.replications.start} of {len(part.replications)}"
        what = "bounds"
        if team != NO_TEAM:
            what = f"missions of {self.manifest.policies[team].policy}"
        problem = f"incomplete, {present} {what}{where}"
        if self.contents.damaged:
            problem += f" (damaged: {self.contents.damaged[0]})"
        if failed := self._failures():
            problem += f" ({len(failed)} chunks failed, see {failed[0]})"
        return InputError(self.folder, problem, "run the study again to complete it")


def _extended_manifest(folder: Path, manifest: Manifest, accept_code: bool) -> Manifest:
    """The manifest for a folder into which this study will be written.

    Raises:
        InputError: If the folder contains something else.
    """
    path = folder / chunks.MANIFEST
    if not path.exists():
        check_folder(folder)
        if any(not chunks.is_ours(other) for other in paths_in(folder)):
            raise InputError(
                folder,
                f"holds other files and no {chunks.MANIFEST}",
                "a results folder, or a new or empty one",
            )
        return manifest
    existing = Manifest.read(path)
    return existing.extended_to(
        manifest, path, parquet.missions_in(folder) if accept_code else None
    )


def source_folders(folders: Iterable[Path], manifest: Manifest) -> list[Store]:
    """The folders that contain cells of a manifest: same code, scenario, policy and seed.

    A folder that is not a results folder is left out. So is a folder whose missions were simulated
    by several versions of the code, because the keys of its cells identify only the first version.
    """
    keys = _cell_keys(manifest)
    return [store for folder in folders if (store := _source_folder(folder, keys))]


def _source_folder(folder: Path, keys: set[str]) -> Store | None:
    try:
        manifest = Manifest.read(folder / chunks.MANIFEST)
        if manifest.accepted or not keys & _cell_keys(manifest):
            return None
        return Store.scan_folder(folder, manifest)
    except (InputError, FileNotFoundError):  # another run may merge its files
        return None


def _cell_keys(manifest: Manifest) -> set[str]:
    return {cell.key for cells in manifest.cells for cell in cells}
