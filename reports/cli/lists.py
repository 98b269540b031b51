"""``dess policies``, ``dess scenarios`` and ``dess studies``: lists, and ``show`` for one name."""

import json
import sys
from pathlib import Path
from textwrap import wrap
from typing import Annotated, Any

import typer

from dess.base.errors import InputError, cut
from dess.base.files.writing import fill
from dess.reports.cli import console, options
from dess.reports.cli.mission_files import FIGURES, save_figure
from dess.reports.cli.options import JsonOption, SetOption, add_command, load_space

policies = typer.Typer(invoke_without_command=True, help="List the policies, or show one.")
scenarios = typer.Typer(
    invoke_without_command=True,
    help="List the shipped scenarios and the families of generated ones, or show one.",
)
studies = typer.Typer(invoke_without_command=True, help="List the shipped studies, or show one.")


@policies.callback()
def list_policies(context: typer.Context) -> None:
    """Print the list, unless one is shown."""
    from dess.policies.registry import describe_policies

    if context.invoked_subcommand is None:
        console.print_list(describe_policies().items())


@add_command(policies, "show")
def show_policy(
    name: Annotated[
        str,
        typer.Argument(metavar="NAME|DIR|FILE.py:CLASS", autocompletion=options.complete_policies),
    ],
    as_json: JsonOption = False,
) -> None:
    """Show a policy: its origin, the scenarios that it can simulate, its card.

    Args:
        name: A policy, by name, folder of a training or file.
    """
    from dess.policies.registry import describe_policy

    (name,) = options.use_current_names([name]) or []
    about = describe_policy(name, run_files=True)
    if as_json:
        print(json.dumps(about._asdict(), indent=2))
        return
    any_place = "any scenario" if not about.requires else f"only {_print_settings(about.requires)}"
    console.print_text(f"{about.name}: {about.origin} ({about.code})")
    console.print_text(
        f"scenarios: {any_place}; of the shipped ones {', '.join(about.scenarios) or 'none'}"
    )
    if about.trained_on:
        console.print_text(f"trained on: {_print_settings(about.trained_on)}")
    console.print_text(f"\n{about.card.strip()}")


@scenarios.callback()
def list_scenarios(context: typer.Context) -> None:
    """Print the list, unless one is shown."""
    from dess.scenario.scenario import scenario_description, scenario_families, scenario_names

    if context.invoked_subcommand is None:
        shipped = [(name, scenario_description(name)) for name in scenario_names()]
        console.print_list([*shipped, *scenario_families().items()])


@add_command(scenarios, "show")
def show_scenario(
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE", autocompletion=options.complete_scenarios)
    ],
    settings: SetOption = None,
    everything: Annotated[bool, typer.Option("--all")] = False,
    figure: Annotated[Path | None, typer.Option(metavar="FILE.png")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show every field of a scenario: its value and what it is.

    Args:
        name: A shipped scenario, a generated one such as archipelago:7, or a TOML file.
        everything: Show the defaults and what is allowed as well, in full.
        figure: Draw the map of the sea into this file, also if its nodes or zones are refused.
    """
    from dess.analysis.names import declared_fields
    from dess.analysis.sheet import sheet_facts, sheet_lines, small_zone_sentences
    from dess.analysis.weather import weather_facts, weather_lines
    from dess.scenario.consistency import distance_error, distance_sentence
    from dess.scenario.scenario import draft_scenario, scenario_description

    console.check_ending("--figure", figure, FIGURES, "a picture")
    if figure:
        from dess.analysis.figures.missions import sea_figure

        with console.open_outputs([figure]) as [temporary]:
            sea = draft_scenario(name, **dict(map(options.parse_setting, settings or [])))
            save_figure(sea_figure(sea), temporary, figure.suffix[1:])
    space = load_space(name, settings)
    description = scenario_description(name)
    notes = small_zone_sentences([space])
    if as_json:
        rows = [field._asdict() for field in declared_fields(space)]
        shown: dict[str, Any] = {"scenario": name, "description": description, "fields": rows}
        if space.units:
            shown["units"] = space.units._asdict()
            shown["follows"] = sheet_facts(space)
        if space.weather.is_on:
            shown["weather"] = weather_facts(space)
        if space.centre:
            shown["distance_error"] = distance_error(space)
        if notes:
            shown["notes"] = notes
        print(json.dumps(shown, indent=2))
        return
    if description:
        console.print_text(description)
    if space.units:
        console.print_text(str(space.units))
        for line in sheet_lines(space):
            console.print_text(line)
    if space.weather.is_on:
        for line in weather_lines(space):
            console.print_text(line)
    if space.centre:
        console.print_text(distance_sentence(space))
    for note in notes:
        console.print_text(note)
    if everything:
        for f in declared_fields(space):
            default = "no default"
            if f.default is not None:
                default = f"default {_format_value(f.default)}"
            console.print_text(f"{f.name} = {_format_value(f.value)} {f.unit}".rstrip())
            console.print_text(f"    {f.meaning}; {default}; allowed: {f.allowed}")
        return
    heads = ["field", "value", "unit", "meaning"]
    rows_ = [
        [f.name, cut(_format_value(f.value), 20), f.unit, f.meaning] for f in declared_fields(space)
    ]
    columns = [*zip(*rows_, strict=True)][:-1]
    rest = console.WIDTH - sum(max(map(len, column)) + 2 for column in columns)
    lines = []
    for *cells, meaning in rows_:
        for line in wrap(meaning, rest):
            lines.append([*cells, line])
            cells = [""] * len(cells)
    console.print_table(heads, lines, left=len(heads))


@add_command(scenarios, "new")
def new_scenario(
    path: Annotated[Path, typer.Argument(metavar="FILE.toml")],
    nodes: Annotated[Path, typer.Option(metavar="FILE")],
    answers: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE")] = None,
) -> None:
    """Write a scenario with a data sheet, and draw its sea; asks for what is missing.

    Args:
        path: The file to write; the picture of the sea is written beside it.
        nodes: The sensor nodes: a CSV or GeoJSON file in the folder of the scenario.
        answers: An answer, such as endurance="35 min"; repeatable.
    """
    from dess.analysis.figures.missions import sea_figure
    from dess.analysis.names import node_placing_sentence
    from dess.analysis.sheet import reach_sentences
    from dess.scenario.new_sea import NewScenario
    from dess.scenario.scenario import DRAFT, parsed_scenario

    console.check_ending("FILE.toml", path, (".toml",), "a scenario")
    if path.exists():
        raise InputError(path, "exists", "the name of a new file")
    if nodes.absolute().parent != path.absolute().parent:
        raise InputError("--nodes", f"{nodes} is in another folder", f"a file beside {path}")
    parts = (answer.partition("=") for answer in answers or [])
    typed_answers = {key.strip(): value.strip() for key, _, value in parts}
    new = NewScenario(nodes)
    console.ask_questions(typed_answers, new.questions(typed_answers), new.check)
    text = new.text()
    draft = parsed_scenario(text, path, DRAFT)
    on_land = len({*draft.nodes} & {*draft.no_fly})
    if on_land:
        text = new.text(place="nearest")
        draft = parsed_scenario(text, path, DRAFT)
    picture = path.with_suffix(".png")
    with console.open_outputs([path, picture]) as [file, drawing]:
        fill(file, text)
        save_figure(sea_figure(draft), drawing, "png")
    if on_land:
        console.print_text(
            f"note: no-fly cells have nodes.{node_placing_sentence(draft)}", sys.stderr
        )
    try:
        space = parsed_scenario(text, path)
    except InputError as error:
        raise error.within(f"{path} is written, but cannot be simulated") from None
    console.print_text(f"{path}, {picture}: {space.units}")
    for line in reach_sentences(space):
        console.print_text(line)


@studies.callback()
def list_studies(context: typer.Context) -> None:
    """Print the list, unless one is shown."""
    from dess.analysis.study.files import study_descriptions

    if context.invoked_subcommand is None:
        console.print_list(study_descriptions().items())


@add_command(studies, "show")
def show_study(
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE", autocompletion=options.complete_studies)
    ],
    as_json: JsonOption = False,
) -> None:
    """Show a study: every field, as its file would set it.

    Args:
        name: A study or a TOML file.
    """
    import tomli_w

    from dess.analysis.study.files import load_study

    data = load_study(name).model_dump(mode="json", exclude_none=True)
    if as_json:
        print(json.dumps(data, indent=2))
    else:
        print(tomli_w.dumps(data).strip())


def _print_settings(values: dict[str, Any]) -> str:
    return ", ".join(f"{field}={_format_value(value)}" for field, value in values.items())


def _format_value(value: Any) -> str:
    """A value as TOML has it; of a long list its length."""
    if isinstance(value, list) and len(value) > 4:
        return f"{len(value)} of them"
    if value is None:
        return ""
    return json.dumps(value)
