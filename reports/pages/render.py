"""Render notebooks to pages, leave those that are up to date as they are, and write their index.

The index has tiles, the figure of the scorecard, and a card per page. Anybody may have made a page
in the folder. So of older pages, the index takes only what cannot run.
"""

import logging
import os
import re
import sys
from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from shlex import quote
from types import MappingProxyType
from typing import Any

import nbformat

import dess
from dess import InputError
from dess.analysis.results.chunks import MANIFEST
from dess.analysis.results.manifest import Manifest
from dess.analysis.results.tables import Results
from dess.base.files.documents import LIMIT
from dess.base.files.reading import Missing, paths_in, read_bytes
from dess.base.files.writing import delete, locked, write_files
from dess.base.floors import FLOORS
from dess.reports.pages import INDEX, LOCK, PREFIX, check_pages, kernels, notebook
from dess.reports.pages.html import fill_page, load_template
from dess.reports.pages.kernels import Progress
from dess.reports.pages.page import Page
from dess.reports.pages.study import make_study_report

TILES = {  # pages whose number has a tile, and what it is
    "performance.html": "Against the paper's policy",
    "planner.html": "Planning against learning",
    "own-sea.html": "The cheapest fleet of the example",
}
_OF_STUDY = re.compile(rf"{PREFIX}.+(?<!\.partial)\.html")


def make_index(
    pages: Mapping[str, Page], left_out: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> str:
    """The index of pages.

    Args:
        pages: The pages, by file name.
        left_out: Titles of reports whose results are missing, with the commands that make these.
    """
    cards = {name: pages[name].card for name in sort_pages(pages)}
    scorecard = cards.get(f"{notebook.SCORECARD}.html")
    return fill_page(
        INDEX,
        cards=cards,
        tiles=[
            (text, page) for page, text in TILES.items() if page in cards and cards[page].number
        ],
        picture=scorecard and scorecard.picture,
        groups=group_pages(pages),
        left_out=left_out,
    )


def sort_pages(pages: Iterable[str], group: str | None = None) -> list[str]:
    """File names of pages in the order of the index: those of a group, or all."""
    present = {*pages}
    studies = sorted(name for name in present if _OF_STUDY.fullmatch(name))
    order = []
    for heading, names in notebook.GROUPS.items():
        if group in (None, heading):
            if heading == next(iter(notebook.GROUPS)):
                order += studies
            order += [f"{name}.html" for name in names]
    return [name for name in order if name in present]


def group_pages(pages: Iterable[str]) -> list[tuple[str, list[str]]]:
    """The headings of the groups that have a page, each with the file names of its pages."""
    names = {heading: sort_pages(pages, heading) for heading in notebook.GROUPS}
    return [(heading, of_group) for heading, of_group in names.items() if of_group]


def add_bars(pages: Mapping[str, Page]) -> dict[str, Page]:
    """The pages of a folder, with the links to all of them, by group, in their bars."""
    labels = {}
    for name in sort_pages(pages):
        labels[name] = name.removesuffix(".html").replace("-", " ").capitalize()
        if _OF_STUDY.fullmatch(name):
            labels[name] = pages[name].card.title
    shown = {"groups": group_pages(pages), "labels": labels}
    bar = load_template("bar.html")
    return {n: page.replace_bar(bar.render(page=n, **shown)) for n, page in pages.items()}


def find_pages(out: Path, but: Container[str] = ()) -> dict[str, Page]:
    """The pages in a folder, by file name; pages that were altered are left out, with a warning.

    Args:
        out: The folder.
        but: File names that are left out without a warning.
    """
    pages = {}
    names = sort_pages(path.name for path in paths_in(out, "*.html"))
    for path in (out / name for name in names if name not in but):
        is_sound = False
        with suppress(InputError):
            page = Page.read(path)
            is_sound = page.is_sealed and bool(page.card) and page.evidence is not None
        if is_sound:
            pages[path.name] = page
        else:
            log.warning("%s: altered, or of another version; the index leaves it out", path)
    return pages


log = logging.getLogger(__name__)

PACKAGE = Path(dess.__file__).parent


def page_key(report: notebook.Report, studies: Mapping[str, Path]) -> str:
    """The key of a page whose notebook has its default parameters.

    Args:
        report: The report.
        studies: The results folders that it reads, by the names that the page has for them.
    """
    parts = [_hash_software(), nbformat.writes(report.original)]
    for name, folder in studies.items():
        files = [path.relative_to(folder).as_posix() for path in paths_in(folder, "**/*.parquet")]
        parts += [
            name,
            _hash_file(folder / MANIFEST),
            *files,
        ]  # the names of files have their hashes
    return sha256(repr(parts).encode()).hexdigest()


def has_key(page: Path, key: str) -> bool:
    """Whether a file is a page with this key that has not been altered."""
    try:
        existing = Page.read(page)
        return bool(key) and existing.card.key == key and existing.is_sealed
    except (OSError, InputError):
        return False


@lru_cache
def _hash_software() -> str:
    """A hash of the files of this package and of the versions of all libraries."""
    # In a checkout, folders of the package lie beside it, and ``**`` does not follow links to them.
    folders = [PACKAGE]
    for name in FLOORS:
        if (PACKAGE / name).is_symlink() or not (PACKAGE / name).is_dir():
            folders.append(PACKAGE.parent / name)
    files = sorted(
        (path.relative_to(folder).as_posix(), _hash_file(path))
        for folder in folders
        for path in paths_in(folder, "**/*.*")
        if path.is_file() and path.parent.name != "__pycache__"
    )
    versions = sorted(f"{library.name} {library.version}" for library in metadata.distributions())
    return repr([sys.version, versions, files])


def _hash_file(path: Path) -> str:
    return sha256(read_bytes(path, LIMIT)).hexdigest()


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
        _find_finished_page(report, results, out, values)
    lacking = {r.name: {} if r.is_current else _list_lacking(r, results) for r in reports}
    commands = {c: error for errors in lacking.values() for c, error in errors.items()}
    if asked and len(commands) > 1 and all(isinstance(e, Missing) for e in commands.values()):
        names = " ".join(command.rpartition(" ")[2] for command in commands)
        raise InputError(
            "results",
            f"{results} holds no results of {len(commands)} studies",
            f"what is made by: dess study run {names} --out {quote(str(results))}",
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
    kernels.simulate_missing(changed, results, values, progress)
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
    _find_finished_page(report, folder, out, values)
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
    read_by = Counter(f for report in changed for f in _find_results(report, results).values())
    kernels.run_reports(
        changed, progress, [folder for folder, count in read_by.items() if count > 1]
    )
    new_pages = {}
    files: dict[str, str | bytes] = {}
    if changed:
        from dess.reports.pages.body import figure_files, make_page  # imports nbconvert

        new_pages = {report.page: make_page(report) for report in changed}
        for report in (report for report in changed if not report.failure):
            files[f"{report.name}.ipynb"] = report.for_jupyter(results, out, values)
            pictures = figure_files(report)
            files |= {f"{report.folder}/{name}": picture for name, picture in pictures}
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


def _find_finished_page(
    report: notebook.Report, results: Path, out: Path, values: Mapping[str, Any]
) -> None:
    """Find out whether the page of a report is there and of these results, which are sound then."""
    if values:
        return
    # If there are none, ``_list_lacking`` finds out what is wrong.
    with suppress(InputError):
        report.key = page_key(report, _find_results(report, results))
        kept = not report.formats and has_key(out / report.page, report.key)
        report.is_current = kept and report.is_in(out, results)


def _find_results(report: notebook.Report, results: Path) -> dict[str, Path]:
    """The results folders that a report reads, by name."""
    optional_files = (paths_in(results, f"{name}/{MANIFEST}") for name in report.optional)
    others = [path.parent.name for paths in optional_files for path in paths]
    return {name: results / name for name in (*report.studies, *others)}


def _list_lacking(report: notebook.Report, results: Path) -> dict[str, InputError]:
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
        raise Missing(
            "results",
            f"{folder} holds no results of study {folder.name}",
            f"what is made by: dess study run {folder.name} --out {quote(str(folder))}",
        )
    manifest = Manifest.read(folder / MANIFEST)
    study = manifest.study.name
    if study != folder.name:
        raise InputError("results", f"{folder} holds study {study}", folder.name)
    if not manifest.complete:
        raise InputError(f"results: {folder}", "incomplete", "run the study again")
