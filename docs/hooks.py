"""What MkDocs builds into the site besides the pages of this folder.

- A line ``<!-- [[ NAME ]] -->`` of a page becomes a part made from the code: the commands, the
  fields of a scenario, the public names of a package, a process of the SimPy model, an example, the
  changelog, a section of the README, a rendered report.
- A link from a page to a file of the repository outside of ``docs/`` leads to a page of the site
  that shows this file. So the same link works in the repository and in the site.
- The reports that ``nox -s reports`` has rendered lie in the site as well; it builds without them,
  with one page that simulates in the browser.
"""

from __future__ import annotations

import inspect
import json
import os
import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path, PurePosixPath
from textwrap import dedent
from typing import TYPE_CHECKING, Any

import typer.main
from typer.cli import get_docs_for_click

import dess
from dess.analysis.names import declared_fields
from dess.model.mission import Mission
from dess.reports.cli.commands import app
from dess.reports.pages.index import make_index

if TYPE_CHECKING:  # the tests import this module without MkDocs
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
# The target of a link or a picture, in Markdown or as HTML.
LINK = re.compile(r"(?:(?<=\]\()|(?<=<img src=\"))(?!https?:|#)([^)#\s\"]+)")
PART = re.compile(r"^<!-- \[\[ (\w+)(?: ([\w -]+))? \]\] -->$", re.M)
README = "README.md"
REPORTS = ROOT / "build" / "reports"
LIVE = "live.html"  # a page that simulates in every site, with reports or without them


# --- parts made from the code ---


def commands() -> str:
    """The help of every command."""
    command = typer.main.get_command(app)
    return get_docs_for_click(obj=command, ctx=typer.Context(command), name="dess", indent=1)


def scenario_fields() -> str:
    """A table of the fields of a scenario, with the values of the paper."""
    heads = ("field", "meaning", "unit", "allowed", "default")
    rows = [
        (f"`{f.name}`", f.meaning, f.unit, f.allowed, _default(f.default))
        for f in declared_fields(dess.load_scenario("paper"))
    ]
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _default(value: Any) -> str:
    """A value as TOML has it, if it is short."""
    text = "" if value is None else json.dumps(value)
    return f"`{text}`" if 0 < len(text) < 40 else "as in the paper" if text else ""


def names(package: str) -> str:
    """The documentation of a package's public names, by their docstrings."""
    module = import_module(package)
    found = [getattr(module, name) for name in module.__all__]
    documented = [thing for thing in found if hasattr(thing, "__qualname__")]  # no module
    return "\n\n".join(f"::: {thing.__module__}.{thing.__qualname__}" for thing in documented)


def code(process: str) -> str:
    """The source of a process of the SimPy model, or of a part of one."""
    source = inspect.getsource(getattr(Mission, process))
    return f"```python\n{dedent(source)}```"


def example(name: str) -> str:
    """A file of ``examples/``."""
    return f"```python\n{(ROOT / 'examples' / name).with_suffix('.py').read_text('utf-8')}```"


def changelog() -> str:
    """The changelog, without its title."""
    return (ROOT / "CHANGELOG.md").read_text("utf-8").split("\n", 1)[1]


def readme(heading: str) -> str:
    """A section of the README, with its links as a page in the root of the site has them."""
    text = LINK.sub(lambda link: place(link[0]), section_of_readme(heading))
    # MkDocs indents the paragraphs of a list item by four spaces, GitHub by three; and in MkDocs an
    # item needs an empty line before it.
    text = re.sub(r"^ {3}(?=[^ ])", " " * 4, text, flags=re.M)
    text = re.sub(r"\n(?=\d\. )", "\n\n", text)
    return f"## {heading}\n{text}"


def section_of_readme(heading: str) -> str:
    """The text below a heading of the README.

    Raises:
        ValueError: If there is no such heading.
    """
    text = (ROOT / README).read_text("utf-8")
    _, found, below = text.partition(f"\n## {heading}\n")
    if not found:
        raise ValueError(f"{README}: has no heading {heading!r}")
    return below.partition("\n## ")[0] + "\n"


def live(report: str) -> str:
    """A page that simulates inside one in the root of the site: a rendered report, or ``LIVE``."""
    address = f"reports/{report}.html"
    part = "panel"
    if not (REPORTS / f"{report}.html").is_file():
        address = LIVE
        part = "try"
    frame = (
        f'<iframe class="live" src="{address}#{part}" title="A page that simulates" loading="lazy">'
    )
    return f"[The page alone]({address}), and here:\n\n{frame}</iframe>"


def reports() -> str:
    """A link to the rendered reports; without them, how to make them."""
    if not (REPORTS / "index.html").is_file():
        return "(This site was built without the reports, which `nox -s reports` makes.)"
    return "[All rendered reports](reports/index.html) are part of this site."


PARTS: dict[str, Callable[..., str]] = {
    part.__name__: part
    for part in (commands, scenario_fields, names, code, example, changelog, readme, live, reports)
}


# --- files outside of docs/ ---


def place(path: str) -> str:
    """Where a file of the repository is in the site."""
    inside = path.removeprefix("docs/")
    return inside if inside != path else f"source/{path.removesuffix('.md')}.md"


def linked(path: str, text: str) -> dict[str, str]:
    """The links of a file of the repository, with the files of the repository they lead to."""
    folder = PurePosixPath(path).parent
    return {link: os.path.normpath(folder / link) for link in LINK.findall(text)}


def moved(path: str, text: str) -> str:
    """The text of a file of the repository, with its links as they are in the site."""
    here = PurePosixPath(place(path)).parent
    targets = linked(path, text)
    return LINK.sub(lambda m: os.path.relpath(place(targets[m[0]]), here), text)


def shown(path: str) -> str:
    """The page that shows a file of the repository; the search leaves it out."""
    text = (ROOT / path).read_text("utf-8")
    if path.endswith(".md"):
        text = moved(path, text)
    else:
        text = f"# {path}\n\n````{PurePosixPath(path).suffix[1:]}\n{text}````\n"
    return f"---\nsearch: {{exclude: true}}\n---\n{text}"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for every file outside of ``docs/`` that a page links to, and what is rendered."""
    from mkdocs.structure.files import File, InclusionLevel

    pending = [f"docs/{file.src_uri}" for file in files.documentation_pages()]
    seen = set(pending)
    while pending:
        path = pending.pop()
        if path.endswith(".md"):
            text = (ROOT / path).read_text("utf-8")
            targets = {*linked(path, text).values()}
            for part, heading in PART.findall(text):
                if part == readme.__name__:
                    targets |= {*linked(README, section_of_readme(heading)).values()}
            new = {target for target in targets if (ROOT / target).is_file()} - seen
            seen |= new
            pending += new
    for path in sorted(seen):
        if not path.startswith("docs/"):
            page = File.generated(
                config, place(path), content=shown(path), inclusion=InclusionLevel.NOT_IN_NAV
            )
            files.append(page)
    files.append(File.generated(config, LIVE, content=make_index({})))
    for path in rendered():
        files.append(File.generated(config, f"reports/{path.name}", abs_src_path=str(path)))
    return files


def rendered() -> list[Path]:
    """The pages of the reports that did not fail, and their notebooks."""
    paths = sorted([*REPORTS.glob("*.html"), *REPORTS.glob("*.ipynb")])
    return [path for path in paths if not path.name.endswith(".partial.html")]


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let the keyboard reach tables, which scroll where they are wide."""
    return html.replace("<table>", '<table tabindex="0">')


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Fill in the parts made from the code, and turn links to where files are in the site."""
    if not page.file.src_uri.startswith("source/"):
        markdown = moved(f"docs/{page.file.src_uri}", markdown)
    return PART.sub(lambda match: PARTS[match[1]](*filter(None, [match[2]])), markdown)
