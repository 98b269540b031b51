"""JSON documents as models: what is not valid is refused in one line.

class Notes(Document):
    author: str = Field(max_length=100, description="who wrote them")

notes = Notes.load(Path("notes.json"), "what dess notes has written")
"""

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from dess.errors import InputError, shown, validation_line
from dess.files.reading import read_bytes

# A dotted TOML key with more than 64 parts. The parser takes time with the square of their number.
_PART = r"""(?:[\w-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')"""
_DOTTED = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{64}}")
# More levels of lists and tables than any input has.
_DEEPEST = 100
# Escapes that can stand for half a character, which no encoding can write.
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Parse TOML text that was read from ``where``.

    Raises:
        InputError: If the text is not TOML, or TOML that no memory or number can hold.
    """
    try:
        text.encode()
        if _DOTTED.search(text):
            raise RecursionError
        data = tomllib.loads(text)
        _check_depth(data)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: not valid TOML: {_reason(error)}; allowed: TOML") from None
    return data


def parse_json(text: str | bytes, where: str) -> Any:
    """Parse JSON text that was read from ``where``.

    Raises:
        InputError: If the text is not JSON, or JSON that no memory, number or encoding can hold.
    """
    try:
        decoded = text if isinstance(text, str) else text.decode()
        data = json.loads(decoded)
        _check_depth(data)
        if _SURROGATE.search(decoded):
            json.dumps(data, ensure_ascii=False).encode()
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: not valid JSON: {_reason(error)}; allowed: JSON") from None
    return data


def is_text(name: str) -> bool:
    """Whether a name can be written in UTF-8, which no half of a character can.

    Python makes such halves of the bytes of an argument or a file name that are not UTF-8.
    """
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def _check_depth(data: Any) -> None:
    """Refuse lists and tables so deep that a recursive function could not walk through them."""
    level = [data]
    for _ in range(_DEEPEST):
        inner = [item for item in level if isinstance(item, dict | list)]
        level = [x for item in inner for x in (item.values() if isinstance(item, dict) else item)]
        if not level:
            return
    raise RecursionError


def _reason(error: Exception) -> str:
    """Why a text cannot be parsed, in a line of its own."""
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, UnicodeError):
        return "it is not text in UTF-8"
    if isinstance(error, json.JSONDecodeError | tomllib.TOMLDecodeError):
        return str(error)
    return "a number has too many digits" if "digits" in str(error) else str(error)


LIMIT = 256 * 2**20  # bytes of the largest document; a design point of a manifest takes about 150

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
                raise InputError(f"{where}: is not an object; allowed: an object of JSON")
            for key, value in fixed.items():
                held = data.get(key, value)
                if type(held) is not type(value) or held != value:
                    line = f"{where}: has {key} {shown(held)}, not {shown(value)}; allowed: {value}"
                    raise Outdated(_refused(line, allowed))
            return cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            raise InputError(_refused(validation_line(error, where, cls), allowed)) from None
        except Outdated:
            raise
        except InputError as error:
            raise InputError(_refused(str(error), allowed)) from None

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
        return cls.parse(content, str(path), allowed, fixed)


def _refused(line: str, allowed: str) -> str:
    """The line, with other words for what is allowed, if there are some."""
    return f"{line.partition('; allowed:')[0]}; allowed: {allowed}" if allowed else line
