"""Render notebooks to pages, and leave those that are up to date as they are."""

import logging
import os
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from shlex import quote
from types import MappingProxyType
from typing import Any

import nbformat

from dess import InputError
from dess.analysis.results.chunks import MANIFEST
from dess.analysis.results.manifest import Manifest
from dess.files.documents import LIMIT
from dess.files.reading import paths_in, read_bytes
from dess.files.writing import delete, locked, write_files
from dess.reports.folders import INDEX, LOCK, check_pages
from dess.reports.pages import kernels
from dess.reports.pages.body import page_of
from dess.reports.pages.index import index_of, pages_in, with_bars
from dess.reports.pages.kernels import Progress
from dess.reports.pages.notebook import (
    SHIPPED,
    Report,
    check_parameters,
    names_in,
    read,
    with_paths,
)
from dess.reports.pages.page import Page
from dess.reports.pages.study import report_of

PACKAGE = Path(__file__).parents[2]  # dess


def key_of(report: Report, studies: Mapping[str, Path]) -> str:
    """The key of a page whose notebook has its default parameters.

    Args:
        report: The report.
        studies: The results folders that it reads, by the names that the page has for them.
    """
    parts = [_software(), nbformat.writes(report.original)]
    for name, folder in studies.items():
        files = [path.relative_to(folder).as_posix() for path in paths_in(folder, "**/*.parquet")]
        parts += [name, _hash(folder / MANIFEST), *files]  # the names of files have their hashes
    return sha256(repr(parts).encode()).hexdigest()


def has_key(page: Path, key: str) -> bool:
    """Whether a file is a page with this key that has not been altered."""
    try:
        found = Page.read(page)
        return bool(key) and found.card.key == key and found.is_sealed
    except (OSError, InputError):
        return False


@lru_cache
def _software() -> str:
    """A hash of the files of this package and of the versions of all libraries."""
    # In a checkout, the folders in it are links, which ``**`` does not follow.
    folders = [PACKAGE, *(path for path in paths_in(PACKAGE) if path.is_symlink())]
    paths = [path for folder in folders for path in paths_in(folder, "**/*.*") if path.is_file()]
    files = sorted(
        (path.relative_to(PACKAGE).as_posix(), _hash(path))
        for path in paths
        if path.parent.name != "__pycache__"
    )
    versions = sorted(f"{library.name} {library.version}" for library in metadata.distributions())
    return repr([sys.version, versions, files])


def _hash(path: Path) -> str:
    return sha256(read_bytes(path, LIMIT)).hexdigest()


log = logging.getLogger(__name__)

PATIENCE = 60.0  # for which the page of another process is waited for [s]
_BUSY = "another process writes there; allowed: wait"


class ReportError(RuntimeError):
    """One or more notebooks failed; the message has each cell, its error and the partial page."""


def render(
    names: Iterable[str],
    results: str | Path,
    out: str | Path,
    progress: Progress | None = None,
    parameters: Mapping[str, Any] | None = None,
    notebooks: Path = SHIPPED,
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

    Returns:
        The path of ``index.html``.

    Raises:
        InputError: If a report or a parameter is unknown, results are missing, a notebook refuses
            its input or ``out`` cannot be written. Nothing is written then.
        ReportError: If a notebook fails; after all others. Its page is written under another name,
            up to the cell that failed.
    """
    results, out, given = Path(results), Path(out), parameters or {}
    values = {name: with_paths(value, os.path.abspath) for name, value in given.items()}
    asked = [*dict.fromkeys(names)]
    reports = [read(name, notebooks) for name in asked or names_in(notebooks)]
    check_parameters(reports, values)
    lacking = {report.name: _lacking(report, results) for report in reports}
    commands = dict.fromkeys(command for errors in lacking.values() for command in errors)
    if asked and len(commands) > 1:
        names = " ".join(command.rpartition(" ")[2] for command in commands)
        raise InputError(
            f"results: {results} lacks complete results of {len(commands)} studies; allowed: what "
            f"is made by: dess study run {names} --out {quote(str(results))}"
        )
    for name, errors in lacking.items():
        for error in errors.values():
            if asked:
                raise error
            log.warning("note: report %s is left out: %s", name, error)
    left_out = {report.title: [*lacking[report.name]] for report in reports if lacking[report.name]}
    reports = [report for report in reports if not lacking[report.name]]
    for report in reports:
        report.set({"results": str(results.absolute()), **values})
    _write(reports, results, out, progress, values, left_out)
    return out / INDEX


def render_study(
    folder: str | Path,
    out: str | Path,
    progress: Progress | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Path:
    """Write the page of a results folder of any study, its notebook and the index.

    Args:
        folder: The results folder.
        out: The folder to write to.
        progress: Called after every cell.
        parameters: Values for the parameters of the notebook, beside ``results``.

    Returns:
        The path of the page, ``study-NAME.html``.

    Raises:
        InputError: If the folder holds no complete results, a parameter is unknown or refused, or
            ``out`` cannot be written. Nothing is written then.
        ReportError: If the notebook fails, as in ``render``.
    """
    folder, out, values = Path(folder), Path(out), parameters or {}
    report = report_of(folder, values)
    check_parameters([report], values)
    report.set({"results": str(folder.absolute()), **values})
    _write([report], folder, out, progress, values)
    return out / report.page


def _write(
    reports: Sequence[Report],
    results: Path,
    out: Path,
    progress: Progress | None,
    values: Mapping[str, Any],
    left_out: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> None:
    """Run reports in the folder of their results, and write the pages and the index."""
    check_pages(out, *(report.name for report in reports))
    for report in reports:
        report.key = "" if values else key_of(report, _folders(report, results))
    changed = [report for report in reports if not has_key(out / report.page, report.key)]
    kernels.make([report.name for report in changed], results, values, progress)
    read_by = Counter(f for report in changed for f in _folders(report, results).values())
    kernels.run(changed, progress, [folder for folder, count in read_by.items() if count > 1])
    made = {report.page: page_of(report) for report in changed}
    complete = [report for report in reports if not report.failure]
    files = {f"{r.name}.ipynb": r.for_jupyter(results, out, values) for r in complete}
    with locked(out / LOCK, _BUSY, PATIENCE):
        others = pages_in(out, but=made)
        pages = with_bars(others | made)
        files |= {name: page.text for name, page in pages.items() if page != others.get(name)}
        files[INDEX] = index_of(pages, left_out)
        write_files({out / name: text for name, text in files.items()})
        for report in complete:
            delete(out / f"{report.name}.partial.html")
    if failed := [report for report in reports if report.failure]:
        lines = [f"{r.failure}; partial page: {out / r.page}" for r in failed]
        raise ReportError("; ".join(lines))


def _folders(report: Report, results: Path) -> dict[str, Path]:
    """The results folders that a report reads, by name."""
    found = (paths_in(results, f"{name}/{MANIFEST}") for name in report.optional)
    others = [path.parent.name for paths in found for path in paths]
    return {name: results / name for name in (*report.studies, *others)}


def _lacking(report: Report, results: Path) -> dict[str, InputError]:
    """The results that a report lacks: the command that makes them, and what is wrong."""
    errors = {}
    for study in report.studies:
        try:
            _check_results(results / study)
        except InputError as error:
            errors[f"dess study run {study}"] = error
    return errors


def _check_results(folder: Path) -> None:
    if not (folder / MANIFEST).exists():
        raise InputError(
            f"results: {folder} holds no results of study {folder.name}; "
            f"allowed: what is made by: dess study run {folder.name} --out {quote(str(folder))}"
        )
    manifest = Manifest.read(folder / MANIFEST)
    study = manifest.study.name
    if study != folder.name:
        raise InputError(f"results: {folder} holds study {study}; allowed: {folder.name}")
    if not manifest.complete:
        raise InputError(f"results: {folder}: incomplete; allowed: run the study again")
