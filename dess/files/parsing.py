"""Text in TOML and JSON that may come from anybody, as plain data."""

import json
import re
import tomllib
from typing import Any

from dess.errors import InputError

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
