"""The parts of a study's missions, and the files of a results folder in which they lie."""

import json
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd
import pyarrow as pa

from dess import InputError
from dess.analysis.results.manifest import ELSEWHERE, Cell, Manifest
from dess.analysis.study.study import CHECK
from dess.base.files.reading import paths_in

Present = defaultdict[str, list[range]]  # replications by the key of their cell


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
        return missions_in(self.parts)

    @property
    def rows(self) -> list[tuple[str, int, int]]:
        """The key, start and stop of every part."""
        return [(p.cell.key, p.replications.start, p.replications.stop) for p in self.parts]

    @property
    def name(self) -> str:
        """A hash of the cells and replications in the chunk."""
        return name_of(self.rows)


def missions_in(parts: Iterable[Part]) -> int:
    """The number of missions in some parts."""
    return sum(len(part.replications) for part in parts)


def parts_of(manifest: Manifest, team: int, counts: Sequence[int] | None = None) -> list[Part]:
    """The first missions of every cell of a team: ``counts`` of them, or as the manifest says."""
    return _first_parts(manifest.cells[team], counts or manifest.missions[team])


def bound_parts(manifest: Manifest, counts: Sequence[Sequence[int]] | None = None) -> list[Part]:
    """The missions that need bounds: at every design point those of any team; none without them.

    Args:
        manifest: What the folder is about.
        counts: The missions of every team and design point; by default as the manifest says.
    """
    if not manifest.bound_cells:
        return []
    return _first_parts(manifest.bound_cells, np.max(counts or manifest.missions, axis=0).tolist())


def _first_parts(cells: Sequence[Cell], counts: Sequence[int]) -> list[Part]:
    return [Part(c, range(c.first, c.first + n)) for c, n in zip(cells, counts, strict=True)]


def check_parts(manifest: Manifest, team: int) -> list[Part]:
    """The missions that check the design points selected for a team.

    The selection was not based on any of these missions.
    """
    check = 0
    if manifest.study.selection:
        check = manifest.study.selection.check
    cells = manifest.cells[team]
    replications = range(CHECK, CHECK + check)
    return [Part(cells[point], replications) for point in manifest.selected_points(team)]


def split_into_chunks(parts: Iterable[Part], size: int) -> Iterator[Chunk]:
    """Split the parts of one team, in their order, into chunks of ``size`` missions."""
    waiting: list[Part] = []
    room = size
    for part in parts:
        rest = part.replications
        while len(rest):
            taken = rest[:room]
            waiting.append(Part(part.cell, taken))
            rest = rest[len(taken) :]
            room -= len(taken)
            if not room:
                yield Chunk(part.cell.team, tuple(waiting))
                waiting = []
                room = size
    if waiting:
        yield Chunk(waiting[0].cell.team, tuple(waiting))


def gaps_between(wanted: range, present: list[range]) -> list[range]:
    """The parts of a range that are in none of the present ranges."""
    missing = []
    begin = wanted.start
    for part in sorted(present, key=lambda r: r.start):
        if part.start > begin:
            missing.append(range(begin, min(part.start, wanted.stop)))
        begin = max(begin, part.stop)
        if begin >= wanted.stop:
            break
    return [gap for gap in [*missing, range(begin, wanted.stop)] if len(gap)]


def absent_parts(parts: Iterable[Part], present: Present) -> list[Part]:
    """What of some parts is not present."""
    return [
        Part(p.cell, gap)
        for p in parts
        for gap in gaps_between(p.replications, present[p.cell.key])
    ]


def name_of(rows: Sequence[Sequence[Any]]) -> str:
    """The first half of the name of a file that contains these parts: a hash of them."""
    return short_hash(json.dumps(rows).encode())


def short_hash(content: bytes) -> str:
    """The beginning of a hash, long enough to tell files apart."""
    return sha256(content).hexdigest()[:16]


def rows_of(parts: Sequence[Part], stacked: pd.DataFrame) -> pd.DataFrame:
    """The rows of the missions of the parts, with the ``point`` and ``cell`` of each.

    Args:
        parts: The parts.
        stacked: The rows of these missions, and of others, as ``stacked`` returns them.
    """
    lengths = [len(part.replications) for part in parts]
    keys = pd.DataFrame(
        {
            "point": np.repeat([part.cell.point for part in parts], lengths),
            "cell": np.repeat([part.cell.key for part in parts], lengths),
            "replication": np.concatenate([part.replications for part in parts]),
        }
    )
    rows = keys.merge(stacked, on=["cell", "replication"], how="left")
    return rows[["point", *stacked]]


def stack_tables(tables: Sequence[pa.Table]) -> pd.DataFrame:
    """The rows of all tables; nan in columns that only others of them have.

    Args:
        tables: Tables with the columns ``cell`` and ``replication``.

    Raises:
        InputError: If two tables have different rows for the same mission.
    """
    frame = pa.concat_tables(tables, promote_options="default").to_pandas().astype({"cell": str})
    key = [name for name in ("cell", "replication", "uav") if name in frame]
    if frame.duplicated(key).any():  # such as after files of two folders were merged
        hashable = frame.map(lambda v: v.tobytes() if isinstance(v, np.ndarray) else v)
        frame = frame[~hashable.duplicated()]
        if frame.duplicated(key).any():
            raise InputError(
                "results", "two files have different records of a mission", "one of them"
            )
    return frame


MANIFEST, LOCK = "manifest.json", ".lock"
LONG = 150  # largest number of characters of a policy's name in the name of a folder
BOUNDS = "bounds"  # the folder of the bounds of missions, which are the same for all policies
FOLDERS = ("missions", "uavs", "events", BOUNDS, "failures")


def partition_name(policy: str) -> str:
    """The name of the folder with the files of a team."""
    name = quote(policy, safe="", errors="surrogatepass")
    if len(name) > LONG:
        name = f"{name[:LONG]}~{short_hash(name.encode())}"
    return f"policy={name}"


def check_places(folder: Path) -> None:
    """Refuse links in the places of a run's own files: it would write and delete where they lead.

    Raises:
        InputError: If there are links, or files and folders in each other's place.
    """
    for path in (*(folder / name for name in FOLDERS), *paths_in(folder, "*/policy=*")):
        if path.is_symlink() or (path.exists() and not path.is_dir()):
            raise InputError(path, "is a link, or not what a run would write there", ELSEWHERE)


def is_ours(path: Path) -> bool:
    """Whether a run may have made this file or folder before it wrote the manifest."""
    return path.name == LOCK or (path.name.startswith(".") and path.suffix == ".tmp")
