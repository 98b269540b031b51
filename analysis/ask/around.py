"""What-ifs around a cheapest fleet: one more UAV or pad.

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
from dess.analysis.facts import Fact
from dess.analysis.metrics import COST
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


def question_around(results: Results, scenario: str, missions: int = FIRST) -> Question | None:
    """The question of what changes if the cheapest fleet changes a little.

    A fleet for several conditions is asked about under the last of them.

    Args:
        results: A study that searches for the cheapest setting.
        scenario: The scenario of the study, with the path of its file.
        missions: Number of missions of every change. By default as many as a sweep begins with, so
            that those of settings that it has are there.

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
            load_scenario(scenario, **fixed | values | change)
        except InputError:  # such as more pads than the zone has cells
            continue
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
    if not manifest.study.years:
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
    if space.weather.is_on:
        yield {"data_sheet.spares": space.data_sheet.spares + 1}


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
    words = ["the fleet", *(change_in_words(space, change) for change in changes)]
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
    metrics = [requirement.metric for requirement in requirements]
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
    caption = (
        f"The fleet of {fleet}, and one more of it: means, and in brackets changes on the same "
        f"{replications}, with {INTERVALS}. Whether requirements are met is what the "
        "search has shown; of a fleet that it did not have, they are met or missed if the whole "
        "interval of each mean says so, otherwise open"
    )
    if refused:
        refused_in_words = [change_in_words(space, change) for change in refused]
        caption += f". Cannot be simulated here: {'; '.join(refused_in_words)}"
    return Table(cells, caption, data)


def one_more_facts(results: Results) -> list[Fact]:
    """What one more UAV costs and brings; nothing if ``question_around`` does not know it.

    It flies all day: a spare that stands until another is lost is not simulated.

    Args:
        results: The study.
    """
    if not is_known(results):
        return []
    changed_results = load_around(results)
    changes = list_changes(changed_results)
    with_one_more = [point for point, change in enumerate(changes, 1) if "uavs" in change]
    if not with_one_more:
        return []
    costs = priced_settings(changed_results).set_index("point")[COST]
    more = numbers.format_money(costs[with_one_more[0]] - costs[0], results.prices.unit)
    metric = search_of(results).best.tightest_first[0].metric
    differences = compare(
        changed_results.missions, 0, [metric.column], correction=None, of="point"
    ).set_index("point")
    row = differences.loc[with_one_more[0], ["difference", "low", "high"]]
    change = metric.change(*row)
    if metric.in_percent:
        change = f"{change} points"
    return [Fact("one more UAV", f"+{more}; {metric.within} {change}")]


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
    if field == "pads":
        return pads_in_words(len(space.zone_pads), 1, value)
    if field == "data_sheet.spares":
        return numbers.format_count(value, "spare UAV")
    return field_named(field).words(value)
