"""The index of a folder of pages: a card per page, the scorecard, and the origin of the results.

Anybody may have made a page in the folder. So of older pages, the index takes only what cannot run.
"""

import logging
import re
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from markupsafe import Markup

from analysis.results.evidence import Evidence
from dess import InputError
from dess.files.reading import Missing, paths_in, read_text
from reports.folders import INDEX, PREFIX
from reports.pages import html
from reports.pages.notebook import NAMES, SCORECARD, Report
from reports.pages.template import fill
from reports.pages.verify import is_sealed

log = logging.getLogger(__name__)

LARGEST = 512 * 2**20  # bytes of a page
_IMAGE = re.compile(
    """<img alt=("[^"<>]*"|'[^'<>]*')( class="tall")? """
    r'src="data:image/svg\+xml;base64,[\w+/=]+"/?>',
    re.ASCII,
)
_TITLE, _LEAD = re.compile("<h1>([^<]*)</h1>"), re.compile('<p class="lead">([^<]*)</p>')
_OF_STUDY = re.compile(rf"{PREFIX}.+(?<!\.partial)\.html")
_SCORECARD = re.compile(r'<section id="scorecard">.*?</section>', re.S)
# What a scorecard consists of: text, and tags with a few attributes.
_TAG = (
    "</?(section|style|p|strong|span|small|sub|ul|li|a|details|summary|table|thead|tbody|tr|th|td)"
    r'( (id|class|scope|colspan|data-label)="[^"<>]*"| href="[\w-]+\.html(#[\w-]*)?")*>'
)
_PLAIN = re.compile(rf"([^<]++|{_TAG})*+", re.ASCII)
_STYLE = re.compile("<style>(.*?)</style>", re.S)
_REQUESTS = re.compile(r"@import|url|image|src|\\", re.I)


@dataclass(frozen=True)
class Card:
    """What the index shows about a page."""

    page: str
    title: str
    description: str
    thumbnail: Markup


def index_of(
    pages: Mapping[str, str],
    reports: Sequence[Report],
    left_out: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> str:
    """The index of pages.

    Args:
        pages: The HTML of pages, by file name.
        reports: The reports in the order of their cards; those without a page are left out. Pages
            of studies come after them, by name.
        left_out: Titles of reports whose results are missing, with the commands that make these.
    """
    shown = [report for report in reports if report.page in pages]
    cards = [
        Card(r.page, r.title, r.description, _thumbnail(pages[r.page], -1))
        for r in shown
        if r.name != SCORECARD
    ]
    studies = [name for name in sorted(pages) if _OF_STUDY.fullmatch(name)]
    cards += [_card_of_study(name, pages[name]) for name in studies]
    contents = [pages[name] for name in (*(report.page for report in shown), *studies)]
    files = dict.fromkeys(text for page in contents for text in html.embedded(html.FILES, page))
    origins = html.carrying(_evidence(contents), files)
    scorecard = _SCORECARD.findall(pages.get(f"{SCORECARD}.html", ""))
    parts = {"scorecard": Markup("".join(scorecard)), "origins": Markup(origins.data)}
    return fill(INDEX, scripts=False, cards=cards, left_out=left_out, **parts)


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
            if not is_sealed(content) or not _is_plain("".join(_SCORECARD.findall(content))):
                raise InputError("altered")
            _evidence([content])
        except Missing:
            continue
        except InputError:
            log.warning("%s: altered, or of another version; the index leaves it out", path)
        else:
            pages[path.name] = content
    return pages


def _is_plain(html: str) -> bool:
    """Whether HTML has only what scorecards consist of, such as no script and no image."""
    styles = "".join(_STYLE.findall(html))
    return bool(_PLAIN.fullmatch(html)) and not _REQUESTS.search(styles)


def _evidence(pages: Iterable[str]) -> list[Evidence]:
    """The evidence of all studies in the pages, without duplicates."""
    texts = [text for content in pages for text in html.embedded(html.STUDY, content)]
    return [Evidence.parse(text, "page", "a page of dess report") for text in dict.fromkeys(texts)]


def _card_of_study(name: str, content: str) -> Card:
    """The card of a page of a study: its title, its description and its first drawing."""
    title, description = (Markup("".join(part.findall(content)[:1])) for part in (_TITLE, _LEAD))
    return Card(name, title, description, _thumbnail(content, 0))


def _thumbnail(content: str, number: int) -> Markup:
    """An image of a page (of a report the last one, which shows most), or nothing without one."""
    images = [image[0] for image in _IMAGE.finditer(content)]
    return Markup(images[number] if images else "")
