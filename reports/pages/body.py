"""The body of a page, made of the output of its cells, and the frame around it."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from bs4 import BeautifulSoup, Tag
from bs4.element import NavigableString
from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup
from nbconvert import HTMLExporter
from nbformat import NotebookNode
from pygments.formatters import HtmlFormatter

import dess
from reports.pages.html import Marked, text
from reports.pages.verify import sealed


def template(name: str, **filters: Callable[..., str]) -> Template:
    """Load a template, which escapes values and raises an error if one is undefined.

    Args:
        name: File name in ``reports/templates``.
        **filters: Filters in addition to those of Jinja.
    """
    environment = Environment(
        loader=PackageLoader("reports", "templates"),
        autoescape=select_autoescape(),
        undefined=StrictUndefined,
        trim_blocks=True,
        finalize=_in_markdown if name.endswith(".md") else None,
    )
    environment.filters |= filters
    return environment.get_template(name)


def _in_markdown(value: object) -> object:
    return value if isinstance(value, int | float | Marked) else text(value)


def fill(name: str, scripts: bool = False, **values: Any) -> str:
    """Fill a template with values, and seal the page.

    A browser makes no request for the page, and runs a script only if ``scripts`` is set.
    """
    style = Markup(HtmlFormatter().get_style_defs(".highlight"))
    return sealed(
        template(name).render(scripts=scripts, code_style=style, version=dess.__version__, **values)
    )


FOLDED = "How this page was made"  # the heading of the section with method and provenance
# What the pages explain where a word stands first.
TERMS = {
    "return guard": "allows only actions after which a UAV can still reach the charging zone",
    "product": "collection ratio and communication: in each mission the collection ratio if all "
    "UAVs fill their quotas, else 0",
    "replication": "the number of a mission, which fixes all its random draws",
    "paired": "taken in missions with the same random draws",
    "upper bound": "no policy can expect to collect more",
    "95 % intervals": "Wilson's for success; that of a bounded mean for the other shares, which is "
    "wider and not symmetric; Student's t for differences, with rare failures allowed for",
    "Holm": "a correction of p-values for the number of comparisons",
}
_TERM = re.compile(rf"\b({'|'.join(TERMS)})\b")
_EXPLAINED = ("p", "li", "figcaption")  # elements in whose text terms are explained
_PLAIN = ("code", "a", "button", "script")  # but not within these
# What nbconvert puts around the cells of a notebook and around their outputs.
_WRAPPERS = 'div.cell, div.inner_cell, div.text_cell_render, div[class^="output"]'
_INDEX = re.compile(r"\bC_([SC])\b")  # as in C_S, a threshold of charging


@dataclass(frozen=True)
class Body:
    """The parts of a page.

    Attributes:
        answer: The answer to the question of the page, with its terms explained; may be empty.
        number: The number of the answer, which the index shows large; may be empty.
        sections: The headings of the sections, by their anchors.
        html: The rest.
    """

    answer: Markup
    number: str
    sections: dict[str, str]
    html: str

    @classmethod
    def of(cls, notebook: NotebookNode) -> "Body":
        """The parts of a notebook that has been run."""
        exporter = HTMLExporter(
            template_name="basic",
            exclude_input=True,
            exclude_output_prompt=True,
            exclude_anchor_links=True,
            extra_template_basedirs=[],  # otherwise templates in the working directory come first
        )
        soup = BeautifulSoup(exporter.from_notebook_node(notebook)[0], "html.parser")
        for prompt in soup.select("div.prompt"):
            prompt.decompose()
        for wrapper in soup.select(_WRAPPERS):
            wrapper.unwrap()
        for count, figure in enumerate(soup.find_all("figure"), 1):
            _number(soup, figure, count)
        _explain(soup)
        found = soup.select_one("p.answer")
        answer = found.extract() if found else soup.new_tag("p")
        for scrolling in soup.find_all("pre"):
            scrolling["tabindex"] = "0"
        for string in [*soup.find_all(string=_INDEX)]:
            if not string.find_parent(["code", "pre", "script", "style"]):
                string.replace_with(*_with_indices(soup, string))
        sections = {str(section["id"]): title for section, title in _sections(soup)}
        number = str(answer.get("data-number", ""))
        return cls(Markup(answer.decode_contents()), number, sections, soup.decode().strip())


def _number(soup: BeautifulSoup, figure: Tag, number: int) -> None:
    """Give a figure an anchor and its number."""
    caption = figure.find("figcaption")
    figure.attrs.setdefault("id", f"figure-{number}")
    if caption:
        label = soup.new_tag("a", href=f"#{figure['id']}", attrs={"class": "number"})
        label.string = f"Figure {number}"
        caption.insert(0, label, " ")


def _explain(soup: BeautifulSoup) -> None:
    """Explain every term where it stands first."""
    left = {*TERMS}
    for string in [*soup.find_all(string=_TERM)]:
        if not string.find_parent(_EXPLAINED) or string.find_parent(
            ["code", "a", "button", "script"]
        ):
            continue
        parts: list[str | Tag] = []
        for part in _TERM.split(string):
            if part in left:
                left.remove(part)
                term = soup.new_tag("abbr", title=TERMS[part])
                term.string = part
                parts.append(term)
            else:
                parts.append(part)
        string.replace_with(*parts)


def _with_indices(soup: BeautifulSoup, text: NavigableString) -> list[str | Tag]:
    """A text in which the S of ``C_S`` is an index."""
    parts: list[str | Tag] = [*_INDEX.split(text)]
    for place in range(1, len(parts), 2):
        index = soup.new_tag("sub")
        index.string = str(parts[place])
        parts[place - 1], parts[place] = f"{parts[place - 1]}C", index
    return parts


def _sections(soup: BeautifulSoup) -> Iterator[tuple[Tag, str]]:
    """Make a section of every second-level heading and what follows it; the method is folded."""
    for heading in soup.find_all("h2"):
        title, following = heading.get_text(), [*heading.next_siblings]
        section = soup.new_tag("section", id=re.sub(r"\W+", "-", title).strip("-"))
        heading.insert_before(section)
        ends = (n for n, item in enumerate(following) if getattr(item, "name", "") == "h2")
        content = following[: next(ends, len(following))]
        if title == FOLDED:
            folded = soup.new_tag("details")
            summary = soup.new_tag("summary")
            summary.append(heading.extract())
            folded.extend([summary, *content])
            section.append(folded)
        else:
            section.extend([heading.extract(), *content])
            _beside(soup, section)
        yield section, title


def _beside(soup: BeautifulSoup, section: Tag) -> None:
    """Put the text of a section beside its figure, if it has one figure and begins with text."""
    figures = section.find_all("figure", class_=lambda name: name != "lead", recursive=False)
    words = section.find_all(["p", "ul"], recursive=False)
    if len(figures) == 1 and words:
        both = soup.new_tag("div", attrs={"class": "beside"})
        figures[0].insert_before(both)
        text = soup.new_tag("div")
        text.extend(words)
        both.extend([text, figures[0]])
