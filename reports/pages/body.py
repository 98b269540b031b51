"""The page of a notebook that has been run: nbconvert fills our template with what cells say.

A cell says what it is as data (``parts.Part``), Markdown, HTML or text; a cell of Markdown that
begins with a second-level heading begins a section. Here are the filters of the template
``report.html``, which number figures, explain terms and make the sections.
"""

import re
from base64 import b64decode
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup
from nbconvert.exporters import TemplateExporter
from nbconvert.filters.markdown_mistune import IPythonRenderer, MarkdownWithMath
from nbformat import NotebookNode
from pygments.formatters import HtmlFormatter

import dess
from dess.reports.pages.notebook import SCORECARD, Report
from dess.reports.pages.page import Card, Page, Picture
from dess.reports.pages.parts import PART
from dess.reports.pages.templates import JINJA, PANEL_SCRIPT, panel_hash, set_indices

TEMPLATES = Path(__file__).parents[1] / "templates"
FOLDED = "How this page was made"  # the heading of the section with method and provenance
# What the pages explain where a word stands first.
TERMS = {
    "return guard": "allows only actions after which a UAV can still reach the charging zone",
    "product": "collection ratio and communication: in each mission the collection ratio if all "
    "UAVs fill their quotas, else 0",
    "replication": "the number of a mission, which fixes all its random draws",
    "paired": "taken in missions with the same random draws",
    "upper bound": "no policy can expect to collect more",
    "95 % intervals": "such an interval holds the true value in 95 of 100 studies. Of success it "
    "is Wilson's. Of a metric of which is known what a failure changes it is Student's t with an "
    "allowance for failures too rare to be seen, so it is wider and not symmetric. Of other means "
    "it is Student's t, corrected for skewness",
    "Peak age of information": "the mean of the ages just before a node is emptied. A node that no "
    "UAV empties has no peak, but counts in the mean age, so the mean may lie above the peak",
    "Holm": "a correction of p-values for the number of comparisons",
}
_TERM = re.compile(rf"\b({'|'.join(TERMS)})\b")
_TERM_LINK = re.compile(r'(<a class="term"[^>]*>([^<]*)</a>)')
_HEADING = re.compile(r"## (.*)\n*")


class _Writer(IPythonRenderer):
    """Writes the texts of a page from its beginning; explains a term where it stands first."""

    def __init__(self) -> None:
        super().__init__(escape=False, exclude_anchor_links=True)
        self.explained_terms: dict[str, str] = {}

    def explain_terms(self, text: object) -> Markup:
        return Markup(_TERM.sub(self._with_meaning, str(Markup.escape(text))))

    def _with_meaning(self, found: re.Match[str]) -> str:
        """A link to the meaning, which stands at the end of the page for everybody to read."""
        term = found[0]
        if term in self.explained_terms:
            return term
        self.explained_terms[term] = TERMS[term]
        return f'<a class="term" href="#{term_anchor(term)}" title="{TERMS[term]}">{term}</a>'

    def link(self, text: str, url: str, title: str | None = None) -> str:
        """A link; a term within it is not explained there, since no link contains another one."""
        for link, term in _TERM_LINK.findall(text):
            text = text.replace(link, term)
            del self.explained_terms[term]
        return super().link(text, url, title)

    def write_markdown(self, source: str) -> Markup:
        return Markup(MarkdownWithMath(self).render(source))

    def text(self, text: str) -> str:
        return self.explain_terms(set_indices(Markup(super().text(text))))

    def block_code(self, code: str, info: str | None = None) -> str:
        return super().block_code(code, info).replace("<pre>", '<pre tabindex="0">')  # it scrolls


def make_page(report: Report) -> Page:
    """The page of a report that has been run."""
    writer = _Writer()
    card = _make_card(report)
    filters = {
        "explained": writer.explain_terms,
        "indexed": set_indices,
        "markdown": writer.write_markdown,
    }
    exporter = TemplateExporter(
        template_file="report.html",
        template_paths=[str(TEMPLATES)],
        filters=filters
        | {"anchor": section_anchor, "is_beside": is_beside_figure}
        | {"sections": split_sections, "term_anchor": term_anchor, "has_panel": has_panel},
    )
    for option, value in JINJA.items():
        setattr(exporter.environment, option, value)
    exporter.environment.globals |= {
        "report": report,
        "scripts": report.scripts,
        "simulates": simulates(report.notebook.cells),
        "panel_hash": panel_hash,
        "script": PANEL_SCRIPT,
        "version": dess.__version__,
        "answer": card.finding,
        "card": card.hidden,
        "code_style": Markup(HtmlFormatter().get_style_defs(".highlight")),
        "code": Markup(writer.block_code("\n\n\n".join(report.code), "python")),
        "folded": FOLDED,
        "part_type": PART,
        "terms": writer.explained_terms,
    }
    return Page(exporter.from_notebook_node(report.notebook)[0]).sealed


def _make_card(report: Report) -> Card:
    """The card of a report, whose figures get their numbers."""
    parts = find_parts(report.notebook.cells)
    figures = [figure for part in parts for figure in part.get("figures", [])]
    for number, figure in enumerate(figures, 1):
        figure |= {"number": number, "name": figure["name"] or f"figure-{number}"}
    said = next((part for part in parts if "sentence" in part), {})
    finding = said.get("sentence", report.description)
    number = said.get("number", "")
    picture = None
    if report.name == SCORECARD and figures:
        picture = Picture(**{name: figures[0][name] for name in Picture.model_fields})
    key = report.key
    return Card(title=report.title, finding=finding, number=number, picture=picture, key=key)


def find_parts(cells: Iterable[NotebookNode]) -> list[dict[str, Any]]:
    """The parts that cells show, in the order of the page."""
    outputs = [output.get("data", {}) for cell in cells for output in cell.get("outputs", [])]
    return [data[PART] for data in outputs if PART in data]


def figure_files(report: Report) -> Iterator[tuple[str, bytes]]:
    """The files with the figures of a report that has been run, by the numbers on its page."""
    for figure in (
        figure for part in find_parts(report.cells) for figure in part.get("figures", [])
    ):
        for kind, content in figure.get("files", {}).items():
            yield f"{figure['name']}.{kind}", b64decode(content)


def split_sections(cells: Iterable[NotebookNode]) -> list[tuple[Markup, list[NotebookNode]]]:
    """Headings as HTML, each taken out of its cell, with the cells below; the first has none."""
    sections: list[tuple[Markup, list[NotebookNode]]] = [(Markup(), [])]
    for cell in cells:
        if cell.cell_type == "markdown" and (heading := _HEADING.match(cell.source)):
            cell.source = cell.source[heading.end() :]
            sections.append((Markup(heading[1]), []))
        sections[-1][1].append(cell)
    return sections


def section_anchor(heading: Markup) -> str:
    """The anchor of a section."""
    return re.sub(r"\W+", "-", heading.striptags()).strip("-")


def has_panel(cells: Iterable[NotebookNode]) -> bool:
    """Whether a cell shows a panel, to which the page has a link."""
    return _has_section(cells, "panel")


def simulates(cells: Sequence[NotebookNode]) -> bool:
    """Whether a cell shows what simulates missions, so that a browser has to run its script."""
    return has_panel(cells) or _has_section(cells, "another")


def _has_section(cells: Iterable[NotebookNode], name: str) -> bool:
    """Whether a cell shows the section with a name."""
    outputs = [output.get("data", {}) for cell in cells for output in cell.get("outputs", [])]
    return any(f'<section id="{name}"' in data.get("text/html", "") for data in outputs)


def term_anchor(term: str) -> str:
    """The anchor of the meaning of a term."""
    return f"term-{section_anchor(Markup(term)).lower()}"


def is_beside_figure(cells: Sequence[NotebookNode]) -> bool:
    """Whether the text of a section stands beside its figure: there is text, and one figure."""
    single = [part for part in find_parts(cells) if not part.get("look", "none")]
    return len(single) == 1 and any(c.cell_type == "markdown" and c.source for c in cells)
