"""Folders in which one process works: locked ones, and temporary ones that go with it."""

import secrets
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from dess.base.errors import InputError
from dess.base.files.reading import paths_in
from dess.base.files.writing import check_target, make_folder, writable

SUFFIX = ".lock"


@contextmanager
def locked(path: Path, busy: str, allowed: str, patience: float = 0.0) -> Iterator[None]:
    """Let no other process work in a folder; the folder is made if there is none.

    Args:
        path: A file in the folder, which is there as long as the work goes on.
        busy: What the message says if another process works there.
        allowed: What it says is allowed then.
        patience: How long to wait for the end of its work [s].

    Raises:
        InputError: If another process works there, or if the file cannot be written.
    """
    check_lock(path)
    make_folder(path.parent)
    lock = FileLock(path)
    try:
        with writable(path):
            try:
                lock.acquire(timeout=patience)
            except Timeout:
                raise InputError(path.parent, busy, allowed) from None
            except NotImplementedError:  # as some network file systems
                raise InputError(
                    path, "its file system has no locks", "a folder on a local disk"
                ) from None
        yield
    finally:
        if lock.is_locked:
            _unlink(path)
        lock.release()


def check_lock(path: Path) -> None:
    """Refuse a file that cannot be the lock of a folder, before a long computation begins.

    Raises:
        InputError: If it is a link or no regular file, or if the folder cannot be written.
    """
    check_target(path)
    if path.is_symlink():
        raise InputError(path, "is a link", "a folder without it")


@contextmanager
def temporary_folder(parent: Path, prefix: str) -> Iterator[Path]:
    """Make a new folder, which only this user can read, and remove it at the end.

    A file beside the folder is locked as long as the process lives. So the next call finds the
    folders of processes that were killed, and removes them.

    Args:
        parent: The folder in which the new folder is made.
        prefix: The beginning of its name.
    """
    for left in paths_in(parent, f"{prefix}*{SUFFIX}"):
        with suppress(Timeout, OSError), FileLock(left, timeout=0):  # its process is dead
            _remove(left)
    lock = parent / f"{prefix}{secrets.token_hex(4)}{SUFFIX}"
    with FileLock(lock), ExitStack() as cleaning:
        for _ in range(2):  # an interrupt may end the first time in the middle
            cleaning.callback(_remove, lock)
        folder = lock.with_suffix("")
        folder.mkdir(mode=0o700)
        yield folder


def _remove(lock: Path) -> None:
    """Remove a locked file, and the folder that belongs to it."""
    shutil.rmtree(lock.with_suffix(""), ignore_errors=True)
    _unlink(lock)


def _unlink(lock: Path) -> None:
    with suppress(OSError):  # some systems keep an open file until it is closed
        lock.unlink()
