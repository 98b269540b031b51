"""What is in a results folder: tables of records and bounds, and event logs, by their cells."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Self

import pandas as pd
import pyarrow as pa

from dess.analysis.results import chunks, parquet
from dess.analysis.results.manifest import NO_TEAM, Cell, CellPart, Manifest
from dess.analysis.results.replications import Present, absent_parts
from dess.analysis.results.rows import rows_of, stack_tables

# The folders of the tables of each kind of work; a chunk is present when the first one is.
TABLES = {"missions": ("missions", "uavs"), "bounds": ("bounds",), "events": ("events",)}


class Contents:
    """The missions, bounds and event logs that are in a results folder.

    Attributes:
        folder: The folder.
        manifest: Its manifest, which says what its files are of.
        damaged: The files whose content is not what their names say.
    """

    def __init__(self, folder: Path, manifest: Manifest):
        self.folder = folder
        self.manifest = manifest
        self.damaged: list[Path] = []
        self._present: dict[str, Present] = {kind: defaultdict(list) for kind in TABLES}
        # By kind and key of a cell, the tables that contain it: missions and UAVs, or bounds alone.
        self._tables: dict[tuple[str, str], list[Sequence[pa.Table]]] = defaultdict(list)
        # The rows of several tables, until there are new ones: every round of a rule needs them.
        self._stacked: dict[tuple, pd.DataFrame] = {}
        self._logs: dict[tuple[str, int], Path] = {}  # by the key of a cell and the replication

    @classmethod
    def found_in(cls, folder: Path, manifest: Manifest) -> Self:
        """What is there now; files that are no records of their names count as damaged."""
        contents = cls(folder, manifest)
        teams = range(len(manifest.policies))
        for kind, team in [*(("missions", team) for team in teams), ("bounds", NO_TEAM)]:
            contents._find_tables(kind, team)
        for team in teams:
            contents._find_logs(team)
        return contents

    def _find_tables(self, kind: str, team: int) -> None:
        files = [parquet.tables_in(*place) for place in self.places(kind, team)]
        self.damaged += [path for _, damaged in files for path in damaged]
        for name in sorted(set.intersection(*(set(tables) for tables, _ in files))):
            self._examine(kind, team, name, [tables[name] for tables, _ in files])

    def _find_logs(self, team: int) -> None:
        ((folder, _),) = self.places("events", team)
        for path in parquet.files_in(folder):
            key, _, number = parquet.content_hash(path).partition("-")
            if not parquet.is_log(path):
                self.damaged.append(path)
            elif number:
                self.enter_log(key, int(number), path)

    def places(self, kind: str, team: int) -> list[tuple[Path, str]]:
        """The folders of a team's tables of a kind of work, with their names in ``SCHEMAS``."""
        if team == NO_TEAM:
            return [(self.folder / chunks.BOUNDS, chunks.BOUNDS)]
        of_team = chunks.partition_name(self.manifest.policies[team].policy)
        return [(self.folder / name / of_team, name) for name in TABLES[kind]]

    def _examine(self, kind: str, team: int, name: str, tables: Sequence[pa.Table]) -> None:
        """Keep the tables of a chunk, or count its files as damaged, if they are no records."""
        if parquet.are_of(tables, rows := parquet.parts_in(tables[0])):
            self.enter(kind, rows, tables)
            return
        for folder, _ in self.places(kind, team):
            paths = parquet.files_in(folder)
            self.damaged += [path for path in paths if parquet.content_hash(path) == name]

    def enter(self, kind: str, rows: Sequence[parquet.Row], tables: Sequence[pa.Table]) -> None:
        """Take in the tables of a chunk, with the parts that it has."""
        self._stacked.clear()
        for key, start, stop in rows:
            self._tables[kind, key].append(tables)
            self._present[kind][key].append(range(start, stop))

    def enter_log(self, key: str, replication: int, path: Path) -> None:
        """Take in the event log of a replication of the cell with this key."""
        self._logs[key, replication] = path
        self._present["events"][key].append(range(replication, replication + 1))

    def count_missions_of(self, other: "Contents") -> None:
        """Let the missions of another folder count as present, though none can be loaded."""
        for key, present in other._present["missions"].items():
            self._present["missions"][key] += present

    def missing(self, kind: str, parts: Iterable[CellPart]) -> list[CellPart]:
        """What of some parts is missing.

        Args:
            kind: ``missions``, ``bounds`` or ``events``.
            parts: The parts.
        """
        return absent_parts(parts, self._present[kind])

    def missions_of(self, parts: Sequence[CellPart]) -> list[CellPart]:
        """What of the missions of some parts is present."""
        missing: Present = defaultdict(list)
        for part in self.missing("missions", parts):
            missing[part.cell.key].append(part.replications)
        return absent_parts(parts, missing)

    def tables_with(self, kind: str, parts: Iterable[CellPart]) -> list[Sequence[pa.Table]]:
        """The tables that contain some parts."""
        keys = dict.fromkeys(part.cell.key for part in parts)
        tables_of_parts = (tables for key in keys for tables in self._tables[kind, key])
        return [*{id(tables): tables for tables in tables_of_parts}.values()]

    def frames(self, parts: Iterable[CellPart]) -> list[pd.DataFrame]:
        """The rows of the files with missions of some parts, and those of the files with UAVs."""
        return [*map(stack_tables, zip(*self.tables_with("missions", parts), strict=True))]

    def rows(self, kind: str, parts: Sequence[CellPart], table: int) -> pd.DataFrame:
        """The rows of some parts, all of which are present, in the tables of their kind."""
        frames = [tables[table] for tables in self.tables_with(kind, parts)]
        key = kind, table, *map(id, frames)
        if key not in self._stacked:
            self._stacked[key] = stack_tables(frames)
        return rows_of(parts, self._stacked[key]).drop(columns="cell")

    @property
    def logged(self) -> list[tuple[Cell, int]]:
        """The missions whose event logs are present."""
        cells = {cell.key: cell for cells in self.manifest.cells for cell in cells}
        return [(cells[key], number) for key, number in self._logs if key in cells]

    def load_log(self, cell: Cell, replication: int) -> pa.Table | None:
        """The event log of a replication of a cell, if it is present."""
        path = self._logs.get((cell.key, replication))
        return parquet.read(path) if path else None
