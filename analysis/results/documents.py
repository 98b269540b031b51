"""The types of the fields of JSON documents."""

from typing import Annotated

from pydantic import Field

from dess.streams import MAX_REPLICATION, MAX_SEED

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
