"""JSON documents as frozen models; a document of another version is refused in one line."""

from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

import dess
from dess.errors import InputError, cut, printable, validation_line
from dess.files import parse_json, read_text
from dess.streams import MAX_REPLICATION, MAX_SEED

LIMIT = 256 * 2**20  # bytes of the largest document; a design point takes about 150

_VERSIONS = ("version", "schema_version")


# Strings of a known form: a hash of code, a module, a class, a library, a version.
Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Module = Annotated[str, Field(pattern=r"^[\w.]+$", max_length=500)]
Class = Annotated[str, Field(pattern=r"^[\w.]+:[\w.<>]+$", max_length=1000)]
Library = Annotated[str, Field(pattern=r"^[\w.-]+$", max_length=100)]
Version = Annotated[str, Field(pattern=r"^[\w.+!-]+$", max_length=100)]
Commit = Annotated[str, Field(pattern=r"^[0-9a-f]{40,64}$")]
# What the key of a study and of a cell is: the beginning of a hash.
Key = Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
Seed = Annotated[int, Field(ge=0, le=MAX_SEED)]
Replication = Annotated[int, Field(ge=0, le=MAX_REPLICATION)]
Count = Annotated[int, Field(ge=0, le=2**53)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Document(BaseModel):
    """A JSON document, or a part of one: frozen, and without unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @property
    def data(self) -> dict[str, Any]:
        """The document as plain data."""
        return self.model_dump(mode="json", by_alias=True)

    @classmethod
    def parse(cls, text: str, where: str, allowed: str) -> Self:
        """Read a document from its JSON text.

        Args:
            text: The text.
            where: The file or page that contains the text, for messages.
            allowed: What the message says is allowed.

        Raises:
            InputError: If the text is not a valid document.
        """
        parse_json(text, where)  # first, since this also refuses integers that cannot be printed
        try:
            return cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            problem = validation_line(error, where, cls).partition("; allowed:")[0]
            raise InputError(f"{problem}; {allowed}") from None

    @classmethod
    def load(cls, path: Path, schema: int, absent: str, allowed: str) -> Self:
        """Read a document from a file, which has a ``version`` of dess and a ``schema_version``.

        Args:
            path: The file.
            schema: The schema version that the document must have.
            absent: What the message says is allowed if the file does not exist.
            allowed: What all other messages say is allowed.

        Raises:
            InputError: If the file does not exist, has another version, or is not valid.
        """
        try:
            text = read_text(path, LIMIT)
            data = parse_json(text, str(path))
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(f"{path}: no such file; {absent}") from None
        except InputError as error:
            problem = str(error).partition("; allowed:")[0]
            raise InputError(f"{problem}; {allowed}") from None
        made_by = [data.get(key) for key in _VERSIONS] if isinstance(data, dict) else [None]
        if None not in made_by and made_by != [dess.__version__, schema]:
            version, other = (cut(printable(str(value)), 60) for value in made_by)
            raise InputError(
                f"{path}: made by dess {version} (schema {other}), "
                f"not {dess.__version__} (schema {schema}); {allowed}"
            )
        return cls.parse(text, str(path), allowed)
