"""JSON documents: frozen models that know their version, read with one-line errors."""

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

import dess
from dess import InputError

_VERSIONS = ("version", "schema_version")


class Document(BaseModel):
    """A JSON document, or a part of one: frozen, and without unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @property
    def data(self) -> dict[str, Any]:
        """The document as plain data."""
        return self.model_dump(mode="json", by_alias=True)


def read_json(path: Path, schema: int, absent: str, allowed: str) -> Any:
    """The data of a JSON file that has a ``version`` of dess and a ``schema_version``.

    Args:
        path: The file.
        schema: The schema that it must be of.
        absent: What is allowed, if the file does not exist.
        allowed: What is allowed otherwise.

    Raises:
        InputError: If the file does not exist, is no JSON or is of another version.
    """
    try:
        data = json.loads(path.read_text("utf-8"))
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
    return data
