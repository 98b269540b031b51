"""Shards: parts of a study that are run by themselves, such as on several machines.

Every shard computes each n-th chunk, into the results folder of the study or into one of its own.
``shards/I-of-N`` there says whether it has only begun or is complete, and ``shards/.I-of-N.lock``
is locked while it runs. ``merge.py`` joins the shards.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple, Self

from dess import InputError
from dess.analysis.results.chunks import BUSY, LOCK, SHARDS
from dess.base.errors import shown
from dess.base.files.locks import locked
from dess.base.files.reading import paths_in, read_text
from dess.base.files.writing import delete, remove_if_empty, write_file

MOST_SHARDS = 9999
# How long a shard waits while others begin in the same folder [s].
PATIENCE = 30.0
_TYPED = re.compile(r"([1-9]\d{0,3})/([1-9]\d{0,3})")
_NAME = re.compile(r"([1-9]\d{0,3})-of-([1-9]\d{0,3})")
_BEGUN, _COMPLETE = "begun\n", "complete\n"


class Shard(NamedTuple):
    """A part of a study.

    Attributes:
        number: Which one, from 1.
        total: How many there are.
    """

    number: int
    total: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """The shard of ``I/N``.

        Raises:
            InputError: If the text is none.
        """
        match = _TYPED.fullmatch(text)
        if match and int(match[1]) <= int(match[2]):
            return cls(int(match[1]), int(match[2]))
        allowed = f"I/N, such as 2/4, where N is at most {MOST_SHARDS:,}"
        raise InputError("--shard", f"{shown(text)} is no shard", allowed)

    def __str__(self) -> str:
        """As it is typed."""
        return f"{self.number}/{self.total}"

    def has(self, chunk: int) -> bool:
        """Whether a chunk belongs to it, by its number in the study from 0."""
        return chunk % self.total == self.number - 1

    def mark(self, folder: Path, is_complete: bool) -> None:
        """Note in a results folder that it has begun, or is complete."""
        write_file(self.mark_in(folder), _COMPLETE if is_complete else _BEGUN)

    def is_complete(self, folder: Path) -> bool:
        """Whether it is noted as complete in a results folder."""
        path = self.mark_in(folder)
        return path.exists() and read_text(path) == _COMPLETE

    def mark_in(self, folder: Path) -> Path:
        """The file in a results folder that says whether it is complete."""
        return folder / SHARDS / f"{self.number}-of-{self.total}"

    def lock(self, folder: Path) -> Path:
        """The file that is locked while it runs in a results folder."""
        return folder / SHARDS / f".{self.mark_in(folder).name}{LOCK}"


def shards_in(folder: Path) -> list[Shard]:
    """The shards that have begun in a results folder."""
    matches = (_NAME.fullmatch(path.name) for path in paths_in(folder / SHARDS))
    return [Shard(int(match[1]), int(match[2])) for match in matches if match]


def lost_shards(folders: Sequence[Path]) -> list[Shard]:
    """The shards of which others in some results folders tell, and that none has complete."""
    totals = sorted({shard.total for folder in folders for shard in shards_in(folder)})
    shards = (Shard(number + 1, total) for total in totals for number in range(total))
    return [shard for shard in shards if not any(shard.is_complete(folder) for folder in folders)]


def forget_shards(folder: Path) -> None:
    """Delete what a results folder says of shards."""
    for shard in shards_in(folder):
        delete(shard.mark_in(folder))


@contextmanager
def without_shards(folder: Path) -> Iterator[None]:
    """Let no shard run in a results folder.

    Raises:
        InputError: If one is running.
    """
    with ExitStack() as locks:
        for path in paths_in(folder / SHARDS, f".*{LOCK}"):
            locks.enter_context(locked(path, *BUSY))
        yield
    remove_if_empty(folder / SHARDS)
