"""Reports: notebooks run on results, each rendered to one self-contained page, and an index."""

import logging
import os
import re
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from jinja2 import Environment, PackageLoader
from markupsafe import Markup
from nbconvert import HTMLExporter
from nbformat import NotebookNode
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer

import dess
from analysis.results.evidence import Evidence
from analysis.results.manifest import Manifest
from analysis.results.store import MANIFEST
from dess.errors import InputError
from reports.pages import html
from reports.pages.kernels import Kernels, Progress
from reports.pages.notebook import GIVEN, NAMES, SCORECARD, Report, check_parameters, read
from reports.pages.verify import is_sealed, sealed

log = logging.getLogger(__name__)

INDEX = "index.html"
_INDEX_OR_NO_TEXT = re.compile(r"<(code|pre|script|style)\b.*?</\1>|<[^>]*>|\bC_([SC])\b", re.S)
_IMAGE = re.compile(r"<img [^>]+>")
_SCORECARD = re.compile(r'<section id="scorecard">.*?</section>', re.S)


class ReportError(RuntimeError):
    """Notebooks failed: for each its cell, what that raised, and where the partial page is."""


@dataclass(frozen=True)
class Card:
    """What the index shows of a page."""

    page: str
    title: str
    description: str
    thumbnail: Markup


def render(
    names: Iterable[str],
    results: str | Path,
    out: str | Path,
    progress: Progress | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Path:
    """Run reports on the results of studies and write their pages, their notebooks and an index.

    The index shows all pages that are there then, those of earlier calls as well. The same results
    give the same bytes.

    Args:
        names: The reports; all shipped ones if empty.
        results: The folder that holds a results folder per study.
        out: The folder to write to.
        progress: Called after every cell.
        parameters: Values for the parameters of the notebooks, beside ``results``.

    Returns:
        The path of ``index.html``.

    Raises:
        InputError: If a report or a parameter is unknown, results are missing, a notebook refuses
            what it was given or ``out`` cannot be written. Nothing is written then.
        ReportError: If a notebook fails; after all others. Its page is left under a name of its
            own, as far as it went.
    """
    results, out, values = Path(results), Path(out), parameters or {}
    reports = [read(name) for name in dict.fromkeys(names) or NAMES]
    check_parameters(reports, values)
    for study in dict.fromkeys(study for report in reports for study in report.studies):
        _check_results(results / study)
    for report in reports:
        report.set({"results": ".", **values})
    needed = [out] + [results for report in reports if "results" in report.parameters]
    with _folders(needed), TemporaryDirectory(dir=out, prefix=".rendering-") as folder:
        Kernels(results, progress).run(reports)
        files = {report.page: sealed(_page("report.html", **_parts(report))) for report in reports}
        whole = [report for report in reports if not report.failure]
        files |= {f"{r.name}.ipynb": r.for_jupyter(results, out, values) for r in whole}
        files[INDEX] = _index(_pages(out, but=files) | files)
        with _writing(out):
            for name, text in files.items():
                Path(folder, name).write_bytes(text.encode())
            for name in files:
                os.replace(Path(folder, name), out / name)
            for report in whole:
                (out / f"{report.name}.partial.html").unlink(missing_ok=True)
    if failed := [report for report in reports if report.failure]:
        raise ReportError(
            "; ".join(f"{r.failure}; as far as it went: {out / r.page}" for r in failed)
        )
    return out / INDEX


@contextmanager
def _folders(folders: Iterable[Path]) -> Iterator[None]:
    """Make folders; if what comes then fails and has left nothing in them, they go again."""
    made: list[Path] = []
    try:
        for folder in folders:
            new = [path for path in (folder, *folder.parents) if not path.exists()]
            with _writing(folder):
                folder.mkdir(parents=True, exist_ok=True)
            made += new
        yield
    except BaseException:
        for path in made:
            with suppress(OSError):  # it holds something
                path.rmdir()
        raise


@contextmanager
def _writing(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(f"out: {out} cannot be written: {error.strerror}") from error


def _check_results(folder: Path) -> None:
    if not (folder / MANIFEST).exists():
        raise InputError(
            f"results: {folder} holds no results of study {folder.name}; "
            f"they are made by: dess study run {folder.name} --out {folder}"
        )
    manifest = Manifest.read(folder / MANIFEST)
    held = manifest.study["name"]
    if held != folder.name:
        raise InputError(f"results: {folder} holds study {held}; allowed: {folder.name}")
    if not manifest.complete:
        raise InputError(f"results: {folder}: incomplete; allowed: run the study again")


def _parts(report: Report) -> dict[str, Any]:
    """What the template of a page shows."""
    # Without what was given: it may be a path of this machine. The notebook beside has it.
    cells = [cell.source for cell in report.cells if cell.id != GIVEN]
    code = highlight("\n\n\n".join(cells), PythonLexer(), HtmlFormatter())
    return {"report": report, "body": _body(report.notebook), "code": Markup(code)}


def _body(notebook: NotebookNode) -> str:
    """The cells as HTML; what they wrote to stderr goes to the log instead."""
    for cell in notebook.cells:
        for output in [*cell.get("outputs", [])]:
            if output.get("name") == "stderr":
                log.warning(output.text.rstrip())
            if output.get("name") == "stderr" or output.output_type == "error":
                cell.outputs.remove(output)
    exporter = HTMLExporter(
        template_name="basic",
        exclude_input=True,
        exclude_output_prompt=True,
        exclude_anchor_links=True,
    )
    return _with_indices(exporter.from_notebook_node(notebook)[0])


def _with_indices(content: str) -> str:
    """Text with ``C_S`` as a C with an index; code and attributes stay."""
    return _INDEX_OR_NO_TEXT.sub(lambda m: f"C<sub>{m[2]}</sub>" if m[2] else m[0], content)


def _pages(out: Path, but: Container[str] = ()) -> dict[str, str]:
    """The pages of earlier calls that stay; the index leaves out what is not as it was written."""
    pages = {}
    for path in (out / f"{name}.html" for name in NAMES if f"{name}.html" not in but):
        try:
            content = path.read_bytes().decode()
            if not is_sealed(content):
                raise InputError("altered")
            _evidence([content])
        except FileNotFoundError:
            continue
        except (OSError, UnicodeDecodeError, InputError):
            log.warning("%s: altered, or of another version; the index leaves it out", path)
        else:
            pages[path.name] = content
    return pages


def _evidence(pages: Iterable[str]) -> list[Evidence]:
    """What pages carry of their studies, each once."""
    texts = [text for content in pages for text in html.embedded(html.STUDY, content)]
    return [Evidence.parse(text, "page") for text in dict.fromkeys(texts)]


def _index(pages: Mapping[str, str]) -> str:
    """The page that shows all others, and what their results were made with."""
    there = [report for report in map(read, NAMES) if report.page in pages]
    cards = [
        Card(r.page, r.title, r.description, _thumbnail(pages[r.page]))
        for r in there
        if r.name != SCORECARD
    ]
    scorecard = _SCORECARD.findall(pages.get(f"{SCORECARD}.html", ""))
    shown = [pages[report.page] for report in there]
    files = dict.fromkeys(text for content in shown for text in html.embedded(html.FILES, content))
    origins = html.carrying(_evidence(shown), files)
    parts = {"scorecard": Markup("".join(scorecard)), "origins": Markup(origins.data)}
    return sealed(_page(INDEX, cards=cards, **parts))


def _thumbnail(content: str) -> Markup:
    """The last image of a page, the fullest one."""
    images = _IMAGE.findall(content)
    return Markup(images[-1] if images else "")


def _page(template: str, **values: Any) -> str:
    environment = Environment(
        loader=PackageLoader("reports", "templates"), autoescape=True, trim_blocks=True
    )
    style = HtmlFormatter().get_style_defs(".highlight")
    return environment.get_template(template).render(
        code_style=Markup(style), version=dess.__version__, **values
    )
