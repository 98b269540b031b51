"""Parts of a page as data: its answer, its figures with captions, and what is shown below them.

>>> make_answer("Two *UAVs* are enough.").values
{'sentence': 'Two UAVs are enough.', 'number': ''}
"""

import os
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd
from IPython.display import HTML, Markdown, display
from markupsafe import Markup

from dess.analysis.facts import Fact
from dess.analysis.tables import Table
from dess.base.errors import printable
from dess.reports.pages import ASKED
from dess.reports.pages.downloads import make_download_links
from dess.reports.pages.figures import encode_figure, figure_address, resize_figure
from dess.reports.pages.tables import make_table
from dess.reports.pages.templates import load_template, render_part

if TYPE_CHECKING:  # an index is made without figures
    from matplotlib.figure import Figure

PART = "application/vnd.dess.part+json"  # type of the output of a cell that contains a ``Part``
LEAD = (10.2, 4.4)  # the size of the figure that shows the answer [inches]
LEAD_ON_PHONE = (4.3, 4.4)  # at least so high
# A figure without anything.
_BARE = dict.fromkeys(("name", "alt", "source", "narrow", "player", "caption", "links"), "")


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


def make_answer(sentence: str, number: str = "") -> Part:
    """The answer to the question of a page: it stands below the title, and on the page's card.

    Args:
        sentence: One sentence, in plain text or as ``analysis`` writes it for Markdown.
        number: The number of the answer, for pages that have a tile on the index.
    """
    return Part(sentence=printable(re.sub(r"[*`]", "", sentence)), number=number)


def make_facts(facts: Iterable[Fact]) -> HTML:
    """The facts of an answer as a table, with links that save it."""
    shown = [*facts]
    frame = pd.DataFrame(shown)
    links = Markup(make_download_links("The answer in facts", frame, frame))
    is_required = any(fact.required for fact in shown)
    return render_part("facts.html", facts=shown, is_required=is_required, links=links)


def make_assumptions(facts: Iterable[Fact]) -> HTML:
    """What an answer assumes, in a frame of its own."""
    return render_part("assumptions.html", facts=facts)


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
    resize_figure(on_phone, LEAD_ON_PHONE[0], max(LEAD_ON_PHONE[1], on_phone.get_figheight()))
    source = figure_address(on_phone)
    resize_figure(drawing, *LEAD)
    return make_figures(
        [_describe_figure(drawing, alt, caption, data) | {"narrow": source}], "lead"
    )


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


def _describe_figure(
    drawing: "Figure", alt: str, caption: str = "", data: pd.DataFrame | None = None
) -> dict[str, Any]:
    links = ""
    if data is not None:
        links = make_download_links(alt, data, data)
    kinds = filter(None, os.environ.get(ASKED, "").split(","))
    files = {kind: b64encode(encode_figure(drawing, kind)).decode() for kind in kinds}
    shown: dict[str, Any] = {
        "alt": alt,
        "source": figure_address(drawing),
        "caption": caption,
        "links": links,
    }
    if files:
        shown["files"] = files
    return shown
