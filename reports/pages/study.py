"""The page of a study: which sections it has, their sentences, figures and tables."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd
from IPython.display import HTML, Markdown

from dess.analysis import numbers
from dess.analysis.answers import decided
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.requirements import requirements_of
from dess.analysis.answers.missions import map_caption, neglected_sentence, typical_replication
from dess.analysis.answers.policies import comparisons
from dess.analysis.answers.settings.baseline import check_baseline
from dess.analysis.answers.settings.points import (
    fleets_in_words,
    has_conditions,
    metrics_of_page,
    varied_values,
)
from dess.analysis.answers.settings.ranking import rank_settings, ranking_metric
from dess.analysis.answers.settings.years import draw_calendar, setting_with_oldest_data
from dess.analysis.ask import around
from dess.analysis.figures import Drawing
from dess.analysis.figures.missions import map_figure
from dess.analysis.metrics import metric_of
from dess.analysis.names import field_named, value_text
from dess.analysis.results.resimulate import resimulate
from dess.analysis.results.tables import Results
from dess.analysis.study.cheapest import Cheapest
from dess.analysis.study.selection import Selection
from dess.policies.registry import is_path, list_departures
from dess.reports.pages import PREFIX, notebook
from dess.reports.pages.markdown import (
    Marked,
    command_block,
    escape_text,
    fill_markdown,
    format_code,
)
from dess.reports.pages.notebook import Report, cell_tags
from dess.reports.pages.panel import make_panel
from dess.reports.pages.panel_metrics import Search
from dess.scenario.scenario import SEA

_MOST_FIELDS = 3  # the largest number of fields that a title names
_MOST_VALUES = 12  # the largest number of values of a field in a list


def list_simulated(results: Results) -> Marked:
    """What was simulated: scenario, policies, design and missions or years, as a list."""
    manifest = results.store.manifest
    study = manifest.study
    points = len(manifest.points)
    fixed = [
        f"{field_named(field).within} {_format_set_value(value)}"
        for field, value in study.set.items()
    ]
    also = ""
    if fixed:
        also = f", with {numbers.join_words(fixed)}"
    policies = numbers.join_words([format_code(policy) for policy in results.policies])
    missions = numbers.format_span(n for of_policy in manifest.missions for n in of_policy)
    unit = " per policy"
    if points > 1:
        unit += " and design point"
    lines = [
        fill_markdown(
            "- **Scenario:** {scenario}{fixed}.",
            scenario=format_code(study.scenario),
            fixed=also,
        ),
        f"- **Policies:** {policies}.",
        *_describe_design(results),
        f"- **{results.replications_head}:** {missions}{unit}, {len(results.missions):,} in all.",
        list_notes(results),
    ]
    return Marked("\n".join(filter(None, lines)))


def list_notes(results: Results) -> Marked:
    """Which trained policies act outside of their training, as a list."""
    departures = list_departures(results.policies, results.store.manifest.scenarios)
    lines = [fill_markdown("- **Note:** {line}.", line=line) for line in departures]
    return Marked("\n".join(lines))


def page_title(results: Results, varied: Iterable[str]) -> str:
    """The question that a study answers.

    Args:
        results: The study.
        varied: The fields that have several values.
    """
    fields = [field_named(field).within for field in varied]
    if results.study.is_search:
        question = "Which fleet is the cheapest on {}?"
    elif results.design == "saltelli":
        question = "Which parameters matter on {}?"
    elif 0 < len(fields) <= _MOST_FIELDS:
        verb = "is" if len(fields) == 1 else "are"
        question = f"Which {numbers.join_words(fields)} {verb} the best on {{}}?"
    elif fields:
        question = "Which setting is the best on {}?"
    else:
        question = "Which policy is the best on {}?"
    return question.format(_describe_sea(results.study.scenario))


def _describe_sea(scenario: str) -> str:
    """A scenario in words: the paper's sea, or that of its name or file."""
    if scenario == "paper":
        return "the paper's sea"
    return f"the sea {Path(scenario).stem}"


def leading_metric(results: Results, metric: str | None) -> str:
    """The metric that the page is about: of a search for a fleet, that of what decides it.

    Args:
        results: The study.
        metric: The metric that is asked for, if one is.

    Raises:
        InputError: If there is no such metric.
    """
    if metric is None and requirements_of(results):
        return search_of(results).deciding_requirement()[0].column
    return ranking_metric(results, metric)


def shown_metrics(results: Results, by: str) -> list[str]:
    """The metrics that the page shows: of a search those that are required, else the paper's.

    Args:
        results: The study.
        by: The metric that the page is about, which comes first.
    """
    asked = [requirement.column for requirement in requirements_of(results)]
    if asked:
        return [*dict.fromkeys([by, *asked])]
    return metrics_of_page(results, by)


def list_guarantees(results: Results) -> Marked:
    """What is guaranteed about the selections, as a list."""
    rows = decided.selected_settings(results).itertuples()
    lines = [
        fill_markdown("- {name}: {known}", name=row.policy, known=row.guarantee) for row in rows
    ]
    return Marked("\n".join(dict.fromkeys(lines)))


def list_commands(results: Results, missions: pd.DataFrame) -> Marked:
    """The commands that simulate missions again, and the folder that they name.

    Args:
        results: The study.
        missions: Rows of ``worst_missions``.
    """
    return fill_markdown(
        "These commands simulate them again. {folder} stands for the results folder of the study, "
        "wherever it is:\n\n{lines}",
        folder=format_code(results.usual_folder),
        lines=command_block(missions["command"]),
    )


def _describe_design(results: Results) -> Iterator[Marked]:
    """The fields that the design varies, as items of the list."""
    points = len(results.store.manifest.points)
    if fields := varied_values(results):
        line = "- **Design:** {kind}, {points:,} design points. It varies:"
        yield fill_markdown(line, kind=format_code(results.design), points=points)
    for field, values in fields.items():
        unit = f" [{field_named(field).unit}]".removesuffix(" []")
        line = "    - {field}{unit}: {values}"
        yield fill_markdown(
            line, field=field_named(field).within, unit=unit, values=_format_values(values)
        )


def _format_values(values: Sequence[Any]) -> str:
    """The values of a field as text; only the first and the last if there are many."""
    texts = [value_text(value) for value in values]
    if len(texts) <= _MOST_VALUES:
        return ", ".join(texts)
    return f"{len(texts):,} values, {texts[0]} to {texts[-1]}"


def _format_set_value(value: Any) -> str:
    """A value of the study's table ``set`` as text; of a list of cells, only their number."""
    if isinstance(value, list | tuple) and any(isinstance(item, list | tuple) for item in value):
        return f"of {len(value)} cells"
    return value_text(value)


NOTEBOOK = "study"


def make_study_report(results: Results, values: Mapping[str, Any] = MappingProxyType({})) -> Report:
    """The report of a study, with its sections and its title.

    Args:
        results: The study.
        values: Values for the parameters of the notebook, to be checked.

    Raises:
        InputError: If the study has no such metric or baseline.
    """
    ranking_metric(results, values.get("metric"))
    check_baseline(results, values.get("baseline", 0))
    study = results.study
    original = notebook.parse_notebook(NOTEBOOK)
    varied = [*varied_values(results)]
    points = len(results.store.manifest.points)
    where = f"the scenario {study.scenario}"
    if points > 1:
        where = f"{points:,} design points"
    description = study.description or f"{numbers.join_words(results.policies)} at {where}."
    title = page_title(results, varied)
    kept = find_shown_parts(results, varied)
    original.cells = [
        cell for cell in original.cells if all(kept.get(tag, True) for tag in cell_tags(cell))
    ]
    original.cells[0].source = f"# {escape_text(title)}\n\n{escape_text(description)}"
    report = notebook.make_report(f"{PREFIX}{study.name}", original)
    return replace(report, title=title, description=" ".join(description.split()))


def make_panel_of(results: Results, metric: str | None = None) -> HTML | Markdown:
    """The panel of the page of a study, which begins with its best setting.

    Args:
        results: The study.
        metric: The metric that ranks the settings, if it is not that of the study.
    """
    manifest = results.store.manifest
    if manifest.processes:
        return Markdown(f"A page cannot simulate {manifest.functions}, which is Python.")
    policy, point = shown_setting(results, metric)
    shown_search = None
    rule = results.study.selection
    if isinstance(rule, Cheapest):
        search = search_of(results)
        fleet = ""
        if search.best.points:
            fleet = search.best.fleet
        shown_search = Search(
            policy=policy,
            fleet=fleet,
            rule=rule,
        )
    space = results.scenario(point)
    name = manifest.points[point].values.get(SEA, results.study.scenario)
    return make_panel(
        space,
        space,
        name,
        [policy],
        manifest.seed,
        costs=results.study.costs,
        requirements=requirements_of(results),
        varied=varied_values(results),
        given=results.given_values(point),
        search=shown_search,
    )


def shown_setting(results: Results, metric: str | None = None) -> tuple[str, int]:
    """The policy and the design point that the page shows more of: those of the answer.

    Args:
        results: The study.
        metric: The metric that ranks the settings, if it is not that of the study.
    """
    if results.study.is_search:
        search = search_of(results)
        if results.study.years and search.best.points:
            points = search.best.points
            return search.best.policy, setting_with_oldest_data(results, search.best.policy, points)
        return search.best.policy, search.shown_point
    if results.design == "saltelli":
        return results.policies[0], 0
    best = rank_settings(results, ranking_metric(results, metric)).iloc[0]
    return str(best.policy), int(best.point)


def draw_years(results: Results, metric: str | None = None) -> Iterator[Drawing]:
    """The calendar of the years of the answer, and what decides the age of its data if known.

    Args:
        results: A study of years.
        metric: As for ``shown_setting``.
    """
    yield draw_calendar(results, *shown_setting(results, metric))
    if results.study.is_search and around.is_known(results):
        yield around.draw_ages(results)


def draw_typical_mission(results: Results) -> list[Drawing]:
    """The map of a typical mission of the cheapest fleet, with the names of its nodes.

    It is the mission with the median of what decides the search. None is drawn if the policy or a
    process is a Python file, which may be anybody's code.

    Args:
        results: A study that searches for the cheapest fleet.
    """
    search = search_of(results)
    policy = search.best.policy
    if is_path(policy) or results.store.manifest.processes:
        return []
    column = search.deciding_requirement()[0].column
    replication = typical_replication(search.shown_missions, column)
    mission = resimulate(results, policy, search.shown_point, replication)
    fleet = fleets_in_words(results)[search.shown_point]
    alt = "Map of a typical mission of the fleet, with the names of the nodes"
    figure = map_figure(mission.events, mission.scenario)
    median = f"Its {metric_of(column).within} is the median."
    caption = f"{map_caption(mission, fleet)} {median} {neglected_sentence(mission)}"
    return [Drawing(figure, alt, caption)]


def find_shown_parts(results: Results, varied: Sequence[str]) -> dict[str, bool]:
    """For each tag, whether the page of a study has the cells of the notebook with this tag.

    Args:
        results: The study.
        varied: The fields that have several values.
    """
    manifest = results.store.manifest
    study = results.study
    several = len(manifest.points) > 1
    fields = len(varied)
    kind = results.design
    if fields <= 1 and kind not in ("saltelli", "latin-hypercube"):
        kind = "grid"  # it varies one field at most
    is_ranked = kind != "saltelli"
    is_search = study.is_search
    has_missions = not study.years
    is_scan = kind == "grid" or (kind == "table" and fields <= 2)
    return {
        # Several design points with as many missions each: settings to rank.
        "if-settings": several and is_ranked and not is_search,
        # Settings, one or several, with missions enough to rank them.
        "if-ranked": is_ranked,
        # The answer is the best setting.
        "if-answer": is_ranked and not is_search,
        # A single design point: the policies are compared in it.
        "if-one-setting": not several,
        # Fields with several values; such that others are averaged over.
        "if-fields": fields > 0,
        "if-effects": fields > 1 and kind != "one-at-a-time",
        # Combinations of values of one field, of two, of three and more.
        "if-one-field": is_scan and fields == 1,
        "if-two-fields": is_scan and fields == 2,
        "if-many-fields": is_scan and fields > 2,
        "if-one-at-a-time": kind == "one-at-a-time",
        # Design points spread over the space of parameters.
        "if-sampled": kind == "latin-hypercube" or (kind == "table" and fields > 2),
        "if-sensitivity": not is_ranked,
        # Several policies with the same missions, not years, which are compared by the paper's
        # metrics; some of them learned, some not.
        "if-policies": has_missions and comparisons.has_policies_to_compare(results),
        "if-learned": has_missions and comparisons.has_learned_to_compare(results),
        # Tables of the study.
        "if-selection": isinstance(study.selection, Selection),
        "if-cheapest": is_search,
        "if-conditions": is_search and has_conditions(results),
        "if-precision": study.precision is not None,
        "if-costs": study.costs is not None and not is_search,
        "if-priced-search": is_search and results.prices.pays_for_missions,
        # A scenario in units, and what changes a little around the cheapest fleet.
        "if-sheet": all(space.units for space in manifest.scenarios),
        "if-brief": has_missions and is_search and all(space.units for space in manifest.scenarios),
        # Replications are missions, which can be looked at one by one.
        "if-missions": has_missions,
        "if-years": not has_missions,
        "if-around": is_search and around.is_known(results),
    }
