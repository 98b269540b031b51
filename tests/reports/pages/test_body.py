"""The body of a page: sections, numbered figures, explained terms, the answer apart."""

import re

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from reports.pages.body import FOLDED, TERMS, Body
from reports.pages.index import Card


def body(*cells: str) -> Body:
    """The body of a notebook with HTML outputs, and with Markdown where a cell begins with #."""
    notebook = new_notebook()
    notebook.cells = [
        new_markdown_cell(cell)
        if cell.startswith(("#", "text"))
        else new_code_cell("1", outputs=[new_output("display_data", {"text/html": cell})])
        for cell in cells
    ]
    nbformat.validate(notebook)
    return Body.of(notebook)


FIGURE = '<figure><img alt="a" src=""><figcaption>n = 3.</figcaption></figure>'


def test_the_answer_moves_out_of_the_text() -> None:
    found = body('<p class="answer" data-number="4 %">It is 4 % &amp; more.</p>', "<p>rest</p>")
    assert (found.answer, found.number) == ("It is 4 % &amp; more.", "4 %")
    assert "more" not in found.html and "rest" in found.html
    assert body("<p>rest</p>").answer == ""


def test_the_answer_explains_a_term_where_it_stands_first() -> None:
    found = body('<p class="answer">The product is 4 %.</p>', "<p>a product</p>")
    assert f'<abbr title="{TERMS["product"]}">product</abbr>' in found.answer
    assert "abbr" not in found.html
    page = f'<h1>A</h1><p class="lead">{found.answer}</p>'
    assert Card.of("a.html", page).finding == "The product is 4 %."


def test_figures_have_numbers_and_anchors() -> None:
    found = body(FIGURE, f'<div class="gallery">{FIGURE}{FIGURE}</div>').html
    assert re.findall('<figure id="(figure-.)">', found) == ["figure-1", "figure-2", "figure-3"]
    assert re.findall('href="#(figure-.)">Figure (.)</a> n = 3', found) == [
        ("figure-1", "1"), ("figure-2", "2"), ("figure-3", "3"),
    ]  # fmt: skip


def test_second_level_headings_make_sections_and_the_method_is_folded() -> None:
    found = body("## Why\n\ntext one", "## Tables", "<table></table>", f"## {FOLDED}\n\ntext two")
    assert [*found.sections.values()] == ["Why", "Tables", FOLDED]
    assert all(f'<section id="{anchor}">' in found.html for anchor in found.sections)
    assert found.html.index("text one") < found.html.index("<table>") < found.html.index("two")
    (folded,) = re.findall("<details>.*</details>", found.html, re.S)
    assert "two" in folded and "one" not in folded and "<table>" not in folded


def test_the_text_of_a_section_stands_beside_its_only_figure() -> None:
    assert 'class="beside"' in body("## Why\n\ntext one", FIGURE).html
    assert 'class="beside"' not in body("## Why\n\ntext one", FIGURE, FIGURE).html


def test_a_term_is_explained_once_and_only_in_text() -> None:
    found = body("text: the return guard, the return guard, a `product`", "<pre>product</pre>").html
    assert found.count(f'<abbr title="{TERMS["return guard"]}">return guard</abbr>') == 1
    assert found.count("<abbr") == 1


def test_thresholds_have_indices_but_in_code() -> None:
    found = body('<p title="C_S">C_S, DC_S, C_C</p><pre>C_C</pre>').html
    text, kept = found.split("<pre", 1)
    assert text == '<p title="C_S">C<sub>S</sub>, DC_S, C<sub>C</sub></p>'
    assert kept == ' tabindex="0">C_C</pre>'
