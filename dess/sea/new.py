"""A new scenario with a data sheet: what is asked for it, and its commented TOML file.

text = new_scenario(Path("buoys.csv"), {"endurance": "35 min", ...})
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dess.errors import InputError, one_of, shown, validated
from dess.sea.nodes import MAX_GRID, RATES, NodesFile, NodesFound
from dess.sea.places import Projection
from dess.sections.data_sheet import DataSheet, printed

# What is asked beyond the sheet: its meaning, and what an empty answer means.
_BEYOND = {
    "base": ('where UAVs start and charge, in degrees, such as "8.70, 53.87", or as x, y', None),
    "uavs": ("number of UAVs", "2"),
    "pads": ("number of charging pads", "1"),
    "no_fly": ("file with land and islands", ""),
}
_NEEDED = ("endurance", "cruise", "charging", "data_rate", "bandwidth", "snr")
_ASKED = (*_NEEDED, "range", "horizon", "wind")


def questions(nodes: Path) -> dict[str, tuple[str, str | None]]:
    """What a scenario of these nodes is asked: the meaning, and a default or None.

    Raises:
        InputError: If the file of the nodes cannot be read.
    """
    asked = {n: (DataSheet.form_of(n), None if n in _NEEDED else "") for n in _ASKED}
    if all(row.property("", RATES) for row in _read(nodes).rows):
        del asked["data_rate"]
    return asked | _BEYOND


def _read(nodes: Path) -> NodesFound:
    return NodesFound.read(nodes, NodesFile.model_validate({"file": nodes.name}))


def check(name: str, answer: str) -> None:
    """Refuse an answer that is none.

    Raises:
        InputError: If it is of another kind, or there is no such question.
    """
    known = (*DataSheet.model_fields, *_BEYOND)
    if name not in known:
        raise InputError(f"--set: {name}: unknown key{one_of(name, known)}")
    if name in DataSheet.model_fields:
        DataSheet.check(name, answer or None)
    elif name == "base":
        _place(answer)
    elif name != "no_fly" and not (answer.isdecimal() and 1 <= int(answer) <= 64):
        raise InputError(f"{name}: {shown(answer)} is out of range; allowed: 1..64")


def _place(answer: str) -> list[float]:
    try:
        x, y = map(float, answer.split(","))
    except ValueError:
        allowed = "two numbers with a comma between them"
        raise InputError(f"base: {shown(answer)} is no place; allowed: {allowed}") from None
    return [x, y]


def new_scenario(nodes: Path, answers: Mapping[str, str]) -> str:
    """The text of a scenario.

    Args:
        nodes: The file of the nodes, which lies beside that of the scenario.
        answers: By the names of ``questions``, checked.

    Raises:
        InputError: If the sea is too large for the UAVs.
    """
    sheet = {name: answers[name] for name in DataSheet.model_fields if answers.get(name)}
    cell = validated(DataSheet, sheet, "data_sheet").units.cell
    found, (x, y) = _read(nodes), _place(answers["base"])
    side = math.ceil(math.sqrt(2 * int(answers["uavs"])))
    spots, zone = np.vstack([found.spots, [x, y]]), f"[{x:.0f}, {y:.0f}, {side}, {side}]"
    sides = spots.max(0) + side
    if found.is_geographic:
        spots = Projection.about(found.spots, (0, 0), cell).cells(spots)
        sides = 2 * (np.abs(spots).max(0) + side)
        zone = f"{{lon = {x!r}, lat = {y!r}, width = {side}, height = {side}}}"
    columns, rows = (max(math.ceil(length), 4) for length in sides)
    if max(columns, rows) > MAX_GRID:
        size = f"{columns:,} x {rows:,} cells of {printed(cell, 'm')}, the way of a slot"
        allowed = f"{MAX_GRID} x {MAX_GRID}, with UAVs that fly further or places that are nearer"
        raise InputError(f"{nodes}: takes {size}; allowed: {allowed}")
    is_parted = len(np.unique(np.floor(spots[:-1]), axis=0)) == len(spots) - 1
    file = json.dumps(nodes.name) + ("" if is_parted else ', place = "merge"')
    lines = [
        f"# {len(found.rows)} nodes; dess scenarios show prints all that follows from this file",
        f"nodes = {{file = {file}}}",
        f"grid = {columns} # cells from west to east",
        f"rows = {rows} # cells from north to south",
        f"zone = {zone} # where UAVs start and charge",
        *(f"{name} = {answers[name]} # {_BEYOND[name][0]}" for name in ("uavs", "pads")),
        _line("no_fly", answers["no_fly"], "land.geojson", _BEYOND["no_fly"][0]),
        "landing = true # missions end on the ground",
        "quota = 0 # UAVs work until the mission ends",
        "\n[data_sheet] # each quantity with its unit",
        *(_line(n, sheet.get(n), *DataSheet.example(n)) for n in DataSheet.model_fields),
    ]
    return "\n".join(lines) + "\n"


def _line(name: str, value: str | None, example: str, meaning: str) -> str:
    """A line of the file, commented out if there is no value."""
    return f"{'' if value else '# '}{name} = {json.dumps(value or example)} # {meaning}"
