"""The names of the fields of scenarios; those of sections are ``failures.uav_rate``."""

from typing import Any

from pydantic.fields import FieldInfo

from dess.scenario.constants import EXTENSIONS, Constants
from dess.sections.section import Section


def fields_of(model: type[Constants]) -> dict[str, FieldInfo]:
    """The fields of a kind of scenario; those of sections are named as ``failures.uav_rate``."""
    found: dict[str, FieldInfo] = {}
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Section):
            found |= {f"{name}.{part}": inner for part, inner in kind.model_fields.items()}
        else:
            found[name] = field
    return found


def merged(base: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """Values on top of others; ``failures.uav_rate`` and a table replace parts of a section."""
    result = dict(base)
    for name, value in values.items():
        section, _, part = name.partition(".")
        table = {part: value} if part else value
        before = result.get(section)
        if (
            section in EXTENSIONS
            and isinstance(table, dict)
            and (before is None or isinstance(before, dict))
        ):
            result[section] = (before or {}) | table
        else:
            result[name] = value
    return result


def dotted(values: dict[str, Any]) -> dict[str, Any]:
    """Values by field: the table of a section becomes fields such as ``failures.uav_rate``."""
    fields: dict[str, Any] = {}
    for name, value in values.items():
        if name in EXTENSIONS and isinstance(value, dict):
            fields |= {f"{name}.{part}": of_part for part, of_part in value.items()}
        else:
            fields[name] = value
    return fields
