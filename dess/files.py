"""TOML files by name or path, and files that are written whole or not at all."""

import os
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from dess.errors import InputError


class Shipped(NamedTuple):
    """A folder of TOML files that come with a package, known by their names.

    Attributes:
        kind: What one of them is, as messages call it: ``scenario``.
        package: The package that they come with.
        folder: Their folder in it.
    """

    kind: str
    package: str
    folder: str

    def names(self) -> list[str]:
        """The names, in alphabetical order."""
        files = resources.files(self.package).joinpath(self.folder).iterdir()
        return sorted(file.name[:-5] for file in files if file.name.endswith(".toml"))

    def load(self, name_or_path: str | Path) -> tuple[str, dict[str, Any]]:
        """The content of a shipped file, by its name, or of any TOML file, by its path.

        Returns:
            Where it was read, for messages, and what was read.

        Raises:
            InputError: If there is no such file, it cannot be read, or it is not TOML.
        """
        text = str(name_or_path)
        if text in self.names():
            where = f"{self.kind} {text}"
            file = resources.files(self.package).joinpath(f"{self.folder}/{text}.toml")
            return where, parse_toml(file.read_text("utf-8"), where)
        try:
            return text, parse_toml(Path(text).read_text("utf-8"), text)
        except FileNotFoundError:
            allowed = f"{', '.join(self.names())}, or a TOML file"
            raise InputError(f"{text}: no such {self.kind}; allowed: {allowed}") from None
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{text}: cannot be read: {error}") from None


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """TOML text as a dictionary.

    Raises:
        InputError: If the text is no TOML; ``where`` says where it came from.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{where}: not valid TOML: {error}") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside ``path`` that takes its place at the end; it goes if that fails.

    Raises:
        InputError: At once, if no file can be written there.
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
    """Say in one line that a path cannot be written, where the system says so.

    Raises:
        InputError: In place of an ``OSError``.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{path}: cannot be written: {reason}; allowed: another path") from None
