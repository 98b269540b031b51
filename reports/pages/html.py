"""Parts of a page as HTML or Markdown: sentences, tables, figures, and the origin of results.

Results may come from anybody, so no name in them is ever markup: whatever is inserted into HTML or
Markdown is escaped here.

html.write_markdown("{n:,} missions of {policy}.", n=300, policy="greedy")
html.make_table(frame, "Means with 95 % intervals")
html.make_gallery([(drawing, "Success of every policy", "n = 300 missions")])
"""

import gzip
import io
import json
import os
import re
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from hashlib import sha256
from html import escape
from numbers import Number
from pathlib import Path
from string import Formatter
from typing import TYPE_CHECKING, Any

import pandas as pd
from IPython.display import HTML, Markdown, display
from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup

import dess
from dess.analysis import numbers
from dess.analysis.numbers import format_span
from dess.analysis.results.resimulate import Evidence, learned_files
from dess.analysis.results.tables import Results
from dess.analysis.study.study import budget_of
from dess.analysis.tables import Table
from dess.base.errors import printable
from dess.reports.pages import ASKED
from dess.reports.pages.page import STUDY, Learned, Page, hidden_element

STUDIES_BESIDE = 3  # studies with a column in one table of what they were made with
FEW_WORDS = 18  # characters of a cell that is not broken
SENTENCES = 150  # characters of a cell from which on its column is wide
SHORT = 12  # characters of a hash that are shown
# The templates of the scripts that simulate: a panel, another mission, the example of the index.
PANEL_SCRIPT, SINGLE_SCRIPT = "panel_script.js", "another_script.js"
EXAMPLE_SCRIPT = "try_script.js"
PART = "application/vnd.dess.part+json"  # type of the output of a cell that contains a ``Part``

if TYPE_CHECKING:  # an index is made without figures
    from matplotlib.figure import Figure

LEAD = (10.2, 4.4)  # the size of the figure that shows the answer [inches]
LEAD_ON_PHONE = (4.3, 4.4)  # at least so high
DIGITS = "%.6g"  # format of numbers in files with data
# Characters that LaTeX cannot print directly.
_IN_LATEX = str.maketrans(
    {"−": "$-$", "–": "--", "▲": r"$\triangle$", "▼": r"$\nabla$", "≈": r"$\approx$", "±": r"$\pm$"}
    | {"△": r"($\triangle$)", "▽": r"($\nabla$)"}
)
# What may harm in Markdown (HTML, links, formulas), and all that Markdown may take as markup,
# partly at the beginning of a line only.
_HARMFUL = re.compile(r"[<>\[\]$]|:(?=//)|(?<=www)\.")
_MARKUP = re.compile(
    rf"{_HARMFUL.pattern}|[&\\`*|~]|(?<![^\W_])_|_(?![^\W_])|^[-+=#](?!\d)|^\d+(?=[.)](\s|$))"
)
# A figure without anything.
_BARE = dict.fromkeys(("name", "alt", "source", "narrow", "player", "caption", "links"), "")
# The coordinates in a figure, a number with many decimals, the space around a command of a path.
_PLACES = re.compile(rb' (?:d|x|y)="[^"]*"')
_DIGITS = re.compile(rb"(\.\d)\d+")
_CELL = re.compile(r"<td>(.*?)</td>", re.S)
# In a cell: the number at its beginning up to the decimal point; a number before its unit; an
# interval.
_NUMBER = re.compile(r"[-+−]?\d[\d,]*(?![\w–/-])")
_UNIT = re.compile(r"([\d\]]) (?=[%▲▼≈]|[^\W\d]+ \[|[^\W\d]+$)")
_BRACKETS = re.compile(r"\[[^\[\]]*\]")
_EMPTY_HEADER = re.compile(r"<th([^>]*)></th>")  # which is no header for a screen reader
_BREAKS = re.compile(rb"\s+([LCQz]) ?")
_INDEX = re.compile(r"\bC_([SC])\b")  # as in C_S, a threshold of charging
# What a file says of its origin, without the time.
_NO_METADATA: dict = {"svg": dict.fromkeys(("Creator", "Date", "Format", "Type"))}
_NO_METADATA |= {"pdf": {"CreationDate": None}, "png": {}}


# What all templates have in common: they escape values, and one that is undefined is an error.
JINJA: dict[str, Any] = {"autoescape": select_autoescape(), "undefined": StrictUndefined}


class Marked(str):
    """Markdown in which every name is escaped."""


def set_indices(text: object) -> Markup:
    """Text, or HTML without such a name in an attribute, in which the S of ``C_S`` is an index."""
    return Markup(_INDEX.sub(r"C<sub>\1</sub>", str(Markup.escape(text))))


@cache
def load_template(name: str, **filters: Callable[..., str]) -> Template:
    """Load a template.

    Args:
        name: File name in ``reports/templates``.
        **filters: Filters in addition to ``indexed`` and those of Jinja. Only a page explains
            terms; elsewhere ``explained`` text is the same text.
    """
    finalize = None
    if name.endswith(".md"):
        finalize = _escape_unless_marked
    loader = PackageLoader("dess.reports", "templates")
    environment = Environment(loader=loader, finalize=finalize, trim_blocks=True, **JINJA)
    environment.globals["panel_hash"] = panel_hash
    environment.filters |= {"indexed": set_indices, "explained": Markup.escape, **filters}
    return environment.get_template(name)


@cache
def panel_script(name: str) -> str:
    """The script of a panel, from its template."""
    template = load_template(name)
    if name == EXAMPLE_SCRIPT:  # which draws nothing
        return template.render()
    from dess.analysis.figures import style  # for the pages that have one

    return template.render(style=style)


def panel_hash(name: str) -> str:
    """The hash by which a page lets a browser run the script of a panel, and no other."""
    return b64encode(sha256(panel_script(name).encode()).digest()).decode()


def pack(content: bytes) -> str:
    """Compressed bytes as text; equal bytes give equal text."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode()


def render_part(name: str, **values: Any) -> HTML:
    """A part of a page that a template makes of values, which it escapes."""
    return HTML(load_template(name).render(**values))


def fill_page(
    name: str,
    scripts: bool = False,
    simulates: bool = False,
    script: str = PANEL_SCRIPT,
    **values: Any,
) -> str:
    """Fill a template with values, and seal the page.

    A browser makes no request for the page, and runs scripts only if ``scripts`` is set. If
    ``simulates`` is set, it runs the script of a panel, and its WebAssembly module; the script of
    *another mission* needs both. The templates of these scripts have the names ``..._script.js``.
    """
    permitted = {"scripts": scripts, "simulates": simulates, "script": script}
    page = load_template(name).render(version=dess.__version__, **permitted, **values)
    return Page(page).sealed.text


def _escape_unless_marked(value: object) -> object:
    return value if isinstance(value, int | float | Marked) else escape_text(value)


class Part(HTML):
    """A part of a page as data, which the page numbers and explains; Jupyter shows it as HTML.

    Attributes:
        values: The answer (``sentence``, ``number``), or figures (``figures``, ``look``, ``note``).
    """

    def __init__(self, **values: Any):
        """Make the HTML of the values."""
        super().__init__(load_template("part.html").render(part=values))
        self.values = values

    def _repr_mimebundle_(self, **_: object) -> dict[str, object]:
        return {PART: self.values}


class _Escaping(Formatter):
    """Fills a text in Markdown with values, and escapes all that are neither numbers nor marked."""

    def format_field(self, value: Any, form: str) -> str:
        shown = super().format_field(value, form)
        return shown if isinstance(value, Marked | Number) else escape_text(shown)


def write_markdown(template: str, **values: object) -> Markdown:
    """Markdown with values in it.

    ``write_markdown("{n:,} missions of {policy}", n=300, policy=name)`` is a sentence.
    """
    shown = fill_markdown(template, **values)
    return Markdown(f"\n{shown}" if shown.startswith("http") else shown)  # it would be requested


def fill_markdown(template: str, **values: object) -> Marked:
    """The text of ``write_markdown``, which is a value for another ``write_markdown``."""
    return Marked(_Escaping().vformat(template, (), values))


def escape_text(name: object) -> Marked:
    """Any text, such as a name, in Markdown: on the page it is the same text, and nothing else."""
    line = printable(re.sub(r"\s+", " ", str(name)))
    return Marked(_MARKUP.sub(_escape_character, line))


def format_code(name: object) -> Marked:
    """Any text in Markdown, set as code."""
    return Marked(f"<code>{escape_text(name)}</code>")


def escape_sentences(sentences: str) -> Marked:
    """Markdown that ``analysis`` made of its own words and of names.

    Emphasis, code and lists stay; HTML, links, images and formulas become plain text.
    """
    return Marked(_HARMFUL.sub(_escape_character, sentences))


def _escape_character(found: re.Match[str]) -> str:
    return f"&#{ord(found[0][0])};{found[0][1:]}"


def code_block(kind: str, content: str) -> Marked:
    """A block of code in Markdown; the content cannot end it."""
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", content)), default=0))
    return Marked(f"{fence}{kind}\n{content}\n{fence}")


def command_block(lines: Iterable[str]) -> Marked:
    """A block of shell commands in Markdown, to be copied at once."""
    return code_block("sh", "\n".join(lines))


def provenance_table(studies: Iterable[Results]) -> HTML:
    """A table of what the studies of a page were made with, with the evidence to verify them."""
    return evidence_tables([Evidence.of(results) for results in studies])


def evidence_tables(evidence: Sequence[Evidence]) -> HTML:
    """Tables of what studies were made with, a column for each, and hidden elements with it all.

    Args:
        evidence: The evidence of the studies.
    """
    starts = range(0, len(evidence), STUDIES_BESIDE)
    tables = [_origin_table(evidence[start : start + STUDIES_BESIDE]).data for start in starts]
    inside = [hidden_element(STUDY, json.dumps(of_study.data)) for of_study in evidence]
    return HTML("".join([*tables, *inside]))


def _origin_table(evidence: Sequence[Evidence]) -> HTML:
    names = [of_study.study.name for of_study in evidence]
    columns = {
        name if names.count(name) == 1 else f"{name} {e.key}": {
            "Scenario": e.study.scenario,
            "Policies": ", ".join(team.policy for team in e.policies),
            "Weights": ", ".join(_name_weights(e)) or "none",
            "Design points": f"{e.points:,}",
            "Missions per policy and point": format_span(e.missions),
            "Budget": budget_of(e.study),
            "Seed": e.seed,
            "Engine": e.study.engine,
            "Study key": e.key,
            "dess": e.version,
            "Code": e.engine_code[:SHORT],
            "Accepted": "; ".join(change.text for change in e.accepted),
            "Commit": (e.commit or "unknown")[:SHORT],
            "Libraries": ", ".join(f"{name} {version}" for name, version in e.libraries.items()),
        }
        for name, e in zip(names, evidence, strict=True)
    }
    frame = pd.DataFrame(columns).rename_axis("Study")
    if not any(e.accepted for e in evidence):
        frame = frame.drop("Accepted")
    return make_table(frame.reset_index(), wrap=True)


def weights_table(folder: Path) -> HTML:
    """A table of the files of the learned policies in a folder, and the evidence to verify it."""
    files = learned_files(folder)
    rows = [(name, digest[:SHORT]) for name, digest in files.items()]
    shown = make_table(pd.DataFrame(rows, columns=["File", "SHA-256"]), "The learned policies")
    return HTML(f"{shown.data}{Learned(files=files).hidden}")


def _name_weights(evidence: Evidence) -> Iterator[str]:
    """The names of the learned policies of a study with the hashes of their weights."""
    for name, digest in dict.fromkeys(
        (team.policy if len(team.members) == 1 else member.name, member.weights)
        for team in evidence.policies
        for member in team.members
    ):
        if digest:
            yield f"{name} {digest[:SHORT]}"


def make_table(
    frame: pd.DataFrame, caption: str = "", data: pd.DataFrame | None = None, wrap: bool = False
) -> HTML:
    """A table below its caption, without its index; a wide table scrolls.

    Args:
        frame: The table.
        caption: The text above the table.
        data: The complete numbers of the table. If given, links below the table save them as CSV
            and the shown table as LaTeX.
        wrap: Whether long cells are broken into several lines.
    """
    look = ["table"]
    if wrap:
        look += ["wrap"]
    html = frame.to_html(index=False, border=0, classes=look, escape=True, na_rep="")
    html = _CELL.sub(_wrap_cell, html) if wrap else _align_numbers(html, len(frame.columns))
    html = str(set_indices(Markup(_EMPTY_HEADER.sub(r"<td\1></td>", html))))
    caption = ". ".join(
        filter(None, [caption, numbers.why_nan(frame.astype(object).fillna("").to_numpy().flat)])
    )
    above = ""
    if caption:
        above = f'<p class="caption">{set_indices(caption)}</p>'  # what scrolls would take it away
    below = ""
    if data is not None:
        below = _download_links(caption, data, frame)
    label = escape(caption or "Table")
    html = html.replace("<table", f'<table aria-label="{label}"', 1)
    inside = f'<div class="scroll" role="region" tabindex="0" aria-label="{label}">{html}</div>'
    return HTML(f"{above}{inside}{below}")


def _align_numbers(table: str, columns: int) -> str:
    """A table in HTML with the numbers that begin its cells aligned at their decimal points.

    A cell breaks between an estimate and its interval, but within neither.
    """
    cells = _CELL.findall(table)
    indents = [0.0] * len(cells)
    for column in range(columns):
        places = range(column, len(cells), columns)
        widths = {
            place: _measure_digits(number[0])
            for place in places
            if (number := _NUMBER.match(cells[place]))
        }
        for place, width in widths.items():
            indents[place] = max(widths.values()) - width
    aligned = map(_indent_cell, cells, indents)
    return _CELL.sub(lambda _: next(aligned), table)


def _indent_cell(cell: str, indent: float) -> str:
    """A cell that begins so many digits to the right."""
    if indent:
        return f'<td style="--indent:{indent:g}">{_keep_together(cell)}</td>'
    return f"<td>{_keep_together(cell)}</td>"


def _wrap_cell(cell: re.Match[str]) -> str:
    """A cell that is broken into several lines; sentences get a column that is wide enough."""
    look = ' class="long"' if len(cell[1]) > SENTENCES else ""
    return f"<td{look}>{_keep_together(cell[1])}</td>"


def _measure_digits(digits: str) -> float:
    """The width of a number before its decimal point, in digits; a comma is half as wide."""
    return len(digits) - 0.5 * digits.count(",")


def _keep_together(cell: str) -> str:
    """The text of a cell without breaks in a few words, before a unit and within an interval."""
    if len(cell) <= FEW_WORDS and "[" not in cell:
        return cell.replace(" ", "\N{NO-BREAK SPACE}")
    together = _UNIT.sub("\\1\N{NO-BREAK SPACE}", cell)
    return _BRACKETS.sub(lambda found: found[0].replace(" ", "\N{NO-BREAK SPACE}"), together)


def make_answer(sentence: str, number: str = "") -> Part:
    """The answer to the question of a page: it stands below the title, and on the page's card.

    Args:
        sentence: One sentence, in plain text or as ``analysis`` writes it for Markdown.
        number: The number of the answer, for pages that have a tile on the index.
    """
    return Part(sentence=printable(re.sub(r"[*`]", "", sentence)), number=number)


def make_figure(
    drawing: "Figure", alt: str, caption: str, data: pd.DataFrame | None = None
) -> Part:
    """A figure with its alternative text and its caption.

    Args:
        drawing: The figure.
        alt: What the figure shows, for readers who cannot see it.
        caption: The text below the figure.
        data: The data of the figure. If given, links in the caption save them as CSV and as LaTeX.
    """
    return make_figures([_describe_figure(drawing, alt, caption, data)])


def lead_figure(
    drawing: "Figure",
    alt: str,
    caption: str,
    data: pd.DataFrame | None = None,
    narrow: "Figure | None" = None,
) -> Part:
    """The figure that shows the answer, as wide as the page; with the arguments of ``make_figure``.

    Narrow windows show ``narrow`` in its place, or the same figure drawn for their width.
    """
    on_phone = narrow or drawing
    _resize_figure(on_phone, LEAD_ON_PHONE[0], max(LEAD_ON_PHONE[1], on_phone.get_figheight()))
    source = _figure_address(on_phone)
    _resize_figure(drawing, *LEAD)
    return make_figures(
        [_describe_figure(drawing, alt, caption, data) | {"narrow": source}], "lead"
    )


def _resize_figure(drawing: "Figure", width: float, height: float) -> None:
    """Give a figure another size [inches]; one of ours fits its legend to it."""
    resize = getattr(drawing, "resize", drawing.set_size_inches)
    resize(width, height)


def make_gallery(drawings: Iterable[tuple[Any, ...]], note: str = "") -> Part:
    """Several figures side by side where there is room.

    Args:
        drawings: Each a ``Drawing``, or the first two or more of its values.
        note: What holds for all of them, in a paragraph below.
    """
    return make_figures([_describe_figure(*parts) for parts in drawings], "gallery", note)


def make_figures(values: Sequence[Mapping[str, Any]], look: str = "", note: str = "") -> Part:
    """Figures as data, in one of the looks of ``style.css``.

    Args:
        values: Of each its ``caption``, and ``links`` to its data. A drawing has ``alt``,
            ``source``, ``files`` if they are asked for and, for narrow windows, ``narrow``; what a
            script draws is HTML, ``player``, with ``name``, which is its anchor.
        look: ``lead``, ``gallery``, or none.
        note: What holds for all of them, in a paragraph below.
    """
    return Part(figures=[{**_BARE, **value} for value in values], look=look, note=note)


def show_parts(*parts: Table | HTML | Markdown | Iterable[tuple[Any, ...]]) -> None:
    """Show tables, galleries of figures, and what else there is, one below the other."""
    for part in parts:
        if isinstance(part, HTML | Markdown):
            display(part)
        elif isinstance(part, Table):
            display(make_table(*part))
        else:
            display(make_gallery(part))


def encode_figure(drawing: "Figure", kind: str) -> bytes:
    """A figure in one of ``PICTURES``; the same figure gives the same bytes."""
    import matplotlib as mpl

    buffer = io.BytesIO()
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams |= {"svg.hashsalt": "dess", "svg.fonttype": "none"}  # text, not outlines
        mpl.rcParams |= {"pdf.fonttype": 42, "savefig.dpi": 200}  # journals refuse Type 3
        drawing.savefig(buffer, format=kind, metadata=_NO_METADATA[kind])
    content = buffer.getvalue()
    if kind == "svg":
        return _PLACES.sub(_shorten_coordinates, content)
    return content


def _shorten_coordinates(coordinates: re.Match[bytes]) -> bytes:
    """The coordinates without digits that are finer than any screen, and without line breaks."""
    return _BREAKS.sub(rb"\1", _DIGITS.sub(rb"\1", coordinates[0]))


def _describe_figure(
    drawing: "Figure", alt: str, caption: str = "", data: pd.DataFrame | None = None
) -> dict[str, Any]:
    links = ""
    if data is not None:
        links = _download_links(alt, data, data)
    kinds = filter(None, os.environ.get(ASKED, "").split(","))
    files = {kind: b64encode(encode_figure(drawing, kind)).decode() for kind in kinds}
    shown: dict[str, Any] = {
        "alt": alt,
        "source": _figure_address(drawing),
        "caption": caption,
        "links": links,
    }
    if files:
        shown["files"] = files
    return shown


def _figure_address(drawing: "Figure") -> str:
    """The address of a figure, which contains it."""
    return f"data:image/svg+xml;base64,{b64encode(encode_figure(drawing, 'svg')).decode()}"


def _download_links(title: str, data: pd.DataFrame, shown: pd.DataFrame) -> str:
    """Links that save data as CSV and a table as LaTeX; the links contain the files."""
    name = re.sub(r"[^a-z0-9]+", "-", title.partition(":")[0].lower())[:80].strip("-")
    files = {
        "CSV": ("csv", "text/csv", numbers.write_csv(data, DIGITS)),
        "LaTeX": ("tex", "application/x-tex", format_latex(shown)),
    }
    links = [
        f'<a download="{name}.{suffix}" aria-label="{escape(f"{title}: {kind}")}" '
        f'href="data:{media};charset=utf-8;base64,{b64encode(text.encode()).decode()}">{kind}</a>'
        for kind, (suffix, media, text) in files.items()
    ]
    return f'<span class="data">Data: {" ".join(links)}</span>'


def format_latex(frame: pd.DataFrame) -> str:
    """A table in LaTeX; it needs the package booktabs."""
    text = frame.to_latex(index=False, escape=True, float_format=DIGITS.__mod__, na_rep="")
    return re.sub(r"\bC\\_([SC])\b", r"$C_\1$", text).translate(_IN_LATEX)
