"""What-ifs around a cheapest fleet: one more UAV or pad; of years also other hours and speeds.

question = question_around(results, "my-sea.toml")  # results of a search for the cheapest setting
question.ask()
table_around(results)
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import priced_settings, setting_cells
from dess.analysis.answers.fleet.requirements import (
    least_spare,
    metric_asked_for,
    requirements_of,
)
from dess.analysis.answers.fleet.verdicts import judge_settings
from dess.analysis.answers.settings.points import (
    conditions_in_words,
    fleets_in_words,
    has_conditions,
    pads_in_words,
)
from dess.analysis.ask.question import FIRST, LONGEST, Question
from dess.analysis.facts import Fact, known_facts
from dess.analysis.figures import Drawing
from dess.analysis.metrics import AGE, COST, Metric, column_in_sheet_unit
from dess.analysis.names import field_named
from dess.analysis.results.chunks import MANIFEST, short_hash
from dess.analysis.results.tables import Results, load_results
from dess.analysis.stats.differences import compare
from dess.analysis.stats.requirement import Requirement
from dess.analysis.stats.verdict import Verdict
from dess.analysis.study.study import study_from
from dess.analysis.tables import INTERVALS, Table
from dess.policies.registry import is_path
from dess.scenario.scenario import ScenarioSpace, load_scenario
from dess.scenario.weather import ALWAYS
from dess.scenario.weather.hours import HourState, hours_of

FLEET = "the fleet"  # as it is, in tables and figures of its changes
_ADDED = {"uavs": "one more UAV", "data_sheet.spares": "one more spare UAV"}
_OPERATING, _LIMITS, _CALM = "weather.operating", "weather.limits", "weather.calm"
_CRUISE = "data_sheet.cruise"
YEARS = 4  # of every change at most: differences on the same years settle in a few
_SPEEDS = (0.8, 1.25)  # slower and faster, as multiples of the cruising speed


def question_around(results: Results, scenario: str, missions: int = FIRST) -> Question | None:
    """The question of what changes if the cheapest fleet changes a little.

    A fleet for several conditions is asked about under the last of them.

    Args:
        results: A study that searches for the cheapest setting.
        scenario: The scenario of the study, with the path of its file.
        missions: Number of missions of every change. By default as many as a sweep begins with, so
            that those of settings that it has are there. Of years at most ``YEARS`` are asked for.

    Returns:
        The question, a design point for the fleet and one for every change of it. None without a
        data sheet, or if no fleet is known to meet the requirements, or its policy is a file.
    """
    best = search_of(results).best
    manifest = results.store.manifest
    points = best.points
    if manifest.processes or not points or is_path(best.policy):
        return None
    if not results.scenario(points[-1]).units:
        return None
    fixed = manifest.study.set
    values = manifest.points[points[-1]].values
    changes = []
    for change in _changed_fields(results.scenario(points[-1])):
        try:
            changed = load_scenario(scenario, **fixed | values | change)
        except InputError:  # such as more pads than the zone has cells
            continue
        if not changed.weather.is_on or (hours_of(changed).state == HourState.OPEN).any():
            changes.append(change)
    varied = {*values, *(field for change in changes for field in change)}
    start = {field: value for field, value in (fixed | values).items() if field in varied}
    data = manifest.study.model_dump(
        mode="json", exclude_none=True, exclude={"selection", "missions"}
    )
    data |= {
        "name": _place_of_question(results).name,
        "scenario": scenario,
        "description": "a fleet, and what changes if it changes a little",
        "set": {field: value for field, value in fixed.items() if field not in varied},
        "design": {"kind": "table", "rows": [start, *(start | change for change in changes)]},
        "policies": [best.policy],
    }
    if manifest.study.years:
        data["years"] = min(manifest.study.years, YEARS)
    else:
        data["missions"] = missions
    return Question(study_from(data, "question"), _place_of_question(results))


def is_known(results: Results) -> bool:
    """Whether ``question_around`` was asked."""
    return (_place_of_question(results) / MANIFEST).exists()


def load_around(results: Results) -> Results:
    """The results of ``question_around``: the fleet at design point 0, then every change of it."""
    return load_results(_place_of_question(results))


def list_changes(changed_results: Results) -> list[dict[str, Any]]:
    """What is changed at the design points of ``load_around`` from 1 on: a field and its value."""
    start, *rows = [point.values for point in changed_results.store.manifest.points]
    return [
        {field: value for field, value in row.items() if value != start.get(field)} for row in rows
    ]


def _place_of_question(results: Results) -> Path:
    """The results folder of the question, beside that of the study."""
    about = f"{results.store.manifest.key} {search_of(results).best.policy}"
    name = f"{results.store.manifest.study.name[:LONGEST]}-one-more-{short_hash(about.encode())}"
    return results.store.folder.parent / name


def _changed_fields(space: ScenarioSpace) -> Iterator[dict[str, Any]]:
    """What is changed, one after the other."""
    yield {"uavs": space.uavs[1] + 1}
    yield {"pads": space.zone_pads[0] + 1}
    if not space.weather.is_on:
        return
    yield {"data_sheet.spares": space.data_sheet.spares + 1}
    if space.weather.operating != ALWAYS:
        yield {_OPERATING: ALWAYS}
    if not space.weather.calm:
        yield {_CALM: True}
    for name in space.weather.limits:
        yield {_LIMITS: {kept: v for kept, v in space.weather.limits.items() if kept != name}}
    cruise = space.data_sheet.number("cruise")
    for speed in sorted({round(cruise * times) for times in _SPEEDS} - {cruise}):
        yield {_CRUISE: f"{speed} m/s"}


def table_around(results: Results) -> Table:
    """The fleet, then every change with its means, that with the least lead first.

    Args:
        results: The study that ``question_around`` was asked about.
    """
    changed_results = load_around(results)
    requirements = requirements_of(results)
    changes = list_changes(changed_results)
    space = changed_results.scenario(0)
    of_search = _verdicts_of_search(results)
    words = [FLEET, *(change_in_words(space, change) for change in changes)]
    refused = [change for change in _changed_fields(space) if change not in changes]
    data = priced_settings(changed_results)
    scenarios = [changed_results.scenario(point) for point in data["point"]]
    data = data.assign(
        change=[words[point] for point in data["point"]],
        lead=least_spare(data, requirements),
        verdict=[
            of_search.get(scenario) or _verdict_on_row(row, requirements)
            for scenario, (_, row) in zip(scenarios, data.iterrows(), strict=True)
        ],
    )
    data = data.iloc[np.lexsort((data["lead"], data["point"] > 0))].reset_index(drop=True)
    metrics = _compared_metrics(results)
    columns = [metric.column for metric in metrics]
    cells = setting_cells(data.assign(condition="", fleet=data["change"]), metrics)
    cells = cells.drop(columns="Policy").rename(columns={"Fleet": "What if"})
    cells = cells.rename(columns={"Cost": f"Cost [{results.prices.unit}]"})
    differences = compare(changed_results.missions, 0, columns, correction=None, of="point")
    differences = differences.set_index(["metric", "point"])[["difference", "low", "high"]]
    for metric in metrics:
        of_changes = differences.loc[metric.column].loc[data["point"][1:]].to_numpy()
        means = data[metric.column][1:]
        cells.loc[1:, metric.name] = [
            f"{metric.write(mean)} ({metric.change(*row)})"
            for mean, row in zip(means, of_changes, strict=True)
        ]
    cells.insert(1, "Requirements", data["verdict"].astype(str))
    fleet = fleets_in_words(changed_results)[0]
    if has_conditions(results):
        condition = conditions_in_words(results)[search_of(results).best.points[-1]]
        fleet += f" under {condition}"
    replications = numbers.format_count(data["n"][0], results.study.replication_name)
    changed = "one more of it"
    if results.study.years:
        changed = "what changes with other fleets, hours and speeds"
    caption = (
        f"The fleet of {fleet}, and {changed}: means, and in brackets changes on the same "
        f"{replications}, with {INTERVALS}. Whether requirements are met is what the "
        "search has shown; of a fleet that it did not have, they are met or missed if the whole "
        "interval of each mean says so, otherwise open"
    )
    if refused:
        refused_in_words = [change_in_words(space, change) for change in refused]
        caption += f". Cannot be simulated here: {'; '.join(refused_in_words)}"
    return Table(cells, caption, data)


def one_more_facts(results: Results) -> list[Fact]:
    """What one more UAV or spare costs and brings, and of years what decides the age of the data.

    Args:
        results: The study.

    Returns:
        The facts; none if ``question_around`` was not asked.
    """
    if not is_known(results):
        return []
    changed_results = load_around(results)
    changes = list_changes(changed_results)
    costs = priced_settings(changed_results).set_index("point")[COST]
    metric = search_of(results).best.tightest_first[0].metric
    differences = compare(
        changed_results.missions, 0, [metric.column], correction=None, of="point"
    ).set_index("point")
    facts = []
    for point, changed in enumerate(changes, 1):
        label = next((_ADDED[field] for field in changed if field in _ADDED), "")
        if not label:
            continue
        more = numbers.format_money(costs[point] - costs[0], results.prices.unit)
        change = metric.change(*differences.loc[point, ["difference", "low", "high"]])
        if metric.in_percent:
            change = f"{change} points"
        facts.append(Fact(label, f"+{more}; {metric.within} {change}"))
    if results.study.years:
        facts.append(_deciding_fact(results))
    return known_facts(facts)


def ages_around(results: Results) -> pd.DataFrame:
    """The age of the data of the fleet in years, and of every change, that with the least first.

    Args:
        results: The study of years that ``question_around`` was asked about.

    Returns:
        A row for the fleet and then for each change: ``change`` in words, the ``mean`` age with
        the ends ``low`` and ``high`` of the interval of its difference from that of the fleet,
        and the ``difference``.
    """
    changed_results = load_around(results)
    age = _age_metric(results).column
    space = changed_results.scenario(0)
    means = changed_results.missions.groupby("point")[age].mean()
    table = compare(changed_results.missions, 0, [age], correction=None, of="point")
    table = table.set_index("point")[["difference", "low", "high"]]
    table[["low", "high"]] += means[0]
    words = [change_in_words(space, change) for change in list_changes(changed_results)]
    table.insert(0, "change", [words[point - 1] for point in table.index])
    table.insert(1, "mean", means[table.index])
    fleet = {"change": FLEET, "mean": means[0], "difference": 0.0}
    first = pd.DataFrame([{**fleet, "low": means[0], "high": means[0]}])
    return pd.concat([first, table.sort_values("mean", kind="stable")], ignore_index=True)


def draw_ages(results: Results) -> Drawing:
    """What decides the age of the data of the cheapest fleet in years: it with each taken away.

    Args:
        results: The study of years that ``question_around`` was asked about.
    """
    from dess.analysis.figures import style

    table = ages_around(results)
    metric = _age_metric(results)
    with style.new_panels(1.3 + 0.42 * len(table), values="x") as (figure, ax):
        ax.axvline(table["mean"][0], **style.ZERO)
        for y, row in enumerate(table.itertuples()):
            colour = style.BETTER if row.high < table["mean"][0] else style.WORSE
            if row.low <= table["mean"][0] <= row.high:
                colour = style.MUTED
            arms = style.error_bar_arms(table.loc[y])
            ax.errorbar(row.mean, y, xerr=arms, **style.dot_style((colour, "o")))
            style.note_at_right(metric.write(float(f"{row.mean:.3g}")), y, ax)
        ax.set_yticks(range(len(table)), table["change"])
        ax.set(xlabel=metric.label, ylim=(len(table) - 0.4, -0.6))
        style.set_axis_unit(ax.xaxis, "", 5)
    years = numbers.format_count(load_around(results).study.years or 0, "year")
    asked = results.study.years or 0
    if asked > YEARS:
        years += f", the first of the {asked} of the search"
    caption = (
        f"The mean age of the data on the same {years}: the fleet, and one change at a time. Blue "
        f"is younger, orange older; bars are {INTERVALS} of the difference"
    )
    alt = "Age of information with each of several changes"
    return Drawing(figure, alt, f"{caption}.", table)


def _deciding_fact(results: Results) -> Fact:
    """By how much the age of the data changes with each change, the largest first."""
    table = ages_around(results)
    metric = _age_metric(results)

    def write(age: float) -> str:
        return metric.write(float(f"{age:.2g}"))

    fleet = table["mean"][0]
    by_size = table[1:].sort_values("difference", key=abs, ascending=False, kind="stable")
    seen = by_size[(by_size["low"] > fleet) | (by_size["high"] < fleet)]
    words = [f"with {row.change} {write(row.mean)}" for row in seen.itertuples()]
    return Fact("what decides the age", f"{write(fleet)}; {', '.join(words)}" if words else "")


def _compared_metrics(results: Results) -> list[Metric]:
    """The metrics by which changes are compared: what is required, and of years the age."""
    metrics = [requirement.metric for requirement in requirements_of(results)]
    age = _age_metric(results)
    if results.study.years and age.column not in [metric.column for metric in metrics]:
        metrics.append(age)
    return metrics


def _age_metric(results: Results) -> Metric:
    """The age of the data, told in the unit of the requirement on it."""
    return metric_asked_for(results, column_in_sheet_unit(AGE, results.missions))


def _verdicts_of_search(results: Results) -> dict[ScenarioSpace, Verdict]:
    """What the search for the cheapest fleet has shown of every scenario, with its policy."""
    rows = judge_settings(results)
    rows = rows[rows["policy"] == search_of(results).best.policy]
    return {
        results.scenario(point): verdict
        for point, verdict in zip(rows["point"], rows["verdict"], strict=True)
    }


def _verdict_on_row(row: pd.Series, requirements: Sequence[Requirement]) -> Verdict:
    """Whether the intervals of a row keep all requirements."""
    return Verdict.of_all(
        requirement.judge(row[f"{requirement.column}_low"], row[f"{requirement.column}_high"])
        for requirement in requirements
    )


def change_in_words(space: ScenarioSpace, change: dict[str, Any]) -> str:
    """A change around a fleet, as ``3 UAVs``."""
    ((field, value),) = change.items()
    if field == _OPERATING:
        return "flights round the clock"
    if field == _CALM:
        return "still air"
    if field == _LIMITS:
        (removed,) = space.weather.limits.keys() - value
        return f"no limit of {removed}"
    if field == "pads":
        return pads_in_words(len(space.zone_pads), 1, value)
    return field_named(field).words(value)
