"""Which sections the page of a study has.

The notebook ``study.py`` has sections for every kind of study. A cell tagged ``if-...`` is kept
where the study has what the tag names, with all its tags; ``TAGS`` says what they mean:

    report_of(Path("results/fleets"))
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from analysis import numbers
from analysis.questions import summary
from analysis.questions.settings import varied
from analysis.results.tables import Results, load_results
from analysis.study.cheapest import Cheapest
from analysis.study.selection import Selection
from reports.folders import PREFIX
from reports.pages import html, notebook
from reports.pages.notebook import SHIPPED, Report, tags_of
from reports.pages.study import words

NOTEBOOK = "study"


def report_of(
    folder: Path, values: Mapping[str, Any] = MappingProxyType({}), notebooks: Path = SHIPPED
) -> Report:
    """The report of a results folder, with the sections and the title of its study.

    Args:
        folder: The results folder.
        values: Values for the parameters of the notebook, to be checked.
        notebooks: The folder of the notebooks.

    Raises:
        InputError: If the folder holds no results, or they are incomplete or damaged; if the study
            has no such metric or baseline.
    """
    results = load_results(folder)
    words.metric_of(results, values.get("metric"))
    words.setting(results, values.get("baseline", 0))
    study, original = results.manifest["study"], notebook.parsed(NOTEBOOK, notebooks)
    kept = {tag: has(results) for tag, has in TAGS.items()}
    original.cells = [
        cell for cell in original.cells if all(kept.get(tag, True) for tag in tags_of(cell))
    ]
    points = len(results.store.manifest.points)
    where = f"{points:,} design points" if points > 1 else f"the scenario {study['scenario']}"
    description = study["description"] or f"{numbers.words(results.policies)} at {where}."
    title = words.title(results)
    original.cells[0].source = f"# {html.text(title)}\n\n{html.text(description)}"
    report = notebook.report_of(f"{PREFIX}{study['name']}", original)
    return replace(report, title=title, description=" ".join(description.split()))


def _kind(results: Results) -> str:
    """The kind of the design; a design that varies one field at most is a grid."""
    kind = results.design
    return kind if kind in ("saltelli", "latin-hypercube") or len(varied(results)) > 1 else "grid"


def _is_scan(results: Results, fields: Callable[[int], bool]) -> bool:
    """Whether the design has combinations of values, of a number of fields."""
    count, kind = len(varied(results)), _kind(results)
    return fields(count) and (kind == "grid" or (kind == "table" and count <= 2))


def _has(section: str) -> Callable[[Results], bool]:
    return lambda results: results.manifest["study"][section] is not None


# For each tag, a function that tells whether the page of a study has the cells with this tag.
TAGS: dict[str, Callable[[Results], bool]] = {
    # Several design points whose missions share their replications: settings to rank.
    "if-settings": lambda results: (
        len(results.store.manifest.points) > 1 and _kind(results) != "saltelli"
    ),
    # Settings, one or several, with missions enough to rank them.
    "if-ranked": lambda results: _kind(results) != "saltelli",
    # The answer is the best setting.
    "if-answer": lambda results: (
        _kind(results) != "saltelli" and not isinstance(results.store.manifest.selection, Cheapest)
    ),
    # A single design point: the policies are compared in it.
    "if-one-setting": lambda results: len(results.store.manifest.points) == 1,
    # Fields with several values; such that others are averaged over.
    "if-fields": lambda results: bool(varied(results)),
    "if-effects": lambda results: len(varied(results)) > 1 and _kind(results) != "one-at-a-time",
    # Combinations of values of one field, of two, of three and more.
    "if-one-field": lambda results: _is_scan(results, lambda count: count == 1),
    "if-two-fields": lambda results: _is_scan(results, lambda count: count == 2),
    "if-many-fields": lambda results: _is_scan(results, lambda count: count > 2),
    "if-one-at-a-time": lambda results: _kind(results) == "one-at-a-time",
    # Design points spread over the space of parameters.
    "if-sampled": lambda results: (
        _kind(results) == "latin-hypercube"
        or (_kind(results) == "table" and len(varied(results)) > 2)
    ),
    "if-sensitivity": lambda results: _kind(results) == "saltelli",
    # Several policies with the same missions; some of them learned, some not.
    "if-policies": lambda results: not summary.comparisons(results).empty,
    "if-learned": lambda results: not summary.learned_against_heuristic(results).empty,
    # Tables of the study.
    "if-selection": lambda results: isinstance(results.store.manifest.selection, Selection),
    "if-cheapest": lambda results: isinstance(results.store.manifest.selection, Cheapest),
    "if-precision": _has("precision"),
    "if-costs": _has("costs"),
}
