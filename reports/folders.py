"""Temporary folders that are also removed if the process that made them was killed, and locks.

with temporary_folder(Path(gettempdir()), "dess-kernel-") as folder:
    (folder / "kernel.json").write_text(text)
"""

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from dess import InputError

SUFFIX = ".lock"
PATIENCE = 60.0  # seconds


@contextmanager
def temporary_folder(parent: Path, prefix: str) -> Iterator[Path]:
    """Make a new folder, which only this user can read, and remove it at the end.

    A file beside the folder is locked as long as the process lives. So the next call finds the
    folders of processes that were killed, and removes them.

    Args:
        parent: The folder in which the new folder is made.
        prefix: The beginning of its name.
    """
    for left in parent.glob(f"{prefix}*{SUFFIX}"):
        with suppress(Timeout, OSError), FileLock(left, timeout=0):  # its process is dead
            _remove(left)
    lock = parent / f"{prefix}{secrets.token_hex(4)}{SUFFIX}"
    with FileLock(lock):
        try:
            folder = lock.with_suffix("")
            folder.mkdir(mode=0o700)
            yield folder
        finally:
            _remove(lock)


@contextmanager
def locked(folder: Path, what: str) -> Iterator[None]:
    """Wait until no other process does the same work in a folder, which takes a moment.

    Raises:
        InputError: If another process does not end its work.
    """
    lock = folder / f".{what}{SUFFIX}"
    try:
        with FileLock(lock, timeout=PATIENCE):
            try:
                yield
            finally:
                _remove(lock)
    except Timeout:
        raise InputError(f"{folder}: another process writes there; allowed: wait") from None


def _remove(lock: Path) -> None:
    """Remove a locked file, and the folder that belongs to it."""
    shutil.rmtree(lock.with_suffix(""), ignore_errors=True)
    with suppress(OSError):  # some systems keep an open file until it is closed
        lock.unlink()
