"""TOML files that are shipped in a package, by name, and those of users, by path.

where, values = Shipped("scenario", "dess", "scenarios").load("paper")
"""

from collections.abc import Iterable
from importlib import resources
from os.path import realpath
from pathlib import Path
from typing import Any, NamedTuple

from dess.errors import InputError, one_of, shown
from dess.files.parsing import is_text, parse_toml
from dess.files.reading import Missing, read_text

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
                f"{name_or_path}: {key}: {shown(file)} is not in the same folder; allowed: the "
                "name of a file beside this one, or in a folder there"
            )
        if "\\" in file and not (folder / file).exists():
            named = file.replace("\\", "/")
            raise InputError(f"{name_or_path}: {key}: {shown(file)} is no file; allowed: {named}")
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
        if not is_text(text):
            raise InputError(f"{shown(text)}: is not a name in UTF-8; allowed: another name")
        if text in self.names():
            where = f"{self.kind} {text}"
            file = resources.files(self.package).joinpath(f"{self.folder}/{text}.toml")
            return where, parse_toml(file.read_text("utf-8"), where)
        try:
            return text, parse_toml(read_text(Path(text), TOML_LIMIT, "utf-8-sig"), text)
        except Missing:
            allowed = one_of(text, [*self.names(), *others], "a TOML file")
            raise InputError(f"{text}: no such {self.kind}{allowed}") from None
