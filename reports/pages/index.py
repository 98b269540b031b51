"""The index of a folder of pages: tiles, the figure of the scorecard, and a card per page.

Anybody may have made a page in the folder. So of older pages, the index takes only what cannot run.
"""

import logging
import re
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from markupsafe import Markup

from analysis.results.resimulate import Evidence
from dess import InputError
from dess.files.reading import Missing, paths_in, read_text
from reports.folders import INDEX, PREFIX
from reports.pages import html
from reports.pages.body import fill
from reports.pages.notebook import GROUPS, NAMES, SCORECARD
from reports.pages.verify import is_sealed, sealed

log = logging.getLogger(__name__)

LARGEST = 512 * 2**20  # bytes of a page
TILES = {  # pages whose number has a tile, and what it is
    "performance": "Against the paper's policy",
    "planner": "Planning against learning",
    "own-sea": "The cheapest fleet of the example",
}
_DATA = r"data:image/svg\+xml;base64,[\w+/=]+"
_IMAGE = re.compile(
    rf"""<picture><source media="[^"<>]*" srcset="{_DATA}"/?>"""
    rf"""<img alt=("[^"<>]*"|'[^'<>]*') src="{_DATA}"/?></picture>""",
    re.ASCII,
)
_TITLE = re.compile("<h1>([^<]*)</h1>")
_LEAD = re.compile('<p class="lead"(?: data-number="([^"<>]*)")?>([^<]*)</p>')
_EXPLAINED = re.compile('<abbr title="[^"<>]*">|</abbr>')  # a term in a finding
_BAR = re.compile('<nav class="bar" aria-label="All pages">.*?</nav>', re.S)
_OF_STUDY = re.compile(rf"{PREFIX}.+(?<!\.partial)\.html")


@dataclass(frozen=True)
class Card:
    """What the index shows about a page: its question and, in one sentence, what it found."""

    page: str
    title: Markup
    number: Markup
    finding: Markup

    @classmethod
    def of(cls, page: str, content: str) -> "Card":
        """The card of a page."""
        content = _EXPLAINED.sub("", content)
        title, (number, finding) = _first(_TITLE, content), _first(_LEAD, content) or ("", "")
        return cls(page, Markup(title), Markup(number), Markup(finding))


def index_of(
    pages: Mapping[str, str], left_out: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> str:
    """The index of pages.

    Args:
        pages: The HTML of pages, by file name.
        left_out: Titles of reports whose results are missing, with the commands that make these.
    """
    cards = {name: Card.of(name, pages[name]) for name in in_order(pages)}
    tiles = [(text, cards.get(f"{name}.html")) for name, text in TILES.items()]
    groups = [(head, [cards[name] for name in in_order(pages, head)]) for head in GROUPS]
    contents = [pages[name] for name in cards]
    files = dict.fromkeys(text for page in contents for text in html.embedded(html.FILES, page))
    origins = html.carrying(_evidence(contents), files)
    claims = _IMAGE.search(pages.get(f"{SCORECARD}.html", ""))
    return fill(
        INDEX,
        tiles=[(text, card) for text, card in tiles if card and card.number],
        claims=Markup(claims[0] if claims else ""),
        groups=[(head, of_group) for head, of_group in groups if of_group],
        left_out=left_out,
        origins=Markup(origins.data),
    )


def in_order(pages: Iterable[str], group: str | None = None) -> list[str]:
    """File names of pages in the order of the index: those of a group, or all."""
    known = {*pages}
    studies = sorted(name for name in known if _OF_STUDY.fullmatch(name))
    order = []
    for heading, names in GROUPS.items():
        if group in (None, heading):
            order += [*(studies if heading == [*GROUPS][0] else ()), *(f"{n}.html" for n in names)]
    return [name for name in order if name in known]


def with_bar(content: str, page: str, pages: Mapping[str, str]) -> str:
    """A page with the links to all pages of its folder in its bar, sealed again."""
    links = ['<a href="index.html">Overview</a>']
    for name in in_order(pages):
        here = ' aria-current="page"' if name == page else ""
        label = Markup.escape(name.removesuffix(".html").replace("-", " ").capitalize())
        if _OF_STUDY.fullmatch(name):
            label = Card.of(name, pages[name]).title
        links.append(f'<a href="{Markup.escape(name)}"{here}>{label}</a>')
    bar = f'<nav class="bar" aria-label="All pages">{" ".join(links)}</nav>'
    return sealed(_BAR.sub(lambda _: bar, content, count=1))


def pages_in(out: Path, but: Container[str] = ()) -> dict[str, str]:
    """The pages in a folder, by file name; pages that were altered are left out, with a warning.

    Args:
        out: The folder.
        but: File names that are left out without a warning.
    """
    pages = {}
    studies = [path.name for path in paths_in(out, "*.html") if _OF_STUDY.fullmatch(path.name)]
    names = (*(f"{name}.html" for name in NAMES), *studies)
    for path in (out / name for name in names if name not in but):
        try:
            content = read_text(path, LARGEST)
            if not is_sealed(content):
                raise InputError("altered")
            _evidence([content])
        except Missing:
            continue
        except InputError:
            log.warning("%s: altered, or of another version; the index leaves it out", path)
        else:
            pages[path.name] = content
    return pages


def _first(pattern: re.Pattern[str], content: str) -> Any:
    return next(iter(pattern.findall(content)), "")


def _evidence(pages: Iterable[str]) -> list[Evidence]:
    """The evidence of all studies in the pages, without duplicates."""
    texts = [text for content in pages for text in html.embedded(html.STUDY, content)]
    return [Evidence.parse(text, "page", "a page of dess report") for text in dict.fromkeys(texts)]
