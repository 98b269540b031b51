"""Pages of results that somebody made to harm their reader: no name in them is ever markup."""

import json
import re
import shutil
from html import unescape

import matplotlib as mpl
import pandas as pd
import pytest
from nbconvert.filters import markdown2html

from dess.analysis import load_results, numbers
from dess.analysis.figures import style
from dess.reports.pages.figures import encode_figure
from dess.reports.pages.index import add_bars, find_pages, make_index, render_example
from dess.reports.pages.markdown import command_block, escape_sentences, format_code, write_markdown
from dess.reports.pages.notebook import assigned_values, replace_values
from dess.reports.pages.page import CARD, Page
from dess.reports.pages.render import render_study
from tests.analysis.hostile import hostile_folder
from tests.reports.here import notebooks_here
from tests.reports.small import Links

ATTACK = (
    "<script>window.hit=1</script><img src=x onerror=window.hit=1>\"'[x](javascript:window.hit=1)"
    "![y](http://example.org/y.png) `*__a__|$\\foo$ {x} </h1>-->]]>"
)
# One of these in a name is enough to change how Markdown reads the rest.
NAMES = [
    *(ATTACK, "<b>", "&lt;b&gt;", "`a` b", "**a** _b_ ~~c~~", "[a](b)", "[a]: b", "![a](b)"),
    *("<https://example.org>", "https://example.org", "$a$ $$b$$", "\\[a\\]", "{x.__class__}"),
    *("# a", "- a", "1. a", "> a", "=== a", "a\n\n# b", "a\n---", "```\na", "a | b"),
]
HARMLESS = r"</?(p|strong|em|del|code|pre|ul|ol|li|h[1-6]|blockquote|hr|br)( /)?>"


@pytest.fixture(scope="module")
def page(studied, tmp_path_factory):
    """The page of a study all of whose free strings are an attack."""
    folder = tmp_path_factory.mktemp("hostile")
    made = hostile_folder(studied().store.folder, folder / "made", ATTACK)
    with notebooks_here(is_drawn=True):
        return render_study(load_results(made), folder / "out")


def test_a_hostile_study_is_text_on_its_page_and_in_the_index(page):
    for name in (page.name, "index.html"):
        found = Links((page.parent / name).read_text("utf-8"))
        # The index names nothing but the page: the origins of results stand there.
        shown = unescape(found.outside_scripts)
        assert shown.count(ATTACK) >= 2 if name == page.name else page.name in found.found
        assert not found.tags & {"iframe", "object", "form", "base", "link"}
        inside = re.compile(r"data:|[\w-]+\.(html|ipynb)$|#[\w-]+$|$")
        assert [link for link in found.found if not inside.match(link)] == []
        images = re.findall("<img[^>]*>", found.outside_scripts)
        assert all(re.fullmatch('<img alt="[^"<>]*" src=""/?>', i) for i in images)
        assert images or name == "index.html"


def test_a_hostile_page_runs_nothing(page, visit):
    for name in (page.name, "index.html"):
        opened = visit(page.parent / name, 1000)
        assert opened.page.evaluate("window.hit") is None
        assert opened.requests == [(page.parent / name).as_uri()]
        assert opened.complaints == []
        widths = opened.page.evaluate("[...document.images].map((image) => image.naturalWidth)")
        assert all(widths)


def test_a_script_in_a_page_without_scripts_does_not_run(page, tmp_path, visit):
    """The second wall: even markup that was not escaped."""
    markup = "<script>window.hit=1</script><img src='http://example.org/' onerror='window.hit=1'>"
    path = tmp_path / "page.html"
    path.write_text(page.read_text("utf-8").replace("</main>", f"{markup}</main>"), "utf-8")
    opened = visit(path, 1000)
    assert opened.page.evaluate("window.hit") is None
    # About the script, the image and its handler.
    assert len(opened.complaints) == 3
    assert all("Content Security Policy" in complaint for complaint in opened.complaints)


def test_the_index_takes_no_markup_from_a_forged_page(page, tmp_path):
    """Not even if its seal is right."""
    out = tmp_path / "out"
    shutil.copytree(page.parent, out)
    (card,) = Page.read(page).find_hidden(CARD)
    picture = dict.fromkeys(("alt", "source", "narrow"), ATTACK)
    fields = dict.fromkeys(("title", "finding", "number"), ATTACK) | {"picture": picture}
    inert = json.dumps(fields).replace("<", "\\u003c")
    forged = Page(page.read_text("utf-8").replace(card, inert)).sealed
    for name in ("study-forged.html", "scorecard.html", "performance.html"):
        (out / name).write_text(forged.text, "utf-8")
    pages = add_bars(find_pages(out))
    assert all(unescape(shown.text).count(ATTACK) >= 4 for shown in pages.values())
    index = make_index(pages).replace(render_example(), "")  # whose script alone is run
    assert unescape(index).count(ATTACK) >= 9 and "<script>" not in index
    images = re.findall("<img[^>]*>", index)
    assert images and all(re.fullmatch('<img alt="[^"<>]*" src="[^"<>]*">', i) for i in images)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_in_markdown_is_text(name):
    line = " ".join(name.split())
    shown = markdown2html(
        write_markdown("A {name} and {code}.", name=name, code=format_code(name)).data
    )
    assert {*re.findall("<[^>]*>", shown)} == {"<p>", "</p>", "<code>", "</code>"}
    assert unescape(re.sub("<[^>]*>", "", shown)).strip() == f"A {line} and {line}."
    assert (
        unescape(markdown2html(write_markdown("{name}", name=name).data)).strip()
        == f"<p>{line}</p>"
    )


@pytest.mark.parametrize("name", NAMES)
def test_composed_markdown_has_neither_html_nor_links(name):
    line = " ".join(name.split())
    shown = markdown2html(
        write_markdown("{text}", text=escape_sentences(f"- **{line}**: `{line}`")).data
    )
    assert "<" not in re.sub(HARMLESS, "", shown)


def test_a_block_of_commands_cannot_be_left():
    lines = ["a", "```", "<b>", "`````"]
    shown = markdown2html(write_markdown("{lines}", lines=command_block(lines)).data)
    assert shown.count("<pre>") == 1
    assert unescape(re.sub("<[^>]*>", "", shown)).split() == lines


@pytest.mark.parametrize("name", ["$\\foo$", "$", "a$b$c", "\\$x"])
def test_a_name_is_no_formula_in_a_figure(name):
    with style.new_panels(3) as (drawing, axes):
        axes.plot([1, 2], label=name)
        axes.set_title(name)
    assert encode_figure(drawing, "svg")
    assert mpl.rcParams["text.parse_math"]


def test_a_name_is_no_formula_in_a_spreadsheet():
    names = ["=1+1", "+1", "-1", "@x", "\t=1", "a=1", "a"]
    rows = numbers.write_csv(pd.DataFrame({"policy": names, "mean": -1.5})).splitlines()[1:]
    assert [row.startswith("'") for row in rows] == [True] * 5 + [False] * 2
    assert all(row.endswith(",-1.5") for row in rows)


@pytest.mark.parametrize("name", [*NAMES, "'''\nimport os\n'''", '"\\', "\ud800", "a\0b"])
def test_a_parameter_cannot_become_code(name):
    source = replace_values("policy = 'greedy'  # the policy\nseed = 0", {"policy": name})
    assert assigned_values(source) == {"policy": name, "seed": 0}
    assert source.count("\n") == 1
