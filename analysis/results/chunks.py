"""Chunks: missions that are computed and stored together, and how studies are split into them.

``rows_of`` puts the rows of their tables into the order of the parts of a study.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from analysis.results.manifest import Cell, Manifest
from analysis.study.study import CHECK
from dess import InputError


@dataclass(frozen=True)
class Part:
    """Consecutive replications of a cell."""

    cell: Cell
    replications: range


@dataclass(frozen=True)
class Chunk:
    """Missions of one team that are computed and stored together: parts of its cells."""

    team: int
    parts: tuple[Part, ...]

    @property
    def missions(self) -> int:
        """The number of missions in the chunk."""
        return sum(len(part.replications) for part in self.parts)

    @property
    def rows(self) -> list[tuple[str, int, int]]:
        """The key, start and stop of every part."""
        return [(p.cell.key, p.replications.start, p.replications.stop) for p in self.parts]

    @property
    def name(self) -> str:
        """A hash of the cells and replications in the chunk."""
        return name_of(self.rows)


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


def parts_of(manifest: Manifest, team: int, counts: Sequence[int] | None = None) -> list[Part]:
    """The first missions of every cell of a team: ``counts`` of them, or as the manifest says."""
    cells, counts = manifest.cells[team], counts or manifest.missions[team]
    return [Part(c, range(c.first, c.first + n)) for c, n in zip(cells, counts, strict=True)]


def bound_parts(manifest: Manifest) -> list[Part]:
    """The missions that need bounds: at every design point those of any team; none without them."""
    counts = [max(of_point) for of_point in zip(*manifest.missions, strict=True)]
    return [
        Part(cell, range(cell.first, cell.first + counts[cell.point]))
        for cell in manifest.bound_cells
    ]


def check_parts(manifest: Manifest, team: int) -> list[Part]:
    """The missions that check the design points selected for a team.

    The selection was not based on any of these missions.
    """
    points = manifest.selected_points(team)
    check = range(CHECK, CHECK + manifest.study["selection"]["check"]) if points else range(0)
    return [Part(manifest.cells[team][point], check) for point in points]


def split(parts: Iterable[Part], size: int) -> Iterator[Chunk]:
    """Split parts, in their order, into chunks of ``size`` missions; a chunk has one team."""
    waiting: list[Part] = []
    room = size
    for part in parts:
        if waiting and waiting[0].cell.team != part.cell.team:
            yield Chunk(waiting[0].cell.team, tuple(waiting))
            waiting, room = [], size
        rest = part.replications
        while len(rest):
            waiting.append(Part(part.cell, rest[:room]))
            rest, room = rest[room:], room - len(rest[:room])
            if not room:
                yield Chunk(part.cell.team, tuple(waiting))
                waiting, room = [], size
    if waiting:
        yield Chunk(waiting[0].cell.team, tuple(waiting))


def gaps(wanted: range, present: list[range]) -> list[range]:
    """The parts of a range that are in none of the present ranges."""
    missing, begin = [], wanted.start
    for there in sorted(present, key=lambda r: r.start):
        if there.start > begin:
            missing.append(range(begin, min(there.start, wanted.stop)))
        begin = max(begin, there.stop)
        if begin >= wanted.stop:
            break
    return [gap for gap in [*missing, range(begin, wanted.stop)] if len(gap)]


def absent(chunk: Chunk, present: Mapping[tuple[int, str], list[range]]) -> Chunk | None:
    """The part of a chunk that is not present; None if all of it is.

    Args:
        chunk: The chunk.
        present: The replications that are present, by the team and the key of their cell.
    """
    parts = tuple(
        Part(part.cell, gap)
        for part in chunk.parts
        for gap in gaps(part.replications, present.get((chunk.team, part.cell.key), []))
    )
    return Chunk(chunk.team, parts) if parts else None


def name_of(rows: Sequence[Sequence[Any]]) -> str:
    """The first half of the name of a file that contains these parts: a hash of them."""
    return short_hash(json.dumps(rows).encode())


def short_hash(content: bytes) -> str:
    """The beginning of a hash, long enough to tell files apart."""
    return sha256(content).hexdigest()[:16]


def rows_of(parts: Sequence[Part], tables: Sequence[pa.Table]) -> pd.DataFrame:
    """The rows of the missions of the parts, with the ``point`` of each.

    Args:
        parts: Parts of one team; the tables must contain all of them.
        tables: Tables with the columns ``cell`` and ``replication``.

    Raises:
        InputError: If two tables have different rows for the same mission.
    """
    stacked = _stacked(tables)
    rows = _wanted(parts).merge(stacked, on=["cell", "replication"], how="left")
    return rows[["point", *(name for name in stacked if name != "cell")]]


def _wanted(parts: Sequence[Part]) -> pd.DataFrame:
    """A table with the design point, cell and replication of every mission of the parts."""
    lengths = [len(part.replications) for part in parts]
    return pd.DataFrame(
        {
            "point": np.repeat([part.cell.point for part in parts], lengths),
            "cell": np.repeat([part.cell.key for part in parts], lengths),
            "replication": np.concatenate([part.replications for part in parts]),
        }
    )


def _stacked(tables: Sequence[pa.Table]) -> pd.DataFrame:
    """The rows of all tables; nan in columns that only others of them have."""
    frame = pa.concat_tables(tables, promote_options="default").to_pandas().astype({"cell": str})
    one = [name for name in ("cell", "replication", "uav") if name in frame]
    if frame.duplicated(one).any():  # such as after files of two folders were merged
        frame = frame.drop_duplicates()
        if frame.duplicated(one).any():
            raise InputError(
                "results: two files have different records of a mission; allowed: one of them"
            )
    return frame
