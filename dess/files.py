"""Reading files that may come from anybody, TOML by name or path, and writing files atomically.

    where, values = Shipped("scenario", "dess", "scenarios").load("paper")
    with replacing(Path("table.json")) as temporary:
        temporary.write_text(text)

Only regular files are read, and up to a limit: a pipe, a device or a file without end in the place
of an input would block the program or fill the memory. Only new and regular files are written.
"""

import json
import os
import re
import secrets
import stat
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib import resources
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from psutil import pid_exists

from dess.errors import InputError, one_of, shown

# The largest text file that is read without another limit [bytes].
TEXT_LIMIT = 64 * 2**20
# The largest TOML file that is read [bytes].
TOML_LIMIT = 4 * 2**20
# What is read at a time [bytes].
_PIECE = 2**20
# The longest name of a file or a folder in the usual file systems [bytes].
_LONGEST = 255
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}
# A dotted TOML key with more than 64 parts. The parser takes time with the square of their number.
_PART = r"""(?:[\w-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')"""
_DOTTED = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{64}}")
# More levels of lists and tables than any input has.
_DEEPEST = 100
# Escapes that can stand for half a character, which no encoding can write.
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
# Temporary files: the number of their process, and a random one.
_TEMPORARY = re.compile(r"\.dess-(\d{1,9})-[0-9a-f]+\.tmp")


class Shipped(NamedTuple):
    """A folder of TOML files in a package, loaded by name.

    Attributes:
        kind: What messages call one of the files, such as ``scenario``.
        package: The package that contains the folder.
        folder: The folder.
    """

    kind: str
    package: str
    folder: str

    def names(self) -> list[str]:
        """The names, in alphabetical order."""
        files = resources.files(self.package).joinpath(self.folder).iterdir()
        return sorted(file.name[:-5] for file in files if file.name.endswith(".toml"))

    def folder_of(self, name_or_path: str | Path) -> Path:
        """The folder from which ``load`` would read a file of this name or path."""
        if str(name_or_path) in self.names():
            return Path(str(resources.files(self.package).joinpath(self.folder)))
        return Path(name_or_path).parent

    def load(self, name_or_path: str | Path) -> tuple[str, dict[str, Any]]:
        """Read a shipped file by its name, or any TOML file by its path.

        Returns:
            The name or path, for messages, and the content.

        Raises:
            InputError: If the file does not exist, cannot be read or is not TOML.
        """
        text = str(name_or_path)
        if not is_text(text):
            raise InputError(f"{shown(text)}: is not a name in UTF-8; allowed: another name")
        if text in self.names():
            where = f"{self.kind} {text}"
            file = resources.files(self.package).joinpath(f"{self.folder}/{text}.toml")
            return where, parse_toml(file.read_text("utf-8"), where)
        try:
            return text, parse_toml(read_text(Path(text), TOML_LIMIT), text)
        except (FileNotFoundError, NotADirectoryError):
            allowed = one_of(text, self.names(), "a TOML file")
            raise InputError(f"{text}: no such {self.kind}{allowed}") from None


def read_text(path: Path, limit: int = TEXT_LIMIT, encoding: str = "utf-8") -> str:
    """The text of a regular file.

    Args:
        path: The file, or a link to it.
        limit: The largest size that is read [bytes].
        encoding: Its encoding.

    Raises:
        FileNotFoundError, NotADirectoryError: If there is no such file.
        InputError: If it is no regular file, too large, not text, or cannot be read.
    """
    try:
        return read_bytes(path, limit).decode(encoding)
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read: it is not text; allowed: UTF-8") from None


def read_bytes(path: Path, limit: int = TEXT_LIMIT) -> bytes:
    """The content of a regular file; arguments and errors are those of ``read_text``."""
    with _opened(path, limit) as file:
        # A file of the system that waits for data gives None.
        pieces = islice(iter(lambda: file.read(_PIECE) or b"", b""), limit // _PIECE + 1)
        content = b"".join(pieces)  # reading up to the limit at once would allocate as much
    if len(content) > limit:  # it has grown, or it is a file of the system, whose size is unknown
        raise _too_large(path, limit)
    return content


def check_file(path: Path, limit: int) -> None:
    """Refuse what ``read_bytes`` refuses, for a library that opens the file itself.

    Raises:
        FileNotFoundError, NotADirectoryError: If there is no such file.
        InputError: If it is no regular file, too large, or cannot be read.
    """
    with _opened(path, limit):
        pass


@contextmanager
def _opened(path: Path, limit: int) -> Iterator[BinaryIO]:
    """A regular file of at most ``limit`` bytes; nothing blocks, whatever is in its place."""
    try:
        with open(path, "rb", opener=_open_at_once) as file:
            found = os.fstat(file.fileno())
            if not stat.S_ISREG(found.st_mode):
                raise InputError(f"{path}: cannot be read: it is {_kind(found)}; allowed: a file")
            if found.st_size > limit:
                raise _too_large(path, limit)
            yield file
    except (FileNotFoundError, NotADirectoryError, InputError):
        raise
    except IsADirectoryError:
        raise InputError(f"{path}: cannot be read: it is a folder; allowed: a file") from None
    except (OSError, ValueError) as error:  # a ValueError for a path with a null character
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read: {reason}; allowed: a file") from None


def _open_at_once(path: str, flags: int) -> int:
    # Without O_NONBLOCK, which Windows lacks, a pipe waits for somebody who writes into it.
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))


def _kind(found: os.stat_result) -> str:
    return _KINDS.get(stat.S_IFMT(found.st_mode), "no regular file")


def _too_large(path: Path, limit: int) -> InputError:
    return InputError(f"{path}: is too large; allowed: {limit:,} bytes at most")


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Parse TOML text that was read from ``where``.

    Raises:
        InputError: If the text is not TOML, or TOML that no memory or number can hold.
    """
    try:
        text.encode()
        if _DOTTED.search(text):
            raise RecursionError
        data = tomllib.loads(text)
        _check_depth(data)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: not valid TOML: {_reason(error)}") from None
    return data


def parse_json(text: str | bytes, where: str) -> Any:
    """Parse JSON text that was read from ``where``.

    Raises:
        InputError: If the text is not JSON, or JSON that no memory, number or encoding can hold.
    """
    try:
        decoded = text if isinstance(text, str) else text.decode()
        data = json.loads(decoded)
        _check_depth(data)
        if _SURROGATE.search(decoded):
            json.dumps(data, ensure_ascii=False).encode()
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: not valid JSON: {_reason(error)}") from None
    return data


def is_text(name: str) -> bool:
    """Whether a name can be written in UTF-8, which no half of a character can.

    Python makes such halves of the bytes of an argument or a file name that are not UTF-8.
    """
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def _check_depth(data: Any) -> None:
    """Refuse lists and tables so deep that a recursive function could not walk through them."""
    level = [data]
    for _ in range(_DEEPEST):
        inner = [item for item in level if isinstance(item, dict | list)]
        level = [x for item in inner for x in (item.values() if isinstance(item, dict) else item)]
        if not level:
            return
    raise RecursionError


def _reason(error: Exception) -> str:
    """Why a text cannot be parsed, in a line of its own."""
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, UnicodeError):
        return "it is not text in UTF-8"
    if isinstance(error, json.JSONDecodeError | tomllib.TOMLDecodeError):
        return str(error)
    return "a number has too many digits" if "digits" in str(error) else str(error)


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
                    _check_target(path)
                    is_new = not path.exists()
                    os.replace(temporary, path)
                if is_new:
                    undo.callback(path.unlink, missing_ok=True)
            undo.pop_all()


@contextmanager
def _temporary(path: Path) -> Iterator[Path]:
    """An empty file in the folder of ``path``, deleted at the end."""
    with writable(path):
        _check_target(path)
        temporary = path.with_name(f".dess-{os.getpid()}-{secrets.token_hex(4)}.tmp")
        _sweep(path.parent.absolute())
        temporary.touch(exist_ok=False)
    try:
        with writable(path):
            yield temporary
    finally:
        temporary.unlink(missing_ok=True)


def _check_target(path: Path) -> None:
    """Refuse to replace anything but a regular file, or a link to one."""
    _check_name(path)
    try:
        found = path.stat()
    except FileNotFoundError:
        return
    if not stat.S_ISREG(found.st_mode):
        raise InputError(f"{path}: is {_kind(found)}; allowed: a file")
    if path.is_symlink() and Path("/dev") in path.absolute().parents:  # such as /dev/stdout
        raise InputError(f"{path}: is a device; allowed: a file")


def _check_name(path: Path) -> None:
    """Refuse a path that no file can have."""
    if "\0" in str(path):
        raise InputError(f"{path}: has a null character; allowed: another path")
    if any(len(os.fsencode(part)) > _LONGEST for part in path.parts):
        raise InputError(f"{path}: File name too long; allowed: {_LONGEST} bytes at most")


@cache
def _sweep(folder: Path) -> None:
    """Delete the temporary files that processes have left which were killed, once per process."""
    with suppress(OSError):
        for path in folder.iterdir():
            if (found := _TEMPORARY.fullmatch(path.name)) and not pid_exists(int(found[1])):
                path.unlink(missing_ok=True)


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
        raise InputError(f"{path}: cannot be written: {reason}; allowed: another path") from None


def check_folder(path: Path) -> None:
    """Refuse a folder that cannot be made or written, before a long computation begins.

    Raises:
        InputError: If the folder cannot be made, or no file can be written into it.
    """
    _check_name(path)
    there = next(above for above in (path, *path.absolute().parents) if above.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        reason = "Permission denied" if there.is_dir() else "Not a directory"
        raise InputError(f"{path}: cannot be written: {reason}; allowed: another path")
