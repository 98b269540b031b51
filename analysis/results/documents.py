"""JSON documents: frozen models that know their version, read with one-line errors."""

import json
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError

import dess
from dess import InputError
from dess.scenario import validation_line

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
        """A document from its JSON text.

        Args:
            text: The text.
            where: What holds it, for messages.
            allowed: What is allowed there.

        Raises:
            InputError: If it is no such document.
        """
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise InputError(f"{validation_line(error, where)}; {allowed}") from None

    @classmethod
    def load(cls, path: Path, schema: int, absent: str, allowed: str) -> Self:
        """A document from a file, with a ``version`` of dess and a ``schema_version``.

        Args:
            path: The file.
            schema: The schema that it must be of.
            absent: What is allowed, if the file does not exist.
            allowed: What is allowed otherwise.

        Raises:
            InputError: If the file does not exist, is of another version, or is no such document.
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
