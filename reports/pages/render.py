"""Render notebooks to pages, leave those that are up to date as they are, and write their index."""

import logging
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from dess import InputError
from dess.analysis.results.chunks import MANIFEST
from dess.analysis.results.manifest import Manifest
from dess.analysis.results.tables import Results
from dess.base.commands import command_line
from dess.base.files.locks import locked
from dess.base.files.reading import Missing
from dess.base.files.writing import delete, write_files
from dess.reports.pages import INDEX, LOCK, check_pages, missing, notebook
from dess.reports.pages.finished import find_finished_page
from dess.reports.pages.index import add_bars, find_pages, make_index
from dess.reports.pages.missing import Progress
from dess.reports.pages.study import make_study_report

log = logging.getLogger(__name__)

PATIENCE = 60.0  # for which the page of another process is waited for [s]
# What is said if it takes longer, and what is allowed then.
_BUSY = ("another process writes there", "wait")


class ReportError(RuntimeError):
    """One or more notebooks failed; the message has each cell, its error and the partial page."""


def render(
    names: Iterable[str],
    results: str | Path,
    out: str | Path,
    progress: Progress | None = None,
    parameters: Mapping[str, Any] | None = None,
    notebooks: Path = notebook.SHIPPED,
    formats: Sequence[str] = (),
) -> Path:
    """Run reports on the results of studies and write their pages, their notebooks and an index.

    The index shows all pages in the folder, also those of earlier calls. A page that is there and
    would be the same is not rendered again.

    Args:
        names: The reports. If empty, all whose results are there; the index and a line in the log
            name the others.
        results: The folder that holds a results folder per study.
        out: The folder to write to.
        progress: Called after every mission that the pages need beside the results, and every cell.
        parameters: Values for the parameters of the notebooks, beside ``results``; paths in them
            are relative to the working directory.
        notebooks: The folder of the notebooks.
        formats: Of ``PICTURES``: the figures are also written as such files.

    Returns:
        The path of ``index.html``.

    Raises:
        InputError: If a report or a parameter is unknown, results are missing, a notebook refuses
            its input or ``out`` cannot be written. Nothing is written then.
        ReportError: If a notebook fails; after all others. Its page is written under another name,
            up to the cell that failed.
    """
    results = Path(results)
    out = Path(out)
    typed_values = parameters or {}
    values = {
        name: notebook.replace_paths(value, os.path.abspath) for name, value in typed_values.items()
    }
    asked = [*dict.fromkeys(names)]
    reports = [
        notebook.read_report(name, notebooks) for name in asked or notebook.report_names(notebooks)
    ]
    notebook.check_parameters(reports, values)
    for report in reports:
        report.formats = (*formats,)
        report.find_results(results)
        if not values:
            find_finished_page(report, results, out)
    lacking = {r.name: {} if r.is_current else _list_lacking(r, results) for r in reports}
    commands = {c: error for errors in lacking.values() for c, error in errors.items()}
    if asked and len(commands) > 1 and all(isinstance(e, Missing) for e in commands.values()):
        studies = [command.rpartition(" ")[2] for command in commands]
        raise InputError(
            "results",
            f"{results} holds no results of {len(commands)} studies",
            f"what is made by: {command_line('study', 'run', *studies, out=results)}",
        )
    for name, errors in lacking.items():
        for error in errors.values():
            if asked:
                raise error
            log.warning("note: report %s is left out: %s", name, error)
    left_out = {report.title: [*lacking[report.name]] for report in reports if lacking[report.name]}
    reports = [report for report in reports if not lacking[report.name]]
    for report in reports:
        report.set_parameters({"results": str(results.absolute()), **values})
    check_pages(out, *(report.name for report in reports))
    changed = [report.name for report in reports if not report.is_current]
    missing.simulate_missing(changed, results, values, progress)
    _write_pages(reports, results, out, progress, values, left_out)
    return out / INDEX


def render_study(
    results: Results,
    out: str | Path,
    progress: Progress | None = None,
    parameters: Mapping[str, Any] | None = None,
    formats: Sequence[str] = (),
) -> Path:
    """Write the page of any study, its notebook and the index.

    Args:
        results: The study.
        out: The folder to write to.
        progress: Called after every cell.
        parameters: Values for the parameters of the notebook, beside ``results``.
        formats: As in ``render``.

    Returns:
        The path of the page, ``study-NAME.html``.

    Raises:
        InputError: If a parameter is unknown or refused, or ``out`` cannot be written. Nothing is
            written then.
        ReportError: If the notebook fails, as in ``render``.
    """
    folder = results.store.folder
    out = Path(out)
    values = parameters or {}
    report = make_study_report(results, values)
    notebook.check_parameters([report], values)
    report.set_parameters({"results": str(folder.absolute()), **values})
    report.formats = (*formats,)
    report.find_results(folder)
    if not values:
        find_finished_page(report, folder, out)
    check_pages(out, report.name)
    _write_pages([report], folder, out, progress, values)
    return out / report.page


def _write_pages(
    reports: Sequence[notebook.Report],
    results: Path,
    out: Path,
    progress: Progress | None,
    values: Mapping[str, Any],
    left_out: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> None:
    """Run reports in the folder of their results, and write the pages and the index."""
    changed = [report for report in reports if not report.is_current]
    new_pages = {}
    files: dict[str, str | bytes] = {}
    if changed:
        from dess.reports.pages import kernels  # imports Jupyter
        from dess.reports.pages.body import figure_files, make_page

        kernels.run_reports(changed, progress)
        new_pages = {report.page: make_page(report) for report in changed}
        for report in (report for report in changed if not report.failure):
            pictures = figure_files(report)
            files |= {f"{report.folder}/{name}": picture for name, picture in pictures}
            files[f"{report.name}.ipynb"] = report.for_jupyter(results, out, values)
    with locked(out / LOCK, *_BUSY, PATIENCE):
        others = find_pages(out, but=new_pages)
        pages = add_bars(others | new_pages)
        files |= {name: page.text for name, page in pages.items() if page != others.get(name)}
        files[INDEX] = make_index(pages, left_out)
        write_files({out / name: text for name, text in files.items()})
        for report in (report for report in reports if not report.failure):
            delete(out / f"{report.name}.partial.html")
    if failed := [report for report in reports if report.failure]:
        lines = [f"{r.failure}; partial page: {out / r.page}" for r in failed]
        raise ReportError("; ".join(lines))


def _list_lacking(report: notebook.Report, results: Path) -> dict[str, InputError]:
    """The results that a report lacks: the command that makes them, and what is wrong."""
    errors = {}
    for study in report.studies:
        try:
            _check_results(results / study)
        except InputError as error:
            errors[command_line("study", "run", study)] = error
    return errors


def _check_results(folder: Path) -> None:
    if not (folder / MANIFEST).exists():
        raise Missing(
            "results",
            f"{folder} holds no results of study {folder.name}",
            f"what is made by: {command_line('study', 'run', folder.name, out=folder)}",
        )
    manifest = Manifest.read(folder / MANIFEST)
    study = manifest.study.name
    if study != folder.name:
        raise InputError("results", f"{folder} holds study {study}", folder.name)
    if not manifest.complete:
        raise InputError(f"results: {folder}", "incomplete", "run the study again")
