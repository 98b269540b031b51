"""The page of a question says what its missions say, from the command line and in Jupyter."""

import re
from html import unescape
from pathlib import Path
from typing import Any

import jupytext
import nbformat
import pytest
from nbclient import NotebookClient

from analysis import load_results, what_if
from analysis.findings import PRODUCT
from analysis.paper import METRICS
from reports import page
from reports.render import render
from tests.analysis.small import write_scenario
from tests.reports.small import EMBEDDED

NAME = "what-if"
SOURCE = Path(page.__file__).parent / "notebooks" / "what_if.py"
ASKED: dict[str, Any] = {
    "settings": {"uavs": 5, "pads": 2},
    "baseline": {"uavs": 2, "quota": 50},
    "policies": ["random", "greedy"],
    "missions": 12,
    "seed": 3,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("asked")


@pytest.fixture(scope="module")
def html(folder: Path) -> str:
    """The page, its missions flown into ``results``."""
    (folder / "results").mkdir()
    values = {**ASKED, "scenario": write_scenario(folder / "results").name}
    render([NAME], folder / "results", folder / "out", parameters=values)
    return (folder / "out" / f"{NAME}.html").read_text("utf-8")


@pytest.fixture(scope="module")
def results(folder: Path, html: str) -> Any:
    (made,) = (folder / "results" / NAME).iterdir()
    return load_results(made)


def text_of(html: str) -> str:
    """The words of a page, without its drawings and its code."""
    return words_of(html.split("<main")[1].split('<details class="code">')[0])


def words_of(html: str) -> str:
    """The words of a piece of a page."""
    shown = re.sub(r"<script.*?</script>", "", EMBEDDED.sub("", html), flags=re.S)
    return " ".join(unescape(re.sub(r"<[^>]+>", "", shown)).split())


def test_the_page_says_what_the_missions_say(html: str, results: Any) -> None:
    text = text_of(html)
    assert "What if a mission had uavs = 5 instead of 2 and pads = 2 instead of 6?" in text
    assert "with quota 50 in both" in text
    for answer in what_if.answers(results).itertuples():
        if answer.metric in METRICS:
            ends = (answer.difference, answer.low, answer.high)
            assert page.points(*ends) in text or 0 < answer.high - answer.low < 0.01
            assert page.percent(answer.before) in text and page.percent(answer.after) in text
        if answer.metric == PRODUCT:
            says = {
                what_if.HIGHER: f"is higher with {answer.policy}",
                what_if.LOWER: f"is lower with {answer.policy}",
                what_if.OPEN: f"cannot be told to differ with {answer.policy}",
            }
            given = what_if.verdict(answer)
            assert says.pop(given) in text
            assert not any(other in text for other in says.values())
            assert (f"{answer.policy} is undecided" in text) == (given == what_if.OPEN)
    assert "model card" not in text  # nobody of these has learned
    assert what_if.command(results) in text


def test_the_missions_shown_can_be_flown_again(html: str, results: Any) -> None:
    text = text_of(html)
    policy = what_if.best_policy(results, what_if.VARIATION)
    for replication in (what_if.typical(results, policy), what_if.worst(results, policy)):
        for point in (what_if.BASELINE, what_if.VARIATION):
            assert results.replay(policy, point, replication) in text


def test_the_page_is_whole(html: str, folder: Path) -> None:
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", html, re.S)
    assert len(captions) == html.count("<figure>") == html.count("<img ") == 3 + 2 + 4
    assert all(re.search(r"\bn = [\d,]+\b", c) and "interval" in c for c in captions)
    assert not re.search(
        r"Traceback|Warning|stderr|Figure\(|\bnan\b|NaN|\binf\b|None", text_of(html)
    )
    assert str(folder) not in html and str(SOURCE.parents[2]) not in html


def test_in_jupyter_it_runs_from_top_to_bottom_and_says_the_same(
    html: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Elsewhere, with missions flown anew, every figure and table is what the page has."""
    monkeypatch.setenv("TZ", "Pacific/Auckland")
    monkeypatch.setenv("PYTHONHASHSEED", "7")
    book = jupytext.read(SOURCE)
    (tagged,) = (c for c in book.cells if "parameters" in c.metadata.get("tags", []))
    values = {**ASKED, "results": "kept", "scenario": write_scenario(tmp_path).name}
    tagged.source += "".join(f"\n{name} = {value!r}" for name, value in values.items())
    jupytext.write(book, tmp_path / "what_if.ipynb")
    book = nbformat.read(tmp_path / "what_if.ipynb", as_version=4)
    run = NotebookClient(book, resources={"metadata": {"path": str(tmp_path)}}).execute()
    cells = [cell for cell in run.cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in cells)
    outputs = [output for cell in cells for output in cell.outputs]
    assert {output.output_type for output in outputs} <= {"display_data", "execute_result"}
    shown = [output.data["text/html"] for output in outputs if "text/html" in output.data]
    assert len(shown) == 1 + 2 + 2 + 1 + 2 + 1
    assert EMBEDDED.findall("".join(shown)) == EMBEDDED.findall(html)
    assert [piece for piece in shown if words_of(piece) not in text_of(html)] == []
    (made,) = (tmp_path / "kept" / NAME).iterdir()
    assert load_results(made).missions["policy"].unique().tolist() == ASKED["policies"]
