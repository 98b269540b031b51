"""JSON documents as models: what is not valid is refused in one line.

class Notes(Document):
    author: str = Field(max_length=100, description="who wrote them")

notes = Notes.load(Path("notes.json"), "what dess notes has written")
"""

from codecs import BOM_UTF8
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from dess.base.errors import InputError, shown, to_input_error
from dess.base.files.reading import parse_json, read_bytes

LIMIT = 256 * 2**20  # bytes of the largest document; a design point of a manifest takes about 150

Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]  # a checksum, or a hash of code

_NONE: Mapping[str, object] = MappingProxyType({})


class Outdated(InputError):  # noqa: N818 - it may be no error
    """A document is of another version, or of other data, than the wanted one."""


class Document(BaseModel):
    """A JSON document, or a part of one: frozen, of finite numbers, and without unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @property
    def data(self) -> dict[str, Any]:
        """The document as plain data."""
        return self.model_dump(mode="json", by_alias=True)

    @classmethod
    def parse(
        cls, text: str | bytes, where: str, allowed: str = "", fixed: Mapping[str, object] = _NONE
    ) -> Self:
        """Read a document from its JSON text.

        Args:
            text: The text.
            where: The file or page that contains the text, for messages.
            allowed: What messages say is allowed; by default, what the field may be.
            fixed: Values that keys must have if they are there, such as a version. They are
                compared first, as another version may have other fields.

        Raises:
            Outdated: If a key has not its fixed value.
            InputError: If the text is not a valid document.
        """
        try:
            data = parse_json(text, where)  # also refuses integers that cannot be printed
            if not isinstance(data, dict):
                raise InputError(where, "is not an object", "an object of JSON")
            for key, value in fixed.items():
                present = data.get(key, value)
                if type(present) is not type(value) or present != value:
                    problem = f"has {key} {shown(present)}, not {shown(value)}"
                    raise Outdated(where, problem, allowed or str(value))
            return cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            refusal = to_input_error(error, where, cls)
        except Outdated:
            raise
        except InputError as error:
            refusal = error
        raise InputError(refusal.where, refusal.problem, allowed or refusal.allowed)

    @classmethod
    def load(
        cls,
        path: Path,
        allowed: str = "",
        absent: str = "",
        fixed: Mapping[str, object] = _NONE,
        limit: int = LIMIT,
    ) -> Self:
        """Read a document from a file.

        Args:
            path: The file.
            allowed: As for ``parse``.
            absent: What messages say is allowed if the file cannot be read; by default ``allowed``.
            fixed: As for ``parse``.
            limit: The largest size of the file [bytes].

        Raises:
            Missing: If there is no such file.
            Outdated: If a key has not its fixed value.
            InputError: If the file cannot be read, or is not valid.
        """
        content = read_bytes(path, limit, absent or allowed or "a file")
        return cls.parse(content.removeprefix(BOM_UTF8), str(path), allowed, fixed)
