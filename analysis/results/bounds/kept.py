"""The files of a results folder that hold the upper bounds of its missions."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa

from analysis.bound import Bound
from analysis.results import parquet
from analysis.results.bounds.tables import BOUNDS, Place, bounds_in, check, table_of
from analysis.results.chunks import Chunk, Part, absent
from analysis.results.manifest import NO_TEAM, Manifest
from dess import InputError


class BoundFiles:
    """The bounds in a results folder, in chunks like the missions.

    Attributes:
        folder: The folder of their files.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self._tables: dict[str, pa.Table] = {}  # by the name of the chunk
        self._present: dict[tuple[int, str], list[range]] = defaultdict(list)
        self._nodes: dict[str, int] = {}

    def scan(self, manifest: Manifest) -> list[Path]:
        """Find out which bounds are present, and return the files that are damaged."""
        cells = zip(manifest.bound_cells, manifest.scenarios, strict=False)
        self._nodes = {cell.key: len(space.nodes) for cell, space in cells}
        tables, damaged = parquet.tables_in(self.folder, BOUNDS)
        for name, table in sorted(tables.items()):
            try:
                check(table, parquet.parts_in(table), self._nodes)
            except ValueError:
                paths = parquet.files_in(self.folder)
                damaged += [path for path in paths if parquet.content_hash(path) == name]
            else:
                self._enter(name, table)
        return damaged

    def missing(self, chunk: Chunk) -> Chunk | None:
        """The part of a chunk that is missing; None if all of it is present."""
        return absent(chunk, self._present)

    def write(self, chunk: Chunk, bounds: Sequence[Bound]) -> None:
        """Store the bounds of a chunk.

        Raises:
            ValueError: If they are not those of the chunk.
        """
        table = table_of(chunk, bounds)
        check(table, chunk.rows, self._nodes)
        parquet.write(self.folder, chunk.name, table)
        self._enter(chunk.name, table)

    def load(self, parts: Sequence[Part]) -> dict[Place, Bound]:
        """The bounds of some parts, by design point and replication.

        Raises:
            InputError: If some are missing or damaged, or two files differ.
        """
        known: dict[tuple[str, int], dict] = {}
        for row in (row for table in self._tables.values() for row in table.to_pylist()):
            if known.setdefault((row["cell"], row["replication"]), row) != row:
                raise InputError(
                    f"{self.folder}: two files have different bounds of a mission; allowed: one"
                )
        wanted = [(part.cell, number) for part in parts for number in part.replications]
        for cell, number in wanted:
            if (cell.key, number) not in known:
                raise InputError(
                    f"{self.folder}: the bound of replication {number} is missing; allowed: run "
                    "the study again to complete it"
                )
        rows = [known[cell.key, number] for cell, number in wanted]
        places = [(cell.point, number) for cell, number in wanted]
        return dict(zip(places, bounds_in(rows), strict=True))

    def _enter(self, name: str, table: pa.Table) -> None:
        self._tables[name] = table
        for key, start, stop in parquet.parts_in(table):
            self._present[NO_TEAM, key].append(range(start, stop))
