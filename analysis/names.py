"""The names of the fields of a scenario, and their values in words."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter

from dess.analysis import numbers
from dess.base.descriptions import Description, description_of
from dess.base.errors import form_of, kind_of
from dess.scenario.fields import SAMPLED, ZONE_PADS, fields_of
from dess.scenario.scenario import Scenario, ScenarioSpace

RANGES = (*SAMPLED, "initial_data")  # fields that hold [low, high]
# The description of the studies of sweeps, and the folder of their results folders.
SWEEP, SWEEPS = "a sweep: every combination of the values", "sweeps"


@dataclass(frozen=True)
class Field:
    """A field of a scenario: what figures and pages call it, and its values in words.

    Attributes:
        key: The field, as in ``--set``.
        name: Its name.
        short: Its name where there is little room.
        unit: The unit; empty for counts and for what is no number.
        counted: What it counts, in the singular.
    """

    key: str
    name: str
    short: str
    unit: str = ""
    counted: str = ""

    @property
    def within(self) -> str:
        """The name as it is written inside a sentence."""
        return self.name[0].lower() + self.name[1:]

    @property
    def plain(self) -> str:
        """The name without the symbol C_S or C_C, for text in which no index can be written."""
        return re.sub(r" C_[SC]$", "", self.name)

    @property
    def label(self) -> str:
        """The name with its unit as a label in a figure, with indices in TeX (``parse_math``)."""
        return _tex_name(f"{self.name} [{self.unit}]".removesuffix(" []"))

    @property
    def tick(self) -> str:
        """The short name in a figure, with indices in TeX (``parse_math``)."""
        return _tex_name(self.short)

    def words(self, value: Any) -> str:
        """A value in words: ``3 UAVs``, ``failed UAVs lost for good``, ``arrival rate 0.02``."""
        text = value_text(value)
        if self.key in _NO_REPAIR:
            things, otherwise = _NO_REPAIR[self.key]
            return f"failed {things} {f'repaired in {text} slots' if value else otherwise}"
        if self.counted:
            return f"{text} {self.counted}{'' if text == '1' else 's'}"
        return f"{self.within} {text}"

    def cell(self, value: Any) -> str:
        """A value in a table, below the name of the field."""
        if self.key in _NO_REPAIR and value == 0:
            return _NO_REPAIR[self.key][1]
        return value_text(value)

    def comparable(self, values: Sequence[Any]) -> list[Any]:
        """Values that are to be compared: unchanged if all are numbers, otherwise as text."""
        if self.key == "nodes":
            maps = [*dict.fromkeys(map(str, values))]
            return [f"{len(v)} cells (map {maps.index(str(v)) + 1})" for v in values]
        if self.key == ZONE_PADS:
            return [*map(sum_in_words, values)]
        if self.key == "zone":
            return [f"{width} x {height} at ({x}, {y})" for x, y, width, height in values]
        plain = [*map(_single_item, values)]
        is_text = any(isinstance(value, bool | list | tuple | dict) for value in plain)
        if is_text:
            return [*map(value_text, plain)]
        return plain


def sum_in_words(value: Any) -> Any:
    """Several numbers as ``2 + 3``; one number as it is."""
    if isinstance(value, list | tuple):
        return " + ".join(map(str, value))
    return value


def _single_item(value: Any) -> Any:
    """Several equal items as this item, and any other value as it is."""
    if isinstance(value, list | tuple) and value and all(item == value[0] for item in value):
        return value[0]
    return value


# What a mean time of repair of 0 says: there is no repair.
_NO_REPAIR = {
    "failures.uav_repair": ("UAVs", "lost for good"),
    "failures.pad_repair": ("pads", "never repaired"),
    "failures.node_repair": ("nodes", "never repaired"),
}

# The parameters of the paper's Fig. 5; the record of every mission has their values.
_PAPER = (
    Field("uavs", "Number of UAVs", "UAVs", counted="UAV"),
    Field("charge_start", "Charging start capacity C_S", "C_S", "%"),
    Field("charge_complete", "Charging complete capacity C_C", "C_C", "%"),
    Field("initial_data", "Initial data per node", "Initial data", "data units"),
    Field("flying_time", "Flying time", "Flying time", "mission slots"),
)
_OTHERS = (  # that studies vary
    Field("scenario", "Sea", "Sea"),
    Field("pads", "Number of charging pads", "Pads", counted="pad"),
    Field("zone", "Start and charging zone", "Zone"),
    Field("zones", "Further charging zones", "Zones"),
    Field(ZONE_PADS, "Pads of each further zone", "Further pads"),
    Field("nodes", "Sensor nodes", "Nodes"),
    Field("quota", "Communication quota", "Quota", "communication slots"),
    Field("max_slots", "Longest duration of a mission", "Duration", "mission slots"),
    Field("arrival_rate", "Arrival rate", "Arrivals", "data units per node and slot"),
    Field("arrivals.buffer", "Buffer of a node", "Buffer", "packets"),
    Field("charging.order", "Order of the queue for pads", "Order"),
    Field("charging.power", "Power limit of all pads", "Power", "% per slot"),
    Field("failures.uav_rate", "Failure rate of a UAV", "Failures", "per mission slot"),
    Field("failures.uav_repair", "Mean time of a repair", "Repair", "mission slots"),
    Field("failures.pad_rate", "Failure rate of a pad", "Pad failures", "per mission slot"),
    Field("failures.node_rate", "Failure rate of a node", "Node failures", "per mission slot"),
    Field("wind.strength", "Wind", "Wind", "% battery per move"),
    Field("data_sheet.mtbf", "Mean time between failures", "Failures"),
    Field("data_sheet.spares", "Spare UAVs", "Spares", counted="spare UAV"),
)
_KNOWN = {field.key: field for field in (*_PAPER, *_OTHERS)}
PARAMETERS = {field.key: field for field in _PAPER}

# The fields that an operator decides on. All other fields are conditions that a fleet has to meet.
DECISIONS = (
    *("uavs", "pads", "zone", "zones", ZONE_PADS, "forbid_swaps", "altitude"),
    *("flying_time", "charge_start", "charge_complete", "charge_rate"),
    *("fleet", "data_sheet.cruise", "data_sheet.spares"),
)


def field_named(field: str) -> Field:
    """The field of this key; one that nothing is known of is named after it.

    A value of a data sheet has its unit.
    """
    words = field.removeprefix("data_sheet.").replace("_", " ").capitalize()
    if field.startswith("data_sheet."):
        name = words
    else:
        name = field
    return _KNOWN.get(field) or Field(field, name, name)


class Declared(NamedTuple):
    """A field of a scenario, as the model declares it, and its value in a scenario.

    Attributes:
        name: The name, as in ``--set``.
        meaning: What it is, with the symbol of the paper in parentheses.
        unit: Its unit; empty for counts and for what is no number.
        allowed: The values that it may have, in words.
        default: Its value where a scenario does not set it: Section VI-A and Table II.
        value: Its value in the scenario.
    """

    name: str
    meaning: str
    unit: str
    allowed: str
    default: Any
    value: Any


def declared_fields(space: ScenarioSpace) -> list[Declared]:
    """Every field of a scenario, in the order of the model."""
    default = ScenarioSpace.of()
    follows = {}
    if space.units:
        follows = space.data_sheet.fields()
    return [
        Declared(
            name,
            described_field(name).without_unit
            + (", from the data sheet" if name in follows else ""),
            described_field(name).unit,
            _allowed_values(space, name),
            *(single_value(side.plain_value(name)) for side in (default, space)),
        )
        for name in fields_of(ScenarioSpace)
    ]


def described_field(name: str) -> Description:
    """What a field is, with its unit and its symbol, as the model declares it."""
    return description_of(fields_of(ScenarioSpace)[name])


def _allowed_values(space: ScenarioSpace, name: str) -> str:
    """The allowed values in words, such as ``an integer 1..16 or [low, high]``."""
    if name not in (*SAMPLED, "pads"):
        return form_of(fields_of(ScenarioSpace)[name])
    low, high = space.limits(name)
    kind = kind_of(Scenario.model_fields[name])
    return f"{kind} {low:g}..{high:g}" + (" or [low, high]" if name in SAMPLED else "")


def single_value(value: Any) -> Any:
    """A range of one value as this value."""
    is_range = isinstance(value, list) and len(value) == 2
    if is_range and value[0] == value[1]:
        return value[0]
    return value


def node_placing_sentence(space: ScenarioSpace) -> str:
    """How nodes of a file that share cells are placed, in a sentence to be added to others."""
    if merged := space.arrivals.merged:
        return (
            f" The file has {sum(merged)} nodes in {len(merged)} cells; those of one cell are one "
            "node, with their data and rates added."
        )
    if space.moved:
        if len(space.moved) > 1:
            verb = "are"
        else:
            verb = "is"
        return (
            f" Of the {len(space.nodes)} nodes, {len(space.moved)} {verb} in the nearest free "
            "cell, since their own is taken or closed."
        )
    return ""


def field_in_words(space: ScenarioSpace, field: str) -> str:
    """The value of a field in words: ``3``, ``10 to 50`` for a range, ``25 cells`` for nodes."""
    value = value_of_field(space, field)
    if field in RANGES:
        return numbers.format_span(value, "{:g}")
    if field == "nodes":
        return f"{len(value)} cells"
    if field == ZONE_PADS:
        return str(sum_in_words(value)) or "0"
    plain = TypeAdapter(Any).dump_python(value, mode="json")
    if isinstance(plain, list):
        return ", ".join(map(value_text, plain)) or "none"
    is_count = isinstance(plain, int) and not isinstance(plain, bool)
    if is_count:
        return str(plain)
    return value_text(plain)


def value_of_field(space: ScenarioSpace, field: str) -> Any:
    """The value of a field; for ``pads``, the number of pads also if it follows from the zone."""
    value = space.value(field)
    if field == "pads":
        return space.zone_pads[0]
    return value


def value_text(value: object) -> str:
    """A value of a parameter as text: ``12.5``, ``yes``, or ``5–7.5`` for a range."""
    if isinstance(value, dict):  # a type of UAVs
        settings = {key: of_key for key, of_key in value.items() if of_key is not None}
        return " ".join(f"{key} {value_text(of_key)}" for key, of_key in settings.items())
    if isinstance(value, list | tuple):
        if any(isinstance(item, dict) for item in value):
            joint = ", "
        else:
            joint = "–"
        return joint.join(map(value_text, value)) or "none"
    if isinstance(value, bool | np.bool_):
        return numbers.format_truth(value)
    if isinstance(value, str):
        return value
    if value is None:
        return "none"
    return f"{value:g}"


def _tex_name(text: str) -> str:
    return re.sub(r"\bC_[SC]\b", r"$\g<0>$", text)
