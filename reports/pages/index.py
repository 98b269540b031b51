"""The index of a folder of pages: tiles, the figure of the scorecard, and a card per page.

Anybody may have made a page in the folder. So of older pages, the index takes only what cannot run.
"""

import logging
import re
from collections.abc import Container, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from markupsafe import Markup

from dess import InputError
from dess.files.reading import paths_in
from dess.reports.folders import INDEX, PREFIX
from dess.reports.pages import html
from dess.reports.pages.html import fill, template
from dess.reports.pages.notebook import GROUPS, SCORECARD
from dess.reports.pages.page import FILES, Page

log = logging.getLogger(__name__)

TILES = {  # pages whose number has a tile, and what it is
    "performance.html": "Against the paper's policy",
    "planner.html": "Planning against learning",
    "own-sea.html": "The cheapest fleet of the example",
}
_OF_STUDY = re.compile(rf"{PREFIX}.+(?<!\.partial)\.html")


def index_of(
    pages: Mapping[str, Page], left_out: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> str:
    """The index of pages.

    Args:
        pages: The pages, by file name.
        left_out: Titles of reports whose results are missing, with the commands that make these.
    """
    cards = {name: pages[name].card for name in in_order(pages)}
    scorecard = cards.get(f"{SCORECARD}.html")
    shown = Page("".join(pages[name].text for name in cards))
    return fill(
        INDEX,
        cards=cards,
        tiles=[
            (text, page) for page, text in TILES.items() if page in cards and cards[page].number
        ],
        picture=scorecard and scorecard.picture,
        groups=[(head, names) for head in GROUPS if (names := in_order(pages, head))],
        left_out=left_out,
        origins=Markup(html.carrying(shown.evidence, shown.hidden(FILES)).data),
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


def with_bars(pages: Mapping[str, Page]) -> dict[str, Page]:
    """The pages of a folder, with the links to all of them in their bars."""
    links = {}
    for name in in_order(pages):
        links[name] = name.removesuffix(".html").replace("-", " ").capitalize()
        if _OF_STUDY.fullmatch(name):
            links[name] = pages[name].card.title
    bar = template("bar.html")
    return {n: page.with_bar(bar.render(links=links, page=n)) for n, page in pages.items()}


def pages_in(out: Path, but: Container[str] = ()) -> dict[str, Page]:
    """The pages in a folder, by file name; pages that were altered are left out, with a warning.

    Args:
        out: The folder.
        but: File names that are left out without a warning.
    """
    pages = {}
    names = in_order(path.name for path in paths_in(out, "*.html"))
    for path in (out / name for name in names if name not in but):
        try:
            page = Page.read(path)
            if not (page.is_sealed and page.card and page.evidence is not None):
                raise InputError("altered")
        except InputError:
            log.warning("%s: altered, or of another version; the index leaves it out", path)
        else:
            pages[path.name] = page
    return pages
