"""The index of a folder of pages: a card per page, the scorecard, and the origin of the results."""

import logging
import re
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from analysis.results.evidence import Evidence
from dess import InputError
from reports.pages import html
from reports.pages.notebook import NAMES, SCORECARD, Report
from reports.pages.template import fill
from reports.pages.verify import is_sealed

log = logging.getLogger(__name__)

INDEX = "index.html"
_IMAGE = re.compile(r"<img [^>]+>")
_SCORECARD = re.compile(r'<section id="scorecard">.*?</section>', re.S)


@dataclass(frozen=True)
class Card:
    """What the index shows of a page."""

    page: str
    title: str
    description: str
    thumbnail: Markup


def index_of(pages: Mapping[str, str], reports: Sequence[Report]) -> str:
    """The index of pages.

    Args:
        pages: The HTML of pages, by file name.
        reports: The reports in the order of their cards; those without a page are left out.
    """
    shown = [report for report in reports if report.page in pages]
    cards = [
        Card(r.page, r.title, r.description, _thumbnail(pages[r.page]))
        for r in shown
        if r.name != SCORECARD
    ]
    contents = [pages[report.page] for report in shown]
    files = dict.fromkeys(text for page in contents for text in html.embedded(html.FILES, page))
    origins = html.carrying(_evidence(contents), files)
    scorecard = _SCORECARD.findall(pages.get(f"{SCORECARD}.html", ""))
    values = {"scorecard": Markup("".join(scorecard)), "origins": Markup(origins.data)}
    return fill(INDEX, cards=cards, **values)


def pages_in(out: Path, but: Container[str] = ()) -> dict[str, str]:
    """The pages in a folder, by file name; altered ones are left out, with a warning.

    Args:
        out: The folder.
        but: File names that are left out without a warning.
    """
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
    """The evidence that pages carry of their studies, without duplicates."""
    texts = [text for content in pages for text in html.embedded(html.STUDY, content)]
    return [
        Evidence.parse(text, "page", "allowed: a page of dess report")
        for text in dict.fromkeys(texts)
    ]


def _thumbnail(content: str) -> Markup:
    """The last image of a page, which shows the most."""
    images = _IMAGE.findall(content)
    return Markup(images[-1] if images else "")
