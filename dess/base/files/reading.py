"""Reading and listing files that may come from anybody: bytes, text, TOML and JSON as plain data.

>>> where, values = Shipped("scenario", "dess", "scenarios").load("paper")
>>> values["uavs"]
[1, 3]
"""

import json
import os
import re
import stat
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from importlib import resources
from itertools import islice
from os.path import realpath
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from dess.base.errors import InputError, shown, unknown_name

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
        raise InputError(path, "cannot be read: it is not text", "UTF-8") from None


def read_bytes(path: Path, limit: int = TEXT_LIMIT, allowed: str = "a file") -> bytes:
    """The content of a regular file; arguments and errors are those of ``read_text``."""
    with _opened(path, limit, allowed) as file:
        # A file of the system that waits for data gives None.
        pieces = islice(iter(lambda: file.read(_PIECE) or b"", b""), limit // _PIECE + 1)
        content = b"".join(pieces)  # reading up to the limit at once would allocate as much
    if len(content) > limit:  # it has grown, or it is a file of the system, whose size is unknown
        raise _too_large(path, limit)
    return content


def version_of(path: Path) -> tuple[int, int]:
    """The time of the last change [ns] and the size of a file; what was read holds with them.

    Raises:
        Missing: If there is no such file.
        InputError: If it cannot be looked at.
    """
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise Missing(path, "no such file", "a file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, f"cannot be read: {reason}", "a file") from None
    return status.st_mtime_ns, status.st_size


def hash_file(path: Path, limit: int) -> str:
    """The SHA-256 hash of the content of a regular file; errors are those of ``read_text``."""
    return sha256(read_bytes(path, limit)).hexdigest()


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
            raise InputError(folder, "cannot be read: Permission denied", "a folder")
        return sorted(folder.glob(pattern))
    except OSError as error:
        reason = error.strerror or error
        raise InputError(folder, f"cannot be read: {reason}", "a folder") from None


def kind_of(found: os.stat_result) -> str:
    """What is in the place of a regular file, in words."""
    return _KINDS.get(stat.S_IFMT(found.st_mode), "no regular file")


@contextmanager
def _opened(path: Path, limit: int, allowed: str) -> Iterator[BinaryIO]:
    """A regular file of at most ``limit`` bytes; nothing blocks, whatever is in its place."""
    try:
        with open(path, "rb", opener=_open_at_once) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise OSError(None, f"it is {kind_of(status)}")
            if status.st_size > limit:
                raise _too_large(path, limit)
            yield file
    except InputError:
        raise
    except (FileNotFoundError, NotADirectoryError):
        raise Missing(path, "no such file", allowed) from None
    except IsADirectoryError:
        raise InputError(path, "cannot be read: it is a folder", allowed) from None
    except (OSError, ValueError) as error:  # a ValueError for a path with a null character
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, f"cannot be read: {reason}", allowed) from None


def _open_at_once(path: str, flags: int) -> int:
    # Without O_NONBLOCK, which Windows lacks, a pipe waits for somebody who writes into it.
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))


def _too_large(path: Path, limit: int) -> InputError:
    return InputError(path, "is too large", f"{limit:,} bytes at most")


# More levels of lists and tables than any input has.
_DEEPEST = 100
# Escapes that can stand for half a character, which no encoding can write.
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Parse TOML text that was read from ``where``.

    Raises:
        InputError: If the text is not TOML, or TOML that no memory or number can hold.
    """
    try:
        text.encode()
        data = tomllib.loads(text)
        _check_depth(data)
    except (ValueError, RecursionError) as error:
        raise InputError(where, f"not valid TOML: {_reason(error)}", "TOML") from None
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
        raise InputError(where, f"not valid JSON: {_reason(error)}", "JSON") from None
    return data


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
    if "digits" in str(error):
        return "a number has too many digits"
    return str(error)


# The largest TOML file that is read [bytes].
TOML_LIMIT = 4 * 2**20


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

    def beside(self, name_or_path: str | Path, key: str, file: str) -> Path:
        """The path of a file that a TOML file names, which must lie in its folder or below.

        Args:
            name_or_path: The TOML file, as ``load`` takes it.
            key: The key that names the file, for the message.
            file: The name.

        Raises:
            InputError: If it is no name, or that of a link that leads out of the folder.
        """
        folder = Path(name_or_path).parent
        if str(name_or_path) in self.names():
            folder = Path(str(resources.files(self.package).joinpath(self.folder)))
        is_inside = file not in ("", ".") and "\0" not in file
        if not is_inside or Path(realpath(folder)) not in Path(realpath(folder / file)).parents:
            raise InputError(
                f"{name_or_path}: {key}",
                f"{shown(file)} is not in the same folder",
                "the name of a file beside this one, or in a folder there",
            )
        if "\\" in file and not (folder / file).exists():
            named = file.replace("\\", "/")
            raise InputError(f"{name_or_path}: {key}", f"{shown(file)} is no file", named)
        return folder / file

    def load(
        self, name_or_path: str | Path, others: Iterable[str] = ()
    ) -> tuple[str, dict[str, Any]]:
        """Read a shipped file by its name, or any TOML file by its path.

        Args:
            name_or_path: The name or path.
            others: Further names that a message about an unknown one lists.

        Returns:
            The name or path, for messages, and the content.

        Raises:
            InputError: If the file does not exist, cannot be read or is not TOML.
        """
        text = str(name_or_path)
        if text in self.names():
            where = f"{self.kind} {text}"
            file = resources.files(self.package).joinpath(f"{self.folder}/{text}.toml")
            return where, parse_toml(file.read_text("utf-8"), where)
        try:
            return text, parse_toml(read_text(Path(text), TOML_LIMIT, "utf-8-sig"), text)
        except Missing:
            names = [*self.names(), *others]
            raise unknown_name(text, f"no such {self.kind}", text, names, "a TOML file") from None
