"""Reading TOML files by name or path, and writing files atomically.

where, values = Shipped("scenario", "dess", "scenarios").load("paper")
with replacing(Path("table.json")) as temporary:
    temporary.write_text(text)
"""

import os
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from dess.errors import InputError, one_of


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
        if text in self.names():
            where = f"{self.kind} {text}"
            file = resources.files(self.package).joinpath(f"{self.folder}/{text}.toml")
            return where, parse_toml(file.read_text("utf-8"), where)
        try:
            return text, parse_toml(Path(text).read_text("utf-8"), text)
        except FileNotFoundError:
            allowed = one_of(text, self.names(), "a TOML file")
            raise InputError(f"{text}: no such {self.kind}{allowed}") from None
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{text}: cannot be read: {error}") from None


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Parse TOML text that was read from ``where``.

    Raises:
        InputError: If the text is not TOML.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{where}: not valid TOML: {error}") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path that replaces ``path`` at the end, and is deleted on an error.

    So ``path`` has either its old content or all of the new content, never a part of it.

    Raises:
        InputError: Before the block is run, if no file can be written there.
    """
    if path.is_dir():
        raise InputError(f"{path}: is a folder; allowed: a file")
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with writable(path):
        temporary.touch()
    try:
        yield temporary
        with writable(path):
            os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


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
    there = next(above for above in (path, *path.absolute().parents) if above.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        reason = "Permission denied" if there.is_dir() else "Not a directory"
        raise InputError(f"{path}: cannot be written: {reason}; allowed: another path")
