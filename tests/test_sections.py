"""No section of a scenario is overlooked: guard, planner and bound handle it or refuse it.

A section that ``SECTIONS`` of this module does not list fails, and so does a row that does not hold
(``docs/how-to/rule.md``).
"""

import ast
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, get_args

import pytest

import dess
from dess import InputError, policies
from dess.analysis import bound
from dess.model import guard
from dess.model.state import constants_of, types_of
from dess.physics.section import Section
from dess.policies import planner
from dess.scenario import fields
from dess.scenario.scenario import ScenarioSpace

# How a part of the code treats a section that it does not handle.
REFUSED = "refused: a scenario with the section is an input error"
WITHOUT_EFFECT = "without effect: the part reads nothing that the section changes"
LEFT_TO_GUARD = "left to the guard, which has the last word on what the part decides"
WORDS = (REFUSED, WITHOUT_EFFECT, LEFT_TO_GUARD)


class Row(NamedTuple):
    """A section, and how it is treated.

    Attributes:
        settings: Settings with which the section is on.
        guard, planner, bound: What the source of the part reads of the section if it handles it: a
            field of a record that the section changes, or a function of the section's module.
            Otherwise one of ``WORDS``.
        others: What a scenario with the section needs besides.
    """

    settings: Any
    guard: str
    planner: str
    bound: str
    others: Mapping[str, Any] = MappingProxyType({})


SHEET = {
    **{"endurance": "50 min", "cruise": "15 m/s", "charging": "5 min"},
    **{"bandwidth": "1 MHz", "snr": "12 dB at 2 km", "data_rate": "3 MB/h"},
}

FAST = {"max_speed": "23 m/s"}
WEATHER = {"file": "era5-40.0N-72.5W-1990-2020.parquet"}

SECTIONS = {
    "arrivals": Row({"rates": [0.5] * 25}, "arrival_rate", "arrival_rate", REFUSED),
    "age": Row({"measured": True, "reward": -1.0}, WITHOUT_EFFECT, WITHOUT_EFFECT, REFUSED),
    "charging": Row({"power": 7}, "power", LEFT_TO_GUARD, REFUSED),
    "radio": Row({"range": 1000.0}, "has_limit", "has_limit", REFUSED),
    "failures": Row({"pad_rate": 0.1}, "working_pads", "working_pads", REFUSED),
    "wind": Row({"strength": 0.5}, "max_slot_cost", "has_costs", REFUSED),
    "consumption": Row({"slots": [[900] * 5]}, "max_slot_cost", "has_costs", REFUSED),
    "fleet": Row([{"slots_per_cell": 2}], "slots_per_cell", "slots_per_cell", REFUSED),
    "data_sheet": Row(SHEET, WITHOUT_EFFECT, WITHOUT_EFFECT, REFUSED),
    "weather": Row(WEATHER, REFUSED, REFUSED, REFUSED, {"data_sheet": SHEET | FAST}),
    "landing": Row(True, "lands", "lands", REFUSED),
}

PARTS: dict[str, Any] = {"guard": guard, "planner": planner, "bound": bound}
REFUSALS: dict[str, Callable[[ScenarioSpace], Any]] = {
    "guard": lambda scenario: dess.simulate(scenario, policies.load("greedy")),
    "planner": lambda scenario: dess.simulate(scenario, policies.load("planner-short")),
    "bound": bound.check_scenario,
}


def names_in(package: Any) -> set[str]:
    """The names and attributes that the code of a package reads; not its comments and texts."""
    names = set()
    for node in nodes_in(package):
        if isinstance(node, ast.Name):
            names.add(node.id)
        if isinstance(node, ast.Attribute):
            names.add(node.attr)
    return names


def imports_in(package: Any) -> set[str]:
    """The modules from which the code of a package imports, and what it imports from them."""
    imports = set()
    for node in nodes_in(package):
        if isinstance(node, ast.ImportFrom):
            imports |= {str(node.module)} | {f"{node.module}.{name.name}" for name in node.names}
    return imports


def nodes_in(package: Any) -> Iterator[ast.AST]:
    """The syntax trees of the modules of a package, node by node."""
    for path in Path(package.__file__).parent.glob("*.py"):
        yield from ast.walk(ast.parse(path.read_text("utf-8")))


def changed_fields(section: str) -> set[str]:
    """The fields of ``MISSION`` and ``UAV`` to which a section gives other values."""
    scenario = ScenarioSpace.of(**{section: SECTIONS[section].settings})
    off = {section: fields.Fields.model_fields[section].default}
    without = ScenarioSpace.model_validate(dict(scenario) | off)
    changed = set()
    for make_records in (constants_of, types_of):
        record, other = make_records(scenario)[0], make_records(without)[0]
        common = {*record.dtype.names} & {*other.dtype.names}
        changed |= {name for name in common if (record[name] != other[name]).any()}
    return changed


def functions_of(section: str) -> set[str]:
    """The functions of the module of a section, if it has one of its name."""
    name = f"dess.physics.{section}"
    if find_spec(name) is None:
        return set()
    values = vars(import_module(name)).items()
    return {key for key, value in values if getattr(value, "__module__", "") == name}


def is_section(annotation: Any) -> bool:
    """Whether a field of a scenario is a section, or a tuple of them."""
    kinds = (annotation, *get_args(annotation))
    return any(isinstance(kind, type) and issubclass(kind, Section) for kind in kinds)


def test_every_section_of_a_scenario_is_listed():
    of_fields = fields.Fields.model_fields.items()
    sections = {name for name, field in of_fields if is_section(field.annotation)}
    assert {*fields.SECTIONS} == sections, "what is not in fields.SECTIONS is taken for the paper's"
    assert {*SECTIONS} == sections | {fields.LANDING}


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("section", SECTIONS)
def test_a_section_is_treated_as_its_row_says(section, part):
    row = SECTIONS[section]
    treatment = getattr(row, part)
    if treatment == REFUSED:
        scenario = ScenarioSpace.of(**{section: row.settings}, **row.others)
        with pytest.raises(InputError):
            REFUSALS[part](scenario)
    elif treatment == WITHOUT_EFFECT:
        assert not changed_fields(section) & names_in(PARTS[part])
        assert f"dess.physics.{section}" not in imports_in(PARTS[part])
    elif treatment == LEFT_TO_GUARD:
        assert "guard" in names_in(PARTS[part])
        assert row.guard not in WORDS
    else:
        assert treatment in names_in(PARTS[part])
        assert treatment in changed_fields(section) | functions_of(section)
