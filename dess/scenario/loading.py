"""Scenarios that are shipped, by name, and scenarios in TOML files."""

from pathlib import Path
from typing import Any

from dess.files.shipped import Shipped
from dess.scenario.fields import merged
from dess.scenario.space import ScenarioSpace, validated
from dess.sea import nodes_in

_SCENARIOS = Shipped("scenario", "dess", "scenarios")


def load_scenario(name_or_path: str | Path = "paper", /, **overrides: Any) -> ScenarioSpace:
    """A shipped scenario by name, or one from a TOML file.

    Args:
        name_or_path: One of ``scenario_names()``, or the path of a TOML file. In such a file,
            ``nodes`` may be the name of a file in the same folder, which ``dess.sea`` reads.
        **overrides: Values that replace those of the file. A sampled field that is set to a single
            value is no longer sampled.

    Raises:
        InputError: If there is no such scenario, or it is not valid.
    """
    where, read = _SCENARIOS.load(name_or_path)
    read.pop("description", None)
    values = merged(read, overrides)
    if isinstance(read.get("nodes"), str) and "nodes" not in overrides:
        without = validated(ScenarioSpace, values | {"nodes": [[0, 0]], "arrivals": {}}, where)
        path = _SCENARIOS.beside(name_or_path, "nodes", read["nodes"])
        values["nodes"] = nodes_in(path, without.grid, without.cell_size)
    return validated(ScenarioSpace, values, where)


def scenario_names() -> list[str]:
    """The names of the shipped scenarios."""
    return _SCENARIOS.names()


def scenario_description(name_or_path: str | Path) -> str:
    """What a scenario is about, as its file says under ``description``.

    Raises:
        InputError: If there is no such scenario.
    """
    return str(_SCENARIOS.load(name_or_path)[1].get("description", ""))
