"""What-ifs around a cheapest fleet: one more UAV or pad, and what breaks its requirements first.

question = around(results)  # of a search for the cheapest setting, with a data sheet
found = question.ask()
table(found), sentence(found)
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers import costs, settings
from dess.analysis.ask.question import LONGEST, Question
from dess.analysis.metrics import COST, SUCCESS, metric_of
from dess.analysis.names import parameter
from dess.analysis.results.chunks import MANIFEST, short_hash
from dess.analysis.results.tables import Results, load_results
from dess.analysis.study.study import study_from
from dess.analysis.tables import INTERVALS, Table, counts
from dess.files.reading import paths_in
from dess.policies.registry import is_path
from dess.scenario import ScenarioSpace, load_scenario
from dess.sections.data_sheet import DataSheet, times

FACTOR = 2  # harder conditions have twice the wind, the failures and the data
WIND, HOURS = 0.5, 100  # without any: the wind as a share of the cruising speed; between failures
FLEET = ("uavs", "pads")
SHEET = "data_sheet."
KEPT, OPEN, BROKEN = "kept", "open", "broken"


def around(results: Results, missions: int = 300) -> Question | None:
    """The question of what changes if the cheapest fleet or its conditions change a little.

    A fleet for several conditions is asked about under the last of them.

    Args:
        results: A study that searches for the cheapest setting.
        missions: Number of missions of every change.

    Returns:
        The question, a design point for the fleet and one for every change of it. None without a
        data sheet, or if no fleet is known to meet the requirements, or its policy is a file.
    """
    point, manifest = _selected(results), results.store.manifest
    if point is None:
        return None
    fixed, values = manifest.study.set, manifest.points[point].values
    scenario, base = manifest.study.scenario, fixed | values
    changes = [c for c in _changes(results.scenario(point)) if _is_valid(scenario, base | c)]
    varied = {*values, *(field for change in changes for field in change)}
    start = {field: value for field, value in base.items() if field in varied}
    data = manifest.study.model_dump(mode="json", exclude_none=True, exclude={"selection"})
    out = _place(results, point)
    data |= {
        "name": out.name,
        "description": "a fleet, and what changes if it or its conditions change a little",
        "set": {field: value for field, value in fixed.items() if field not in varied},
        "design": {"kind": "table", "rows": [start, *(start | change for change in changes)]},
        "policies": [costs.best_policy(results)],
        "missions": missions,
    }
    return Question(study_from(data, "question"), out)


def is_known(results: Results) -> bool:
    """Whether ``around`` was asked."""
    point = _selected(results)
    return point is not None and bool(paths_in(_place(results, point), MANIFEST))


def known(results: Results) -> Results:
    """The answer to ``around``, which ``is_known``."""
    point = _selected(results)
    assert point is not None
    return load_results(_place(results, point))


def _selected(results: Results) -> int | None:
    """The design point of the cheapest fleet, which can be asked about."""
    policy = costs.best_policy(results)
    choice = results.cheapest(policy)
    points = choice.answers[-1].points if choice else ()
    can_ask = points and results.scenario(points[-1]).units and not is_path(policy)
    return points[-1] if can_ask else None


def _place(results: Results, point: int) -> Path:
    """The results folder of the question, beside that of the study."""
    about = f"{results.store.manifest.key} {costs.best_policy(results)} {point}"
    name = f"{results.store.manifest.study.name[:LONGEST]}-around-{short_hash(about.encode())}"
    return results.store.folder.parent / name


def _changes(space: ScenarioSpace) -> Iterator[dict[str, Any]]:
    """What is changed, one after the other: the fleet, then its conditions."""
    values = {"uavs": space.uavs[1], "pads": space.zone_pads[0]}
    for field, value in values.items():
        if value < space.limits(field)[1]:
            yield {field: value + 1}
    for field, value in _harder(space.data_sheet):
        yield {f"{SHEET}{field}": value}


def _harder(sheet: DataSheet) -> Iterator[tuple[str, Any]]:
    """The fields of a data sheet that make a mission harder."""
    if sheet.wind:
        yield "wind", times(sheet.wind, FACTOR)
    else:
        yield "wind", f"{times(sheet.cruise or '', WIND)} from W"
    yield "mtbf", times(sheet.mtbf, 1 / FACTOR) if sheet.mtbf else f"{HOURS} h"
    rate = sheet.data_rate or ""
    doubled = [times(of, FACTOR) for of in ([rate] if isinstance(rate, str) else rate)]
    yield "data_rate", doubled[0] if isinstance(rate, str) else doubled


def _is_valid(scenario: str, values: dict[str, Any]) -> bool:
    """Whether there is such a scenario; UAVs cannot fly against any wind."""
    try:
        load_scenario(scenario, **values)
    except InputError:
        return False
    return True


def _words(results: Results) -> Iterator[tuple[str, str]]:
    """The fields that are changed, each with its change in words; the fleet as it is first."""
    first, *rows = [point.values for point in results.store.manifest.points]
    yield "", costs.fleets(results)[0]
    for row in rows:
        ((field, value),) = [(f, v) for f, v in row.items() if v != first.get(f)]
        name = parameter(field)
        text = name.words(value) if isinstance(value, str | int) else f"{name.within} doubled"
        yield field, text + f" instead of {first.get(field)}" * (field in FLEET)


def found(results: Results, required: Mapping[str, float]) -> pd.DataFrame:
    """The means of the fleet and of every change.

    Args:
        results: The answer to ``around``.
        required: The requirements by metric, as ``costs.required``.

    Returns:
        A row per change in the order of the question: the ``field`` that is changed, the change
        in ``words``, ``point``, the metrics and the ``cost`` with their intervals, ``lead`` (the
        smallest over the requirements), and ``requirements``: whether they are ``kept`` or
        ``broken`` by the whole intervals.
    """
    rows = costs.priced(results).sort_values("point", ignore_index=True)
    leads = {
        end: np.min([costs.lead(rows[f"{m}{end}"], m, q) for m, q in required.items()], axis=0)
        for end in ("", "_low", "_high")
    }
    worst, best = (function(leads["_low"], leads["_high"]) for function in (np.minimum, np.maximum))
    verdicts = np.where(worst >= 0, KEPT, np.where(best < 0, BROKEN, OPEN))
    rows[["field", "words"]] = [*_words(results)]
    return rows.assign(lead=leads[""], requirements=verdicts)


def table(results: Results, required: Mapping[str, float]) -> Table:
    """The changes with their means, and the paired differences from the fleet as it is."""
    rows, metrics = found(results, required), [*dict.fromkeys([SUCCESS, *required])]
    against = settings.against(results, 0, metrics).set_index(["metric", "point"])
    cells = pd.DataFrame({"What if": rows["words"]})
    for of in map(metric_of, metrics):
        ends = rows[[of.column, f"{of.column}_low", f"{of.column}_high"]].to_numpy()
        texts = [of.written(*row) for row in ends]
        for point in rows["point"][1:]:
            change = against.loc[(of.column, point), ["difference", "low", "high"]]
            texts[point] += f" ({of.change(*change)})"
        cells[of.name] = texts
    currency = results.manifest["study"]["costs"]["currency"]
    cells[f"Cost [{currency}]"] = rows[COST].map("{:,.0f}".format)
    cells["Requirements"] = rows["requirements"]
    cells["Missions"] = counts(rows["n"])
    caption = (
        f"The fleet, one more of it, and harder conditions: means with {INTERVALS}, and the "
        "differences from the first row on the same missions [points of shares]"
    )
    return Table(cells, caption, rows)


def sentence(results: Results, required: Mapping[str, float]) -> str:
    """Which change breaks the requirements first, in a sentence."""
    rows = found(results, required)
    worst = rows.loc[rows["lead"][rows["field"].str.startswith(SHEET)].idxmin()]
    of = [f"{m.within} {m.write(worst[m.column])}" for m in map(metric_of, required)]
    told_so = {KEPT: "keeps the requirements", BROKEN: "breaks them", OPEN: "may break them"}
    what = told_so[worst["requirements"]]
    return f"The hardest change is {worst['words']}: it {what} ({numbers.words(of)})."
