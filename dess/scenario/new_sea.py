"""A new scenario with a data sheet: what is asked for it, and its commented TOML file.

new = NewScenario(Path("buoys.csv"))
new.check("endurance", "35 min")    # and so on, for all of new.questions()
text = new.text()
"""

import json
import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from dess.base.elementary import hypot
from dess.base.errors import InputError, shown, unknown_name, validated
from dess.base.files.reading import parse_toml
from dess.scenario.data_sheet import LINK_BUDGET, LORA, DataSheet
from dess.scenario.nodes import MAX_GRID, RATES, NodesFile, NodesFound
from dess.scenario.places import GEOGRAPHIC, LIMITS
from dess.scenario.projection import Projection
from dess.scenario.quantities import printed

# What is asked beyond the sheet: its meaning, and what an empty answer means.
_BEYOND = {
    "base": ('where UAVs start and charge: longitude, latitude ("8.70, 53.87"), or x, y', None),
    "uavs": ("number of UAVs", "2"),
    "pads": ("number of charging pads", "1"),
    "zone": ('size of the charging zone in cells, such as "3 x 2"; or two cells for each UAV', ""),
    "no_fly": ("file with land and islands", ""),
}
_NEEDED = ("endurance", "cruise", "charging", "data_rate", "bandwidth")
_ASKED = ("range", "horizon", "reserve", "hover", "altitude", "max_speed", "wind")
# What an answer needs beside it.
_NEEDED_WITH = {"repair": "mtbf", "pad_repair": "pad_mtbf", "wind": "max_speed"}
# What stands for an answer that a sheet needs and that is not given yet.
_UNANSWERED = {"bandwidth": "125 kHz", "snr": "12 dB at 2 km"}
# A base is refused if it is so many times as far from the nodes as it is with its degrees swapped.
_SWAPPED = 10


class NewScenario:
    """What a new scenario of some nodes is asked, and the answers so far."""

    def __init__(self, nodes: Path):
        """Read the nodes.

        Args:
            nodes: Their file, which lies beside that of the scenario.

        Raises:
            InputError: If the file cannot be read.
        """
        self.path = nodes
        self.nodes = NodesFound.read(nodes, NodesFile.model_validate({"file": nodes.name}))
        self.answers: dict[str, str] = {}

    def questions(self, answered: Mapping[str, str]) -> dict[str, tuple[str, str | None]]:
        """What is asked: the meaning, and a default or None.

        Args:
            answered: What is answered already. Who gives a part of a link budget, or LoRa without
                an SNR, is asked for the rest of the budget in place of the SNR.
        """
        link: tuple[str, ...] = ("snr",)
        optional = [*_ASKED]
        has_budget = bool(answered.keys() & {*LINK_BUDGET, "free_space"})
        if has_budget or (answered.get("modulation") == LORA and "snr" not in answered):
            link = LINK_BUDGET
            optional = ["free_space", *_ASKED]
        needed = [*_NEEDED, *link]
        needed += [name for field, name in _NEEDED_WITH.items() if field in answered]
        if self.nodes.has_amounts(RATES):
            needed.remove("data_rate")
        asked: dict[str, tuple[str, str | None]]
        asked = {name: (DataSheet.form_of(name), None) for name in needed}
        asked |= {name: (DataSheet.form_of(name), "") for name in optional if name not in needed}
        return asked | _BEYOND

    def check(self, name: str, answer: str) -> None:
        """Refuse an answer that is none, or that does not fit to those before; keep others.

        Raises:
            InputError: If it is of another kind, or there is no such question.
        """
        allowed = (*DataSheet.model_fields, *_BEYOND)
        if name not in allowed:
            raise unknown_name(f"--set: {name}", "unknown key", name, allowed)
        if name in DataSheet.model_fields:
            with _told(name):
                DataSheet.check(name, _read_value(name, answer))
        elif name == "base":
            self._check_base(answer)
        elif name == "no_fly":
            self._check_no_fly(answer)
        elif name == "zone":
            _sides_of_zone(answer)
        elif not (answer.isdecimal() and 1 <= int(answer) <= 64):
            raise InputError(name, f"{shown(answer)} is out of range", "1..64")
        self._check_together(self.answers | {name: answer})
        self.answers[name] = answer

    def _check_base(self, answer: str) -> None:
        """Refuse a place that is off the Earth or the grid, or has its degrees swapped."""
        x, y = _place(answer)
        most_x, most_y = LIMITS[GEOGRAPHIC]
        if not self.nodes.is_geographic:
            if not (x.is_integer() and y.is_integer() and 0 <= min(x, y) <= max(x, y) < MAX_GRID):
                allowed = f"a cell x, y: integers from 0 to {MAX_GRID - 1}"
                raise InputError("base", f"{shown(answer)} is no cell", allowed)
            return
        swapped = [y, x]
        is_swappable = abs(y) <= most_x and abs(x) <= most_y
        if abs(x) > most_x or abs(y) > most_y:
            hint = ""
            if is_swappable:
                hint = f": {y:g}, {x:g}?"
            allowed = f"longitude -180..180, then latitude -90..90{hint}"
            raise InputError("base", f"{shown(answer)} is no place on the Earth", allowed)
        away = self._away([x, y])
        if is_swappable and away > _SWAPPED * self._away(swapped):
            distance = f"{away:,.0f} km from the nearest node"
            allowed = f"longitude, then latitude, such as {y:g}, {x:g}"
            raise InputError("base", f"{shown(answer)} is {distance}", allowed)

    def _away(self, degrees: list[float]) -> float:
        """The way from a place to the nearest node [km]."""
        projection = Projection.about(self.nodes.spots, (0, 0), 1000.0)
        ways = projection.cells(self.nodes.spots) - projection.cells(np.array([degrees]))
        return float(hypot(*ways.T).min())

    def _check_no_fly(self, answer: str) -> None:
        if answer and not (self.path.parent / answer).is_file():
            allowed = f"the name of a file beside {self.path.name}, or nothing"
            raise InputError("no_fly", f"{shown(answer)} is no file", allowed)

    def _check_together(self, answers: Mapping[str, str]) -> None:
        """Refuse answers from which no slots and cells follow, or a sea that is too large.

        A zone has a cell for each UAV and each pad.
        """
        if answers.get("zone"):
            width, height = _sides_of_zone(answers["zone"])
            for name in ("uavs", "pads"):
                if int(answers.get(name) or 1) > width * height:
                    problem = f"{shown(answers['zone'])} has {width * height} cells"
                    raise InputError("zone", problem, f"{answers[name]} or more, as {name} says")
        if not (answers.get("endurance") and answers.get("cruise")):
            return
        sheet = _sheet_of(answers)
        sheet = {"charging": sheet["endurance"], **_UNANSWERED, **sheet}
        if any(sheet.get(name) for name in LINK_BUDGET) and not answers.get("snr"):
            examples = {name: DataSheet.example(name)[0] for name in LINK_BUDGET}
            sheet = examples | {name: answer for name, answer in sheet.items() if name != "snr"}
        for name in ("repair", "pad_repair"):
            if name in sheet:
                needed = _NEEDED_WITH[name]
                sheet.setdefault(needed, DataSheet.example(needed)[0])
        if "max_speed" not in answers:  # until it is answered, no wind is known to be too strong
            sheet.pop("wind", None)
        cell = validated(DataSheet, sheet, "data_sheet").units.cell
        if answers.get("base"):
            self._check_size(answers, cell)

    def _check_size(self, answers: Mapping[str, str], cell: float) -> None:
        columns, rows = self._sides(answers, cell)
        if max(columns, rows) > MAX_GRID:
            size = f"{columns:,} x {rows:,} cells of {printed(cell, 'm')}, the way of a slot"
            allowed = f"{MAX_GRID} x {MAX_GRID}, with UAVs that fly further or a nearer base"
            raise InputError("base", f"{self.path} and the base take {size}", allowed)

    def _zone(self, answers: Mapping[str, str]) -> tuple[int, int]:
        """The cells of the charging zone from west to east and from north to south."""
        if answers.get("zone"):
            return _sides_of_zone(answers["zone"])
        side = math.ceil(math.sqrt(2 * int(answers.get("uavs") or _BEYOND["uavs"][1] or 1)))
        return side, side

    def _sides(self, answers: Mapping[str, str], cell: float) -> tuple[int, int]:
        """The cells of the grid from west to east and from north to south."""
        side = max(self._zone(answers))
        base = np.array([_place(answers["base"])])
        spots = np.vstack([self.nodes.spots, base])
        sides = spots.max(0) + side
        if self.nodes.is_geographic:
            spots = Projection.about(self.nodes.spots, (0, 0), cell).cells(spots)
            sides = 2 * (np.abs(spots).max(0) + side)
        columns, rows = (max(math.ceil(length), 4) for length in sides)
        return columns, rows

    def text(self, place: str = "") -> str:
        """The text of the scenario, once all questions are answered.

        Args:
            place: How nodes that share cells or lie on land are placed, as ``NodesFile`` has it; by
                default they are merged if they share cells.

        Raises:
            InputError: If the sea is too large for the UAVs, or they are for slots and cells.
        """
        answers = self.answers
        sheet = _sheet_of(answers)
        cell = validated(DataSheet, sheet, "data_sheet").units.cell
        self._check_size(answers, cell)
        columns, rows = self._sides(answers, cell)
        width, height = self._zone(answers)
        x, y = _place(answers["base"])
        cells = self.nodes.spots
        zone = f"[{x:.0f}, {y:.0f}, {width}, {height}]"
        if self.nodes.is_geographic:
            cells = Projection.about(cells, (columns, rows), cell).cells(cells)
            zone = f"{{lon = {x!r}, lat = {y!r}, width = {width}, height = {height}}}"
        if not place and len(np.unique(np.floor(cells), axis=0)) < len(cells):
            place = "merge"
        file = json.dumps(self.path.name) + (f", place = {json.dumps(place)}" if place else "")
        count = len(self.nodes.rows)
        lines = [
            f"# {count} nodes; dess scenarios show prints all that follows from this file",
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


def _sheet_of(answers: Mapping[str, str]) -> dict[str, Any]:
    """The data sheet of the answers so far."""
    answered = [name for name in DataSheet.model_fields if answers.get(name)]
    return {name: _read_value(name, answers[name]) for name in answered}


def _read_value(name: str, answer: str) -> Any:
    """The value of a field of the sheet: a text, or a list that is written as in TOML; or None."""
    if name == "rates" and answer:
        with suppress(InputError):
            return parse_toml(f"value = {answer}", name)["value"]
    return answer or None


@contextmanager
def _told(name: str) -> Iterator[None]:
    """Say in an error which answer is refused."""
    try:
        yield
    except InputError as error:
        raise error.within(name) from None


def _sides_of_zone(answer: str) -> tuple[int, int]:
    """The width and the height of a zone; without an answer none."""
    if not answer:
        return 0, 0
    match = re.fullmatch(r"([1-9][0-9]?) ?[x,] ?([1-9][0-9]?)", answer.strip())
    if not match:
        allowed = 'its cells from west to east and from north to south, such as "3 x 2"'
        raise InputError("zone", f"{shown(answer)} is no size", allowed)
    return int(match[1]), int(match[2])


def _place(answer: str) -> list[float]:
    try:
        x, y = map(float, answer.split(","))
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ValueError
    except ValueError:
        allowed = "two numbers with a comma between them"
        raise InputError("base", f"{shown(answer)} is no place", allowed) from None
    return [x, y]


def _line(name: str, value: Any, example: str, meaning: str) -> str:
    """A line of the file, commented out if there is no value."""
    mark = "" if value else "# "
    text = json.dumps(value or example)
    if not value and example.startswith("["):
        text = example
    return f"{mark}{name} = {text} # {meaning}"
