"""Reading and listing files that may come from anybody."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from dess.errors import InputError

# The largest text file that is read without another limit [bytes].
TEXT_LIMIT = 64 * 2**20
# What is read at a time [bytes].
_PIECE = 2**20
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


class Missing(InputError):  # noqa: N818 - it may be no error
    """There is no such file."""


def read_text(
    path: Path, limit: int = TEXT_LIMIT, encoding: str = "utf-8", allowed: str = "a file"
) -> str:
    """The text of a regular file.

    Args:
        path: The file, or a link to it.
        limit: The largest size that is read [bytes].
        encoding: Its encoding.
        allowed: What messages say is allowed in the place of another file.

    Raises:
        Missing: If there is no such file.
        InputError: If it is no regular file, too large, not text, or cannot be read.
    """
    try:
        return read_bytes(path, limit, allowed).decode(encoding)
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read: it is not text; allowed: UTF-8") from None


def read_bytes(path: Path, limit: int = TEXT_LIMIT, allowed: str = "a file") -> bytes:
    """The content of a regular file; arguments and errors are those of ``read_text``."""
    with _opened(path, limit, allowed) as file:
        # A file of the system that waits for data gives None.
        pieces = islice(iter(lambda: file.read(_PIECE) or b"", b""), limit // _PIECE + 1)
        content = b"".join(pieces)  # reading up to the limit at once would allocate as much
    if len(content) > limit:  # it has grown, or it is a file of the system, whose size is unknown
        raise _too_large(path, limit)
    return content


def checked(path: Path, limit: int, allowed: str = "a file") -> Path:
    """The path of a file that ``read_bytes`` would read, for a library that opens it itself."""
    with _opened(path, limit, allowed):
        return path


def paths_in(folder: Path, pattern: str = "*") -> list[Path]:
    """The files and folders in a folder that match a pattern, sorted; none without a folder.

    Nothing is opened, so anything may be in the place of a file that is found.

    Raises:
        InputError: If the folder cannot be read.
    """
    try:
        if folder.is_dir() and not os.access(folder, os.R_OK | os.X_OK):
            raise InputError(f"{folder}: cannot be read: Permission denied; allowed: a folder")
        return sorted(folder.glob(pattern))
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{folder}: cannot be read: {reason}; allowed: a folder") from None


def kind_of(found: os.stat_result) -> str:
    """What is in the place of a regular file, in words."""
    return _KINDS.get(stat.S_IFMT(found.st_mode), "no regular file")


@contextmanager
def _opened(path: Path, limit: int, allowed: str) -> Iterator[BinaryIO]:
    """A regular file of at most ``limit`` bytes; nothing blocks, whatever is in its place."""
    try:
        with open(path, "rb", opener=_open_at_once) as file:
            found = os.fstat(file.fileno())
            if not stat.S_ISREG(found.st_mode):
                raise OSError(None, f"it is {kind_of(found)}")
            if found.st_size > limit:
                raise _too_large(path, limit)
            yield file
    except InputError:
        raise
    except (FileNotFoundError, NotADirectoryError):
        raise Missing(f"{path}: no such file; allowed: {allowed}") from None
    except IsADirectoryError:
        raise InputError(f"{path}: cannot be read: it is a folder; allowed: {allowed}") from None
    except (OSError, ValueError) as error:  # a ValueError for a path with a null character
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read: {reason}; allowed: {allowed}") from None


def _open_at_once(path: str, flags: int) -> int:
    # Without O_NONBLOCK, which Windows lacks, a pipe waits for somebody who writes into it.
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))


def _too_large(path: Path, limit: int) -> InputError:
    return InputError(f"{path}: is too large; allowed: {limit:,} bytes at most")
