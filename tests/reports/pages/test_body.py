"""The page of a notebook: sections, numbered figures, explained terms, the answer apart."""

import re
from html import unescape

import nbformat
import pandas as pd
import pytest
from IPython.display import HTML, DisplayObject
from matplotlib.figure import Figure
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from dess import load_scenario
from dess.reports.pages.body import FOLDED, TERMS, make_page
from dess.reports.pages.notebook import Report
from dess.reports.pages.page import Page
from dess.reports.pages.panel import make_another, make_panel
from dess.reports.pages.parts import PART, Part, make_answer, make_figure, make_gallery
from dess.reports.pages.tables import make_table
from dess.reports.pages.templates import PANEL_SCRIPT, panel_hash


def page(*cells: str | DisplayObject) -> Page:
    """The page of a notebook with cells that show Markdown, parts, or HTML."""
    notebook = new_notebook(cells=[new_code_cell("x = 1", metadata={"tags": ["parameters"]})])
    for cell in cells:
        if isinstance(cell, DisplayObject):
            data = {PART: cell.values} if isinstance(cell, Part) else {"text/html": cell.data}
            shown = new_code_cell("1", outputs=[new_output("display_data", data)])
            notebook.cells.append(shown)
        else:
            notebook.cells.append(new_markdown_cell(cell))
    nbformat.validate(notebook)
    return make_page(Report("test", "A title", "About it.", [], [], False, notebook, notebook))


def main_of(*cells: str | DisplayObject) -> str:
    """The page below its header."""
    return page(*cells).text.split("<main>")[1].split('<details class="code">')[0]


def figure() -> Part:
    return make_figure(Figure(figsize=(1, 1)), "a", "n = 3.")


def gallery() -> Part:
    return make_gallery([(Figure(figsize=(1, 1)), "a", "n = 4.")] * 2, "A note.")


def test_the_answer_stands_in_the_header_and_on_the_card():
    found = page("text", make_answer("The **product** is 4 % & more.", "4 %"))
    meaning = TERMS["product"]
    explained = f'<a class="term" href="#term-product" title="{meaning}">product</a>'
    assert f'<p class="lead">The {explained} is 4 % &amp; more.</p>' in found.text
    main = found.text.split("<main>")[1]
    assert "more" not in main
    # A reader without a mouse follows the link, and one of the paper finds it at the end.
    assert f'<div id="term-product"><dt>product</dt><dd>{meaning}</dd></div>' in main
    assert (found.card.finding, found.card.number) == ("The product is 4 % & more.", "4 %")
    without = page("text")
    assert without.card.finding == "About it." and '<p class="lead">About it.</p>' in without.text


def test_figures_have_numbers_and_anchors_on_the_page_alone():
    found = main_of(figure(), gallery())
    assert re.findall('<figure id="(figure-.)">', found) == ["figure-1", "figure-2", "figure-3"]
    assert re.findall(r'href="#(figure-.)">Figure (.)</a> n = .', found) == [
        ("figure-1", "1"), ("figure-2", "2"), ("figure-3", "3"),
    ]  # fmt: skip
    assert '</div>\n<p class="note">A note.</p>' in found
    in_jupyter = gallery().data
    assert in_jupyter.count("<figcaption>n = 4.") == 2 and "Figure" not in in_jupyter


def test_second_level_headings_make_sections_and_the_method_is_folded():
    parts = ("## Why\n\ntext one", "## Tables & C_S", HTML("<table></table>"))
    whole = page(*parts, f"## {FOLDED}\n\ntext two").text
    listed = re.findall('<a href="#(.*)">(.*)</a>', whole.split("<main>")[0])
    assert [title for _, title in listed] == ["Why", "Tables &amp; C<sub>S</sub>", FOLDED]
    found = whole.split("<main>")[1]
    assert all(f'<section id="{anchor}">' in found for anchor, _ in listed)
    assert found.index("text one") < found.index("<table>") < found.index("two")
    folded = re.findall("<details>.*?</details>", found, re.S)[0]
    assert "two" in folded and "one" not in folded and "<table>" not in folded


def test_the_text_of_a_section_stands_beside_its_only_figure():
    assert 'class="beside"' in main_of("## Why\n\ntext one", figure())
    assert 'class="beside"' not in main_of("## Why\n\ntext one", figure(), figure())
    assert 'class="beside"' not in main_of("## Why", figure(), "## Next\n\ntext")


def test_a_term_is_explained_once_and_only_in_text():
    text = "text: the return guard, the return guard, a `product`"
    found = main_of(text, HTML("<pre>product</pre>"))
    meaning = TERMS["return guard"]
    explained = f'<a class="term" href="#term-return-guard" title="{meaning}">return guard</a>'
    assert found.count(explained) == 1
    assert found.count("<a ") == 1
    assert found.count("<dt>") == 1


def test_no_link_contains_another():
    found = main_of("[the product](other.html), then a product")
    assert '<a href="other.html">the product</a>, then a <a class="term"' in found


def test_numbers_stand_on_their_decimal_points_and_intervals_do_not_break():
    means = ["100.0 % [99.1, 100.0]", "8.5 % [8, 9] ▲", "1,000", "none", "−8.5"]
    shown = make_table(pd.DataFrame({"policy": ["a"] * 5, "mean": means})).data
    indents = [style or "0" for style in re.findall('<td(?: style="--indent:([\\d.]+)")?>', shown)]
    assert indents[1::2] == ["1.5", "3.5", "0", "0", "2.5"]
    assert "8.5\xa0% [8,\xa09]\xa0▲" in shown


def test_thresholds_have_indices_but_in_code():
    found = main_of("C_S, DC_S, C_C\n\n```\nC_C\n```")
    assert "<p>C<sub>S</sub>, DC_S, C<sub>C</sub></p>" in found
    assert '<pre tabindex="0"><code>C_C' in found


def test_a_cell_of_sentences_has_a_wide_column_and_keeps_intervals_together():
    cells = {"mean": ["97.4 % [96.5, 97.7]"], "guarantee": ["it is the best. " * 12]}
    shown = make_table(pd.DataFrame(cells), wrap=True).data
    assert "<td>97.4\xa0% [96.5,\xa097.7]</td>" in shown
    assert shown.count('<td class="long">it is the best. it') == 1


@pytest.mark.parametrize("make", [make_panel, make_another])
def test_a_browser_runs_the_script_of_what_simulates_and_no_other(make):
    """A page need not say that it has one, so no page can forget it."""
    paper = load_scenario("paper")
    spaces = (paper, paper) if make is make_panel else (paper,)
    policy = unescape(page(make(*spaces, "paper", ["greedy"], 1)).text)
    assert f"script-src 'sha256-{panel_hash(PANEL_SCRIPT)}' 'wasm-unsafe-eval'" in policy
    assert "script-src" not in page("text").text
