"""JSON documents as models: what is not valid is refused in one line.

class Notes(Document):
    author: str = Field(max_length=100, description="who wrote them")

notes = Notes.load(Path("notes.json"), "allowed: what dess notes has written")
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from dess.errors import InputError, validation_line
from dess.files.parsing import parse_json
from dess.files.reading import read_bytes

LIMIT = 256 * 2**20  # bytes of the largest document; a design point of a manifest takes about 150


class Document(BaseModel):
    """A JSON document, or a part of one: frozen, of finite numbers, and without unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @property
    def data(self) -> dict[str, Any]:
        """The document as plain data."""
        return self.model_dump(mode="json", by_alias=True)

    @classmethod
    def parse(
        cls,
        text: str | bytes,
        where: str,
        allowed: str = "",
        first: Callable[[dict], object] | None = None,
    ) -> Self:
        """Read a document from its JSON text.

        Args:
            text: The text.
            where: The file or page that contains the text, for messages.
            allowed: The end of the message, such as ``allowed: a page of dess report``; by default
                what the field may be.
            first: Called with the plain data before they are compared with the model, to refuse
                those of another version.

        Raises:
            InputError: If the text is not a valid document.
        """
        try:
            data = parse_json(text, where)  # also refuses integers that cannot be printed
        except InputError as error:
            raise _refused(str(error), allowed) from None
        if not isinstance(data, dict):
            raise _refused(f"{where}: is not an object; allowed: an object of JSON", allowed)
        if first:
            first(data)
        try:
            return cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            raise _refused(validation_line(error, where, cls), allowed) from None

    @classmethod
    def load(
        cls,
        path: Path,
        allowed: str = "",
        absent: str = "",
        first: Callable[[dict], object] | None = None,
        limit: int = LIMIT,
    ) -> Self:
        """Read a document from a file.

        Args:
            path: The file.
            allowed: As for ``parse``.
            absent: The end of the message if the file does not exist; by default ``allowed``.
            first: As for ``parse``.
            limit: The largest size of the file [bytes].

        Raises:
            InputError: If the file does not exist, cannot be read, or is not valid.
        """
        try:
            content = read_bytes(path, limit)
        except (FileNotFoundError, NotADirectoryError):
            raise _refused(f"{path}: no such file", absent or allowed) from None
        except InputError as error:
            raise _refused(str(error), allowed) from None
        return cls.parse(content, str(path), allowed, first)


def _refused(line: str, allowed: str) -> InputError:
    """The error of a line, with other words for what is allowed, if there are some."""
    return InputError(f"{line.partition('; allowed:')[0]}; {allowed}" if allowed else line)
