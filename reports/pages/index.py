"""The index of the pages in a folder, and the bars with links between them.

The index has tiles, the figure of the scorecard, and a card per page. Anybody may have made a page
in the folder. So of older pages, the index takes only what cannot run.
"""

import json
import logging
import re
from collections.abc import Container, Iterable, Mapping, Sequence
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType

from dess import InputError
from dess.analysis.wasm.module import MOST_BYTES, read_module
from dess.base.files.reading import paths_in, read_bytes
from dess.reports.pages import INDEX, PREFIX
from dess.reports.pages.notebook import SCORECARD, find_groups
from dess.reports.pages.page import Page
from dess.reports.pages.templates import (
    EXAMPLE_SCRIPT,
    fill_page,
    load_template,
    pack,
    page_script,
)

log = logging.getLogger(__name__)

TILES = {  # pages whose number has a tile, and what it is
    "performance.html": "Against the paper's policy",
    "planner.html": "Planning against learning",
    "own-sea.html": "The cheapest fleet of the example",
}
EXAMPLE = Path(__file__).with_name("example.json")  # of ``panel.describe_example``
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
    scorecard = cards.get(f"{SCORECARD}.html")
    return fill_page(
        INDEX,
        cards=cards,
        tiles=[
            (text, page) for page, text in TILES.items() if page in cards and cards[page].number
        ],
        picture=scorecard and scorecard.picture,
        groups=group_pages(pages),
        left_out=left_out,
        simulates=True,
        script=EXAMPLE_SCRIPT,
        example=render_example(),
    )


def render_example() -> str:
    """Three controls with which a reader simulates missions of the paper's sea, as HTML.

    They are left out if they were made for another version of the WebAssembly module.
    """
    about = json.loads(read_bytes(EXAMPLE, MOST_BYTES, "a part of the package"))
    module = read_module()
    if about["module"] != sha256(module).hexdigest():
        return ""
    return load_template("try.html").render(
        data=about["data"],
        missions="1,000",
        module=pack(module),
        network=pack(b""),  # its policy is a heuristic
        image=pack(json.dumps(about["image"]).encode()),
        script=page_script(EXAMPLE_SCRIPT),
    )


def sort_pages(pages: Iterable[str]) -> list[str]:
    """File names of pages in the order of the index."""
    return [name for _, of_group in group_pages(pages) for name in of_group]


def group_pages(pages: Iterable[str]) -> list[tuple[str, list[str]]]:
    """The headings of the groups that have a page, each with the file names of its pages."""
    present = {*pages}
    first = sorted(name for name in present if _OF_STUDY.fullmatch(name))
    groups = []
    for heading, names in find_groups().items():
        of_group = [name for name in (f"{name}.html" for name in names) if name in present]
        groups.append((heading, first + of_group))
        first = []
    return [(heading, of_group) for heading, of_group in groups if of_group]


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
