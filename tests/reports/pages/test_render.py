"""Reports are whole pages of their own, the same whenever they are made, or a clear line."""

import json
import os
import re
import shutil
from base64 import b64decode
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jupytext
import nbformat
import pytest
from nbclient import NotebookClient

from dess.errors import InputError
from policies.registry import trained_names
from reports.pages import kernels
from reports.pages import render as module
from reports.pages.html import STUDY, embedded
from reports.pages.notebook import NAMES, read
from reports.pages.render import ReportError, render
from reports.player import library
from tests.reports.browser import Visit
from tests.reports.small import EMBEDDED, Links, run_small_studies, words_of

READS = jupytext.reads
# Parameters of what would take long: missions of what-if, flights of verification.
QUICK = {"missions": 40, "again": 4}
# The width of the text on A4 [px], and what of a page goes beyond a width.
A4 = 688
BEYOND = """[...document.querySelectorAll("main *")].filter(
    e => e.getBoundingClientRect().right > {} + 1).map(e => e.outerHTML.slice(0, 80))"""
# The drawings of every page, by the small results.
FIGURES = {
    "mission": 4,
    "performance": 8,
    "learning": 7 + len(trained_names()),
    "parameters": 9,
    "comparison": 12,
    "what-if": 9,
    "verification": 13,
    "scorecard": 0,
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Small results of all studies that the reports read."""
    return run_small_studies(tmp_path_factory.mktemp("results"))


@pytest.fixture(scope="module")
def progress() -> list[tuple[int, int, str]]:
    return []


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("out") / "deep" / "reports"


@pytest.fixture(scope="module")
def pages(
    results: Path, out: Path, progress: list[Any], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, str]:
    """All files of the reports, rendered once, by name."""
    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(home))
        index = render([], results, out, lambda *step: progress.append(step), QUICK)
    assert index == out / "index.html"
    assert not list(home.glob(".ipython")) + list(home.glob(".jupyter")) + list(home.glob(".local"))
    return {path.name: path.read_text("utf-8") for path in out.iterdir()}


def test_all_pages_are_there_and_nothing_else(pages: dict[str, str]) -> None:
    files = {f"{name}.{kind}" for name in NAMES for kind in ("html", "ipynb")}
    assert {*pages} == files | {"index.html"}


def html_of(pages: dict[str, str]) -> dict[str, str]:
    return {name: text for name, text in pages.items() if name.endswith(".html")}


def test_pages_load_nothing(pages: dict[str, str]) -> None:
    for name, html in html_of(pages).items():
        links = Links(html)
        assert not {"link", "iframe", "object"} & links.tags
        for target in links.found:
            page, _, section = target.partition("#")
            if not target.startswith("data:image/svg+xml;base64,"):
                assert page in {"", *pages}
                assert not section or f'id="{section}"' in pages[page or name]
        drawings = [b64decode(data) for data in EMBEDDED.findall(html)]
        for drawing in drawings:
            assert set(re.findall(rb'href="(.)', drawing)) == {b"#"}
        assert not re.search(r"//[a-z]|url\(|@import", links.outside_scripts)


def test_pages_tell_no_places_and_no_times(pages: dict[str, str], results: Path) -> None:
    for html in pages.values():
        html = html.replace(library().data, "")
        assert str(results) not in html
        assert str(Path(module.__file__).parents[1]) not in html
        assert not re.search(r"\b\d\d:\d\d:\d\d\b|\b20\d\d-\d\d-\d\d\b", html)


def test_pages_show_results_and_no_mishaps(pages: dict[str, str]) -> None:
    assert pages["index.html"].count('<a class="card"') == len(NAMES) - 1
    (scorecard,) = re.findall('<section id="scorecard">.*?</section>', pages["index.html"], re.S)
    assert scorecard in pages["scorecard.html"]
    assert scorecard.count('<tr class="claim">') >= 15
    for name in NAMES:
        html = pages[f"{name}.html"]
        assert html.count("<img ") == FIGURES[name]
        words = words_of(html)
        assert not re.search(r"Traceback|Warning|stderr|<Figure|Figure\(|NaN|\bnan\b|None", words)


def test_every_figure_has_a_caption_with_its_number(pages: dict[str, str]) -> None:
    for name in NAMES:
        html = pages[f"{name}.html"]
        captions = re.findall(r"<figcaption>(.*?)</figcaption>", html, re.S)
        assert len(captions) == len(re.findall("<figure", html))
        assert all(re.search(r"\bn\b", caption) for caption in captions), name


def test_the_performance_page_tells_the_means(pages: dict[str, str], results: Path) -> None:
    from analysis import load_results, summary

    rows = summary(load_results(results / "table4").missions)
    for _, row in rows[rows["metric"] != "reward"].iterrows():
        shown = f"{row['mean']:.1%}".replace("%", " %")
        text = f"{shown} [{100 * row['low']:.1f}, {100 * row['high']:.1f}]"
        assert text in pages["performance.html"]


def test_names_have_their_index_in_text_and_nowhere_else() -> None:
    html = module._with_indices('<img alt="C_S"><p>C_S, DC_S</p><pre><b>C_C</b></pre>C_C<!-- -->')
    assert html == (
        '<img alt="C_S"><p>C<sub>S</sub>, DC_S</p><pre><b>C_C</b></pre>C<sub>C</sub><!-- -->'
    )


def test_progress_counts_the_cells(pages: dict[str, str], progress: list[Any]) -> None:
    total = sum(len(read(name).cells) for name in NAMES)  # and those with parameters
    assert [done for done, _, _ in progress] == list(range(1, len(progress) + 1))
    assert total < len(progress) == progress[0][1] <= total + len(NAMES)
    assert {name for *_, name in progress} == {*NAMES}


def elsewhere(results: Path, out: Path, folder: Path, patch: pytest.MonkeyPatch) -> Path:
    """Copies of results and pages, as they lie to each other, in another world."""
    for name, value in {"TZ": "Pacific/Auckland", "PYTHONHASHSEED": "7", "LC_ALL": "C"}.items():
        patch.setenv(name, value)
    patch.chdir(folder)
    shutil.copytree(results, folder / results.name)
    return shutil.copytree(out, folder / out.relative_to(results.parent))


def test_the_same_results_give_the_same_bytes(
    pages: dict[str, str],
    results: Path,
    out: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A page that is made again, and the index with those of earlier calls."""
    again = elsewhere(results, out, tmp_path, monkeypatch)
    (again / "performance.html").unlink()
    render(["performance"], tmp_path / results.name, again, parameters={})
    for name in ("performance.html", "index.html"):
        assert (again / name).read_text("utf-8") == pages[name]


@pytest.mark.slow
def test_all_pages_are_the_same_bytes_elsewhere(
    pages: dict[str, str],
    results: Path,
    out: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    elsewhere(results, out, tmp_path, monkeypatch)
    shutil.rmtree(tmp_path / results.name / "what-if")  # its missions are flown anew
    render([], tmp_path / results.name, tmp_path / "new", parameters=QUICK)
    for name, html in html_of(pages).items():
        assert (tmp_path / "new" / name).read_text("utf-8") == html


# By default one that is run quickly.
IN_JUPYTER = [
    name if name == "performance" else pytest.param(name, marks=pytest.mark.slow) for name in NAMES
]


@pytest.mark.parametrize("name", IN_JUPYTER)
def test_notebooks_run_in_jupyter_and_show_what_the_pages_show(
    pages: dict[str, str],
    results: Path,
    out: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
) -> None:
    """From top to bottom, from a results folder, where they lie beside the pages."""
    again = elsewhere(results, out, tmp_path, monkeypatch)
    notebook = nbformat.read(again / f"{name}.ipynb", as_version=4)
    nbformat.validate(notebook)
    assert notebook.cells.pop(0).source.startswith("# ")
    NotebookClient(notebook, resources={"metadata": {"path": str(again)}}).execute()
    assert all(cell.execution_count for cell in notebook.cells if cell.cell_type == "code")
    assert module._body(notebook) in pages[f"{name}.html"]


def test_every_page_carries_what_it_was_made_with(pages: dict[str, str], results: Path) -> None:
    from analysis import load_results

    for name in NAMES:
        carried = [json.loads(text) for text in embedded(STUDY, pages[f"{name}.html"])]
        studies = read(name).studies
        assert [e["study"] for e in carried][: len(studies)] == studies
        for evidence in carried[: len(studies)]:
            manifest = load_results(results / evidence["study"]).store.manifest
            assert evidence["key"] == manifest.key
            for field in ("commit", "version", "libraries", "seed", "scenario"):
                assert evidence[field] == manifest.data[field]
            assert evidence["policies"] == manifest.data["policies"]
            assert manifest.key in words_of(pages[f"{name}.html"])


@pytest.mark.parametrize("width", [pytest.param(1280, marks=pytest.mark.slow), 390])
def test_pages_fit_the_window_and_request_nothing(
    visit: Callable[[Path, int], Visit], pages: dict[str, str], out: Path, width: int
) -> None:
    for name in html_of(pages):
        opened = visit(out / name, width)
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= width
        assert opened.requests == [(out / name).as_uri()]
        assert opened.complaints == []


def test_pages_fit_the_paper(
    visit: Callable[[Path, int], Visit], pages: dict[str, str], out: Path
) -> None:
    for name in html_of(pages):
        page = visit(out / name, A4).page
        page.emulate_media(media="print")
        assert page.evaluate(BEYOND.format(A4)) == [], name


def test_a_mission_is_played_in_its_page(
    visit: Callable[[Path, int], Visit], pages: dict[str, str], out: Path
) -> None:
    opened = visit(out / "mission.html", 1280)
    label = "document.querySelector('#player-3 .slider-label').textContent"
    play = opened.page.locator("#player-3 .updatemenu-button").filter(has_text="Play")
    play.wait_for()
    assert opened.page.evaluate(label) == "slot 0"
    play.click()
    opened.page.wait_for_function(f"Number({label}.split(' ')[1]) >= 3")
    assert opened.requests == [(out / "mission.html").as_uri()]
    assert opened.complaints == []


def test_an_unknown_report_is_refused(results: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="report: 'nothing' is unknown; allowed: mission, perf"):
        render(["nothing"], results, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_missing_results_are_named_with_the_command_that_makes_them(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        render(["performance"], tmp_path, tmp_path / "out")
    folder = tmp_path / "table4"
    assert f"dess study run table4 --out {folder}" in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_results_of_another_study_are_refused(results: Path, tmp_path: Path) -> None:
    (tmp_path / "table4").symlink_to(results / "fig4")
    with pytest.raises(InputError, match="table4 holds study fig4; allowed: table4"):
        render(["performance"], tmp_path, tmp_path / "out")


def test_a_folder_that_cannot_be_written_is_refused(results: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="out: .*file.* cannot be written"):
        render(["mission"], results, tmp_path / "file" / "out")


@pytest.mark.parametrize("name", ["speed", "results"])
def test_an_unknown_parameter_is_refused(results: Path, tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=f"parameter: '{name}' is unknown to mission"):
        render(["mission"], results, tmp_path / "out", parameters={name: 1})


def test_parameters_follow_the_cell_that_they_override() -> None:
    report = read("mission")
    (before,) = [n for n, cell in enumerate(report.notebook.cells) if cell.metadata.get("tags")]
    report.set({"results": "here", "policy": "tour", "other": 1})
    assert report.notebook.cells[before + 1].source == "results = 'here'\npolicy = 'tour'"


@pytest.mark.parametrize("name", NAMES)
def test_notebooks_have_a_heading_and_a_description(name: str) -> None:
    report = read(name)
    assert report.title and "#" not in report.title
    assert len(report.description.split()) > 10


@pytest.mark.parametrize(("deaths", "runs"), [(1, 2), (2, 2)])
def test_a_kernel_that_dies_at_its_start_gets_one_more_try(
    results: Path, monkeypatch: pytest.MonkeyPatch, deaths: int, runs: int
) -> None:
    tries = []

    def die(client: Any, _: Any) -> None:
        tries.append(client)
        if len(tries) <= deaths:
            raise RuntimeError("Kernel died before replying to kernel_info")

    monkeypatch.setattr(kernels, "_run", die)
    report = read("mission")
    kernels.Kernels(results).run([report])
    assert len(tries) == runs
    assert bool(report.failure) == (deaths > 1)
    if report.failure:
        assert re.match(r"report mission: cell 1 of \d+ \(.*\): Kernel died", report.failure)


def test_a_kernel_that_dies_in_a_cell_gets_no_other_try(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = FAILING.replace("raise", "import os; os._exit(1) #")
    monkeypatch.setattr(jupytext, "reads", lambda *_, **__: READS(source, fmt="py:percent"))
    with pytest.raises(ReportError, match=r"^report mission: cell 4 of 5 \(import os.*Kernel died"):
        render(["mission"], results, tmp_path)


FAILING = """# ---
# jupyter:
#   dess:
#     studies: [fig4]
# ---

# %% [markdown]
# # Failing
#
# It fails.

# %% tags=["parameters"]
results = "."

# %%
"as far as here"

# %%
raise ArithmeticError("no such number")

# %%
"but not so far"
"""


def test_a_failing_notebook_leaves_a_partial_page_and_names_the_cell(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mission.html").write_text("before")
    other = FAILING.replace("# Failing", "# Fine").replace("raise ArithmeticError", "print")
    sources = {read("mission").source: FAILING, read("performance").source: other}
    monkeypatch.setattr(
        jupytext, "reads", lambda text, **how: READS(sources.get(text, text), **how)
    )
    with pytest.raises(ReportError) as caught:
        render(["mission", "performance"], results, tmp_path)
    partial = tmp_path / "mission.partial.html"
    assert str(caught.value) == (
        'report mission: cell 4 of 5 (raise ArithmeticError("no such number")): '
        f"ArithmeticError: no such number; as far as it went: {partial}"
    )
    words = words_of(partial.read_text("utf-8"))
    assert "This page is incomplete. report mission: cell 4 of 5" in words
    assert "as far as here" in words and "but not so far" not in words
    assert (tmp_path / "mission.html").read_text() == "before"  # nothing whole is lost
    assert "but not so far" in words_of((tmp_path / "performance.html").read_text("utf-8"))
    sources[read("mission").source] = other
    render(["mission"], results, tmp_path)
    assert not partial.exists() and "but not so far" in (tmp_path / "mission.html").read_text()


def test_a_notebook_that_refuses_its_input_leaves_nothing(results: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="^report mission: policy: 'nobody' is not in the study"):
        render(["mission"], results, tmp_path / "a" / "out", parameters={"policy": "nobody"})
    assert os.listdir(tmp_path) == []
