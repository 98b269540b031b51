"""``KEY=VALUE`` on the command line: fields of a scenario, and parameters of notebooks."""

import math
import os
import tomllib
from typing import Any

from dess.errors import InputError

FIELD = "a field of the scenario and a value in TOML syntax, e.g. uavs=2 or initial_data=[5, 20]"
PARAMETER = "a parameter of the notebooks and a value in TOML syntax, e.g. missions=500"


def setting(text: str, option: str = "--set", allowed: str = FIELD) -> tuple[str, Any]:
    """``KEY=VALUE`` as key and value.

    Args:
        text: What was given.
        option: The option that it was given to.
        allowed: What that takes.

    Raises:
        InputError: If it is something else.
    """
    key, equals, value = text.partition("=")
    try:
        parsed = tomllib.loads(f"value = {value}")
    except tomllib.TOMLDecodeError as error:
        parsed = {"error": error}
    if not equals or parsed.keys() != {"value"} or not _is_plain(parsed["value"]):
        raise InputError(f"{option}: {text!r} is not KEY=VALUE; allowed: {allowed}")
    return key.strip(), parsed["value"]


def from_here(value: Any) -> Any:
    """A value of a parameter; paths, also those in a team, from here: a notebook runs elsewhere."""
    if isinstance(value, list):
        return [from_here(each) for each in value]
    if not isinstance(value, str):
        return value
    parts = value.split(",")
    is_path = [os.sep in part or part.endswith(".toml") for part in parts]
    found = zip(parts, is_path, strict=True)
    return ",".join(os.path.abspath(part) if path else part for part, path in found)


def _is_plain(value: Any) -> bool:
    """Whether a value is of those that fields and parameters have: no date, and no nan."""
    if isinstance(value, list | dict):
        return all(map(_is_plain, value.values() if isinstance(value, dict) else value))
    return isinstance(value, str | int) or (isinstance(value, float) and math.isfinite(value))
