"""JSON documents as frozen models; a document of another version is refused in one line."""

import json
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError

import dess
from dess.errors import InputError, validation_line

_VERSIONS = ("version", "schema_version")


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
        try:
            return cls.model_validate_json(text)
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
            text = path.read_text("utf-8")
            data = json.loads(text)
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(f"{path}: no such file; {absent}") from None
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: cannot be read: {error}; {allowed}") from None
        made_by = [data.get(key) for key in _VERSIONS] if isinstance(data, dict) else [None]
        if None not in made_by and made_by != [dess.__version__, schema]:
            raise InputError(
                f"{path}: made by dess {made_by[0]} (schema {made_by[1]}), "
                f"not {dess.__version__} (schema {schema}); {allowed}"
            )
        return cls.parse(text, str(path), allowed)
