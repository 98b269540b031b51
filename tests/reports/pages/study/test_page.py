"""A results folder of any study has a page, with the data of its figures and tables."""

import csv
import io
import re
from base64 import b64decode
from html.parser import HTMLParser
from pathlib import Path

import pandas as pd
import pytest

from dess.analysis import load_results
from dess.reports.pages.downloads import format_latex
from dess.reports.pages.page import STUDY, Page
from dess.reports.pages.render import render_study
from tests.analysis.small import files_of, grid
from tests.reports.here import notebooks_here
from tests.reports.small import Links


class Downloads(HTMLParser):
    """The files that a page holds, by name: the label of the link, the type and the text."""

    def __init__(self, page):
        super().__init__()
        self.files = {}
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        of_tag = dict(attrs)
        if "download" in of_tag:
            kind, text = of_tag["href"].removeprefix("data:").split(";charset=utf-8;base64,")
            assert of_tag["download"] not in self.files
            label = of_tag["aria-label"]
            self.files[of_tag["download"]] = (label, kind, b64decode(text).decode())


@pytest.fixture(scope="module")
def folder(studied):
    """Results of a grid of two fields."""
    fleets = grid(uavs=[1, 2, 3], pads=[1, 2])
    return studied(design=fleets, missions=12, description="How many UAVs & pads?").store.folder


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("pages") / "deep"


@pytest.fixture(scope="module")
def page(folder, out):
    """The page, rendered once."""
    with notebooks_here(is_drawn=True):
        assert render_study(load_results(folder), out) == out / "study-trial.html"
    return (out / "study-trial.html").read_text("utf-8")


@pytest.fixture(scope="module")
def downloads(page):
    return Downloads(page).files


def test_there_are_a_page_a_notebook_and_an_index_with_a_card(page, out):
    assert {*files_of(out)} == {"study-trial.html", "study-trial.ipynb", "index.html"}
    index = (out / "index.html").read_text("utf-8")
    assert '<a class="card" href="study-trial.html">' in index
    for text in (page, index):
        assert (
            "Which number of UAVs and number of charging pads are the best on the sea small?"
            in text
        )
        assert "The best is " in text
    assert len(Page(page).find_hidden(STUDY)) == 1
    assert Page(index).find_hidden(STUDY) == []  # it stands on the page


def test_every_figure_and_table_has_its_data(page, downloads):
    stored = re.sub('<section id="panel".*?</section>', "", page, flags=re.S)
    tables = stored.split("How this page was made</h2>")[0].count("<table")
    assert len(downloads) == 2 * (page.count("<img ") + tables)
    assert {kind for _, kind, _ in downloads.values()} == {"text/csv", "application/x-tex"}
    for name, (label, _, text) in downloads.items():
        assert label.endswith((": CSV", ": LaTeX"))
        if name.endswith(".csv"):
            rows = [*csv.reader(io.StringIO(text))]
            assert len(rows) > 1 and len({*map(len, rows)}) == 1
        else:
            assert r"\toprule" in text and text.isascii()


def test_it_requests_nothing_and_fits_a_phone(page, out, visit):
    opened = visit(out / "study-trial.html", 390)
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= 390
    assert opened.requests == [(out / "study-trial.html").as_uri()]
    assert opened.complaints == []
    with opened.page.expect_download() as started:
        link = opened.page.get_by_label(re.compile("^The first 12 of 12 settings.*: CSV$"))
        link.focus()
        opened.page.keyboard.press("Enter")
    assert Path(started.value.path()).read_text("utf-8").startswith("rank,policy,point,")
    assert "index.html" in Links(page).found


# --- files with data ---


def test_latex_has_what_the_table_has_and_no_letter_that_it_lacks():
    frame = pd.DataFrame({"C_S [%]": ["5–7", "−1 & ▲"], "a_b": [1 / 3, float("nan")]})
    assert format_latex(frame).split("\n")[2:6] == [
        r"$C_S$ [\%] & a\_b \\",
        r"\midrule",
        r"5--7 & 0.333333 \\",
        r"$-$1 \& $\triangle$ &  \\",
    ]
