"""The types of the fields of JSON documents, and the versions that these are made by."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

import dess
from dess.errors import InputError, cut, printable
from dess.streams import MAX_REPLICATION, MAX_SEED

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


def check_versions(data: dict, path: Path, schema: int, allowed: str) -> None:
    """Refuse a document that another version of dess, or of its schema, has made.

    Args:
        data: The document as plain data; one without versions is not refused.
        path: Its file.
        schema: The schema version that it must have.
        allowed: The end of the message.

    Raises:
        InputError: If it has another version.
    """
    made_by = [data.get(key) for key in _VERSIONS]
    if None not in made_by and made_by != [dess.__version__, schema]:
        version, other = (cut(printable(str(value)), 60) for value in made_by)
        raise InputError(
            f"{path}: made by dess {version} (schema {other}), "
            f"not {dess.__version__} (schema {schema}); {allowed}"
        )
