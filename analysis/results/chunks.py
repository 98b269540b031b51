"""The parts of a study's missions, and the files of a results folder in which they lie."""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import quote

from dess import InputError
from dess.analysis.results.manifest import ELSEWHERE, Cell, CellPart
from dess.base.files.reading import paths_in


@dataclass(frozen=True)
class Chunk:
    """Missions of one team that are computed and stored together: parts of its cells."""

    team: int
    parts: tuple[CellPart, ...]

    @property
    def missions(self) -> int:
        """The number of missions in the chunk."""
        return sum(map(len, self.parts))

    @property
    def rows(self) -> list[tuple[str, int, int]]:
        """The key, start and stop of every part."""
        return [(p.cell.key, p.replications.start, p.replications.stop) for p in self.parts]

    @property
    def name(self) -> str:
        """A hash of the cells and replications in the chunk."""
        return name_of(self.rows)


def split_into_chunks(parts: Iterable[CellPart], size: int) -> Iterator[Chunk]:
    """Split the parts of one team, in their order, into chunks of ``size`` missions."""
    waiting: list[CellPart] = []
    room = size
    for part in parts:
        rest = part.replications
        while len(rest):
            taken = rest[:room]
            waiting.append(CellPart(part.cell, taken))
            rest = rest[len(taken) :]
            room -= len(taken)
            if not room:
                yield Chunk(part.cell.team, tuple(waiting))
                waiting = []
                room = size
    if waiting:
        yield Chunk(waiting[0].cell.team, tuple(waiting))


def name_of(rows: Sequence[Sequence[Any]]) -> str:
    """The first half of the name of a file that contains these parts: a hash of them."""
    return short_hash(json.dumps(rows).encode())


def short_hash(content: bytes) -> str:
    """The beginning of a hash, long enough to tell files apart."""
    return sha256(content).hexdigest()[:16]


MANIFEST, LOCK = "manifest.json", ".lock"
# What is said if another process writes into the folder, and what is allowed then.
BUSY = ("in use by another run", f"{ELSEWHERE}, or wait for its end")
LONG = 150  # largest number of characters of a policy's name in the name of a folder
BOUNDS = "bounds"  # the folder of the bounds of missions, which are the same for all policies
FOLDERS = ("missions", "uavs", "events", BOUNDS, "failures")
SHARDS = "shards"  # the folder of what is said of shards until the study is complete
DERIVED = "derived"  # the folder of what answers and pages have computed from the missions


def partition_name(policy: str) -> str:
    """The name of the folder with the files of a team."""
    name = quote(policy, safe="", errors="surrogatepass")
    if len(name) > LONG:
        name = f"{name[:LONG]}~{short_hash(name.encode())}"
    return f"policy={name}"


def log_name(cell: Cell, replication: int) -> str:
    """The first part of the name of a file with the event log of a replication of a cell."""
    return f"{cell.key}-{replication:06}"


def check_places(folder: Path) -> None:
    """Refuse links in the places of a run's own files: it would write and delete where they lead.

    Raises:
        InputError: If there are links, or files and folders in each other's place.
    """
    ours = (folder / name for name in (*FOLDERS, DERIVED, SHARDS))
    for path in (*ours, *paths_in(folder, "*/policy=*")):
        if path.is_symlink() or (path.exists() and not path.is_dir()):
            raise InputError(path, "is a link, or not what a run would write there", ELSEWHERE)


def is_ours(path: Path) -> bool:
    """Whether a run may have made this file or folder before it wrote the manifest."""
    return path.name == LOCK or (path.name.startswith(".") and path.suffix == ".tmp")
