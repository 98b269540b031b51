"""Chunks: what is computed and kept together, and how a study is cut into them."""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from analysis.results.manifest import Cell, Manifest
from analysis.study.study import CHECK


@dataclass(frozen=True)
class Part:
    """Consecutive replications of a cell."""

    cell: Cell
    replications: range


@dataclass(frozen=True)
class Chunk:
    """What is computed and kept together: parts of the cells of one team."""

    team: int
    parts: tuple[Part, ...]

    @property
    def missions(self) -> int:
        """How many missions it has."""
        return sum(len(part.replications) for part in self.parts)

    @property
    def rows(self) -> list[tuple[str, int, int]]:
        """The key, start and stop of every part."""
        return [(p.cell.key, p.replications.start, p.replications.stop) for p in self.parts]

    @property
    def name(self) -> str:
        """A hash of what it holds."""
        return name_of(self.rows)


@dataclass(frozen=True)
class Failure:
    """A chunk that could not be computed.

    Attributes:
        policy: The team.
        missions: How many missions are missing for it.
        error: What went wrong, in a line.
        command: A command that does it again.
        traceback: Where it went wrong.
    """

    policy: str
    missions: int
    error: str
    command: str
    traceback: str


def parts_of(manifest: Manifest, team: int, counts: Sequence[int] | None = None) -> list[Part]:
    """The first missions of every cell of a team: ``counts``, or as many as the manifest wants."""
    cells, counts = manifest.cells[team], counts or manifest.missions[team]
    return [Part(c, range(c.first, c.first + n)) for c, n in zip(cells, counts, strict=True)]


def check_parts(manifest: Manifest, team: int) -> list[Part]:
    """The missions that check the design points selected for a team.

    None of them has selected one.
    """
    points = manifest.selected_points(team)
    check = range(CHECK, CHECK + manifest.study["selection"]["check"]) if points else range(0)
    return [Part(manifest.cells[team][point], check) for point in points]


def split(parts: Iterable[Part], size: int) -> Iterator[Chunk]:
    """Parts in their order as chunks of ``size`` missions; a chunk has one team."""
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
    """What of a range is in none of the others."""
    missing, begin = [], wanted.start
    for there in sorted(present, key=lambda r: r.start):
        if there.start > begin:
            missing.append(range(begin, min(there.start, wanted.stop)))
        begin = max(begin, there.stop)
        if begin >= wanted.stop:
            break
    return [gap for gap in [*missing, range(begin, wanted.stop)] if len(gap)]


def name_of(rows: Sequence[Sequence[Any]]) -> str:
    """What a file is called that holds these parts."""
    return short_hash(json.dumps(rows).encode())


def short_hash(content: bytes) -> str:
    """Enough of a hash to tell files apart."""
    return sha256(content).hexdigest()[:16]
