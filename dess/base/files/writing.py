"""Writing files completely or not at all.

A temporary folder that a killed process has left is removed by a later one.
"""

import errno
import json
import os
import platform
import re
import secrets
import shutil
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from psutil import pid_exists

from dess.base.errors import InputError
from dess.base.files.reading import kind_of

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip file can store
_FILE, _FOLDER = 0o100644, 0o40755


def toml_value(value: Any) -> str:
    """A value in the syntax of TOML, on one line: as in JSON, but for tables and what is None."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, dict):
        present = {key: inner for key, inner in value.items() if inner is not None}
        return f"{{{', '.join(f'{key} = {toml_value(inner)}' for key, inner in present.items())}}}"
    return json.dumps(value, ensure_ascii=False)


def write_zip(path: Path, entries: Iterable[tuple[str, bytes]]) -> None:
    """Write a zip file.

    Args:
        path: The file, a temporary one of ``replacing``.
        entries: Names with their contents; the name of a folder ends with a slash.
    """
    with ZipFile(path, "w") as archive:
        for name, content in entries:
            entry = ZipInfo(name, _EPOCH)
            entry.compress_type = ZIP_DEFLATED
            entry.external_attr = (_FOLDER if entry.is_dir() else _FILE) << 16  # permissions
            archive.writestr(entry, content)


# The longest name of a file or a folder in the usual file systems [bytes].
_LONGEST = 255
# Temporary files and folders: the number of their process, its computer, and a random number.
HOST = sha256(platform.node().encode()).hexdigest()[:8]
_TEMPORARY = re.compile(rf"\.dess-(\d{{1,9}})-{HOST}[0-9a-f]+\.tmp")
_OWN: set[Path] = set()  # temporary files and folders of this process


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file, completely or not at all; its folder is made if there is none.

    Raises:
        InputError: If it cannot be written.
    """
    write_files({path: content})


def write_files(contents: Mapping[Path, str | bytes]) -> None:
    """Write several files as ``write_file`` does, all of them or none."""
    for path in contents:
        make_folder(path.parent)
    with replacing_all([*contents]) as temporaries:
        for (path, content), temporary in zip(contents.items(), temporaries, strict=True):
            with writable(path):
                fill(temporary, content)


def fill(temporary: Path, content: str | bytes) -> None:
    """Write the content of a file that ``replacing`` has made."""
    temporary.write_bytes(content if isinstance(content, bytes) else content.encode())


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path that replaces ``path`` at the end, and is deleted on an error.

    So ``path`` has either its old content or all of the new content, never a part of it. A link is
    replaced by a file; what it leads to is not changed.

    Raises:
        InputError: If no file can be written there, or if it cannot be written completely, such as
            to a full disk.
    """
    with replacing_all([path]) as (temporary,):
        yield temporary


@contextmanager
def replacing_all(paths: Sequence[Path]) -> Iterator[list[Path]]:
    """Yield a temporary path for each path, as ``replacing`` does; they are replaced together.

    On an error, at whatever moment, no file is left where there was none. The errors are those of
    ``replacing``.
    """
    with ExitStack() as temporaries:
        pairs = [(temporaries.enter_context(_temporary(path)), path) for path in paths]
        yield [temporary for temporary, _ in pairs]
        with ExitStack() as undo:
            for temporary, path in pairs:
                with writable(path):
                    is_new = not path.exists()
                    os.replace(temporary, path)
                if is_new:
                    undo.callback(path.unlink, missing_ok=True)
            undo.pop_all()


@contextmanager
def _temporary(path: Path) -> Iterator[Path]:
    """An empty file in the folder of ``path``, deleted at the end."""
    with writable(path):
        check_place(path)
        temporary = _temporary_name(path)
        try:
            temporary.touch(exist_ok=False)  # an interrupt may come as soon as the file is there
            yield temporary
        finally:
            temporary.unlink(missing_ok=True)
            _OWN.discard(temporary)


def _temporary_name(path: Path) -> Path:
    """A name beside ``path`` that belongs to this process."""
    temporary = path.with_name(f".dess-{os.getpid()}-{HOST}{secrets.token_hex(4)}.tmp")
    _OWN.add(temporary)
    _sweep(path.parent.absolute())
    return temporary


@contextmanager
def creating_folder(path: Path) -> Iterator[Path]:
    """Yield a temporary folder that becomes ``path`` at the end, and is deleted on an error.

    So there is either no such folder, or one with all its files.

    Raises:
        InputError: If it cannot be made, or as ``check_new_folder`` does.
    """
    check_new_folder(path)
    target = Path(os.path.realpath(path))
    with writable(path):
        temporary = _temporary_name(target)
        try:
            temporary.mkdir()
            yield temporary
            temporary.rename(target)  # which replaces an empty folder
        finally:
            _discard(temporary)
            _OWN.discard(temporary)


def _discard(temporary: Path) -> None:
    """Delete a temporary file, or a temporary folder with its files."""
    if temporary.is_dir() and not temporary.is_symlink():
        shutil.rmtree(temporary, ignore_errors=True)
    else:
        temporary.unlink(missing_ok=True)


def remove_temporaries() -> None:
    """Delete the temporary files and folders of this process, which ends without a cleanup."""
    for temporary in [*_OWN]:
        _discard(temporary)


def check_target(path: Path) -> None:
    """Refuse a file that ``write_file`` could not write, before a long computation begins.

    Raises:
        InputError: If its folder cannot be made or written, or if it is no regular file.
    """
    check_folder(path.parent)
    with writable(path):
        check_place(path)


def check_place(path: Path) -> None:
    """Refuse to replace anything but a regular file, or a link to one."""
    _check_name(path)
    try:
        status = path.stat()
    except FileNotFoundError:
        return
    except OSError as error:
        if error.errno == errno.ELOOP and path.is_symlink():
            return  # a link to itself leads nowhere, and is replaced as others are
        raise
    if not stat.S_ISREG(status.st_mode):
        raise InputError(path, f"is {kind_of(status)}", "a file")
    if path.is_symlink() and Path("/dev") in path.absolute().parents:  # such as /dev/stdout
        raise InputError(path, "is a device", "a file")


def _check_name(path: Path) -> None:
    """Refuse a path that no file can have."""
    if "\0" in str(path):
        raise InputError(path, "has a null character", "another path")
    if any(len(os.fsencode(part)) > _LONGEST for part in path.parts):
        raise InputError(path, "File name too long", f"{_LONGEST} bytes at most")


@cache
def _sweep(folder: Path) -> None:
    """Delete what processes have left there which were killed, once per process."""
    with suppress(OSError):
        for path in folder.iterdir():
            if (match := _TEMPORARY.fullmatch(path.name)) and not pid_exists(int(match[1])):
                _discard(path)


@contextmanager
def writable(path: Path) -> Iterator[None]:
    """Replace an ``OSError`` that is raised while ``path`` is written by a one-line message.

    Raises:
        InputError: In place of the ``OSError``.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or error
        raise InputError(path, f"cannot be written: {reason}", "another path") from None


def check_folder(path: Path) -> None:
    """Refuse a folder that cannot be made or written, before a long computation begins.

    Raises:
        InputError: If the folder cannot be made, or no file can be written into it.
    """
    _check_name(path)
    # A link that leads nowhere is there: no folder can be made in its place.
    nearest = next(above for above in (path, *path.absolute().parents) if os.path.lexists(above))
    if not nearest.is_dir() or not os.access(nearest, os.W_OK):
        reason = "Not a directory"
        if nearest.is_dir():
            reason = "Permission denied"
        raise InputError(path, f"cannot be written: {reason}", "another path")


def is_read_only(folder: Path) -> bool:
    """Whether a folder is there and no file can be written into it."""
    return folder.is_dir() and not os.access(folder, os.W_OK)


def check_new_folder(path: Path) -> None:
    """Refuse a folder that ``creating_folder`` could not make, before a long computation begins.

    Raises:
        InputError: If there is a file or a folder with files, or if no folder can be made there.
    """
    check_folder(path)
    target = Path(os.path.realpath(path))
    if target.is_dir() and any(target.iterdir()):
        raise InputError(path, "is a folder with files", "a new folder, or an empty one")
    if not target.parent.is_dir():
        raise InputError(path, f"there is no folder {path.parent}", "a new folder in one")
    check_folder(target.parent)


def make_folder(path: Path) -> None:
    """Make a folder, and those above it, unless they are there.

    Raises:
        InputError: If it cannot be made.
    """
    if not path.is_dir():
        check_folder(path)
        with writable(path):
            path.mkdir(parents=True, exist_ok=True)


def delete(path: Path) -> None:
    """Delete a file, if there is one; a folder of its name stays.

    Raises:
        InputError: If it cannot be deleted.
    """
    if not path.is_dir():
        with writable(path):
            path.unlink(missing_ok=True)


def remove_if_empty(folder: Path) -> None:
    """Remove a folder, if there is one and nothing is in it."""
    with suppress(OSError):
        folder.rmdir()
