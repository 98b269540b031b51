"""The description of the model by the STRESS-DES checklist, with the values of the studies.

All sentences stand in the template ``stress_des.md``, with a heading per section of the checklist;
this module passes numbers and lists to it, and makes a page of the docs:

    description = describe_model(manifest)
    description.sections["4"]

Monks, Currie, Onggo, Robinson, Kunc, Taylor (2019), "Strengthening the reporting of empirical
simulation studies: Introducing the STRESS guidelines", Journal of Simulation 13(1), 55-67.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from dess.analysis import numbers
from dess.analysis.numbers import format_level
from dess.analysis.stats.kinds import LEVEL
from dess.model.events import EVENT_NAMES
from dess.scenario.fields import SAMPLED, fields_of
from dess.scenario.scenario import Scenario, ScenarioSpace
from tests.verification.page import markdown_table

Manifest = Mapping[str, Any]

_TITLE = """# The model by the STRESS-DES checklist

The checklist of Monks and others (2019, *Strengthening the reporting of empirical simulation
studies*, Journal of Simulation 13(1), 55-67). A test writes this page; every number in it is read
from the scenario and the shipped studies."""

_HEADING = re.compile(r"^(?=## )", re.M)


class Description(NamedTuple):
    """The description of a model by the checklist.

    Attributes:
        sections: The sections as Markdown, by their number: ``"1"`` to ``"6"``.
        studies: The studies, the table of item 1.3.
        overview: The order of events in a slot (Section III-C of the paper, item 2.1 of the
            checklist): the names of the steps and what happens in each, then what follows.
        parameters: All input parameters with their values, the table of item 3.3.
    """

    sections: dict[str, str]
    studies: pd.DataFrame
    overview: tuple[list[tuple[str, str]], str, str]
    parameters: pd.DataFrame


def describe_model(manifest: Manifest, others: Sequence[Manifest] = ()) -> Description:
    """Describe the model that studies were run with.

    Args:
        manifest: The manifest of the study whose scenario is the base model.
        others: The manifests of other studies that use the model.
    """
    space = ScenarioSpace.of(**manifest["scenario"])
    x, y, width, height = space.zone
    about = metadata.metadata("dess")
    ranges = {field: getattr(space, field) for field in SAMPLED}
    values = {
        "base": manifest,
        "space": space,
        "m": space.communication_slots,
        "pads": space.charging_pads,
        "zone_x": (x, x + width - 1),
        "zone_y": (y, y + height - 1),
        "drawn": [
            f"{_format_code(field)} {_format_span(ends)}"
            for field, ends in ranges.items()
            if ends[0] < ends[1]
        ],
        "swept": [_format_code(field) for field in _find_swept_fields([manifest, *others])],
        "policies": [_format_code(name) for name in _find_policies([manifest, *others])],
        "events": [_format_code(name) for name in EVENT_NAMES],
        "level": format_level(LEVEL),
        "libraries": [name for name in manifest["libraries"] if name != "python"],
        "licence": about["License-Expression"] or about["License"],
    }
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        trim_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters |= {
        "words": numbers.join_words,
        "code": _format_code,
        "number": _format_number,
        "span": _format_span,
        "counted": _format_count,
    }
    module: Any = environment.get_template("stress_des.md").make_module(values)
    sections = {part[3]: part.strip() for part in _HEADING.split(str(module)) if part.strip()}
    overview = module.steps, module.repeated, module.end
    studies = pd.DataFrame(_describe_study(of_study) for of_study in (manifest, *others))
    return Description(sections, studies, overview, _list_parameters(space))


def _format_code(name: str) -> str:
    return f"`{name}`"


def render_model(manifest: Manifest, others: Sequence[Manifest]) -> str:
    """The page of the docs that describes the model, as Markdown.

    Args:
        manifest: As for ``describe_model``.
        others: As for ``describe_model``.
    """
    model = describe_model(manifest, others)
    steps, repeated, end = model.overview
    lines = [f"- **{name}**: {text}." for name, text in steps]
    lines += [f"- {repeated[0].upper()}{repeated[1:]}.", f"- {end}."]
    parts = [
        _TITLE,
        model.sections["1"],
        _table_of(model.studies),
        model.sections["2"],
        "\n".join(
            ["A mission slot:", "", *lines, f"- {repeated[0].upper()}{repeated[1:]}.", f"- {end}."]
        ),
        model.sections["3"],
        _table_of(model.parameters),
        *(model.sections[number] for number in "456"),
    ]
    return "\n\n".join(parts) + "\n"


def _table_of(frame: pd.DataFrame) -> str:
    return markdown_table([*frame], frame.to_numpy().tolist())


def _describe_study(manifest: Manifest) -> dict[str, str]:
    """A study as a row of the table of item 1.3."""
    study = manifest["study"]
    rules = {"by a stopping rule": study["precision"], "by a selection": study["selection"]}
    design = "one point"
    if study["design"]:
        design = study["design"]["kind"]
    missions = [_format_span([n for counts in manifest["missions"] for n in counts])]
    return {
        "Study": study["name"],
        "Aim": study["description"] or "",
        "Design": design,
        "Design points": _format_number(len(manifest["points"])),
        "Missions per policy and point": ", ".join(missions + [r for r, on in rules.items() if on]),
        "Policies": numbers.join_words(study["policies"]),
    }


def _find_swept_fields(manifests: Iterable[Manifest]) -> dict[str, None]:
    """The fields that studies set, for all of their missions or by design point."""
    return dict.fromkeys(
        field
        for manifest in manifests
        for values in (manifest["study"]["set"], *(p["values"] for p in manifest["points"]))
        for field in values
    )


def _find_policies(manifests: Iterable[Manifest]) -> dict[str, None]:
    """The policies of all teams of studies."""
    teams = [team for manifest in manifests for team in manifest["study"]["policies"]]
    return dict.fromkeys(name.strip() for team in teams for name in team.split(","))


def _list_parameters(space: ScenarioSpace) -> pd.DataFrame:
    fields = {**fields_of(ScenarioSpace), **fields_of(Scenario)}
    stored = space.model_dump()  # without the sections that are off
    rows = [
        (f"{field}: {about_field.description}", _format_value(space, field))
        for field, about_field in fields.items()
        if field.partition(".")[0] in stored
    ]
    return pd.DataFrame(rows, columns=["Input parameter [unit]", "Value"])


def _format_value(space: ScenarioSpace, field: str) -> str:
    """The value of a field as text."""
    value: Any = space.value(field)
    if field == "pads":
        value = space.zone_pads[0]
    if field == "nodes":
        return _format_cells(value)
    if field == "no_fly":
        return _format_count(len(value), "cell")
    if field == "zones":
        value = [
            f"{[*zone.cells]}, {_format_count(n, 'pad')}"
            for zone, n in zip(value, space.zone_pads[1:], strict=True)
        ]
        return "; ".join(value)
    if field in SAMPLED or field == "initial_data":
        return _format_span(value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    return _format_number(value)


def _format_cells(nodes: Sequence[tuple[int, int]]) -> str:
    """Cells as text; short if they are all combinations of some columns and rows."""
    columns, rows = (sorted({node[axis] for node in nodes}) for axis in (0, 1))
    if len(columns) * len(rows) == len(nodes):
        return f"x in {{{', '.join(map(str, columns))}}}, y in {{{', '.join(map(str, rows))}}}"
    return ", ".join(f"({x}, {y})" for x, y in nodes)


def _format_number(value: float) -> str:
    return f"{value:,.12g}".replace("-", "−")


def _format_span(values: Sequence[float]) -> str:
    """The smallest and the largest value as text: ``70 to 80``, or ``80`` if they are equal."""
    return " to ".join(dict.fromkeys(map(_format_number, (min(values), max(values)))))


def _format_count(number: int, name: str) -> str:
    return f"{_format_number(number)} {name}{'' if number == 1 else 's'}"
