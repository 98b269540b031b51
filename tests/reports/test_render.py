"""Reports are whole pages of their own, the same whenever they are made, or a clear line."""

import os
import re
from base64 import b64decode
from contextlib import nullcontext
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import jupytext
import pytest

from analysis import load_study, run_study
from dess.errors import InputError
from reports import render as module
from reports.render import ReportError, render, report_names

NAMES = ["mission", "performance"]
READS = jupytext.reads
EMBEDDED = re.compile("data:image/svg\\+xml;base64,([A-Za-z0-9+/=]+)")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Small results of the two studies."""
    folder = tmp_path_factory.mktemp("results")
    run_study(load_study("table4", missions=40, policies=["random", "greedy"]), folder / "table4")
    run_study(load_study("fig4", missions=8, policies=["random", "greedy"]), folder / "fig4")
    return folder


@pytest.fixture(scope="module")
def progress() -> list[tuple[str, int, int]]:
    return []


@pytest.fixture(scope="module")
def pages(
    results: Path, progress: list[Any], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, str]:
    """All reports, rendered once, by file name."""
    out = tmp_path_factory.mktemp("out") / "deep" / "reports"
    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(home))
        index = render([], results, out, progress=lambda *step: progress.append(step))
    assert index == out / "index.html"
    assert not list(home.glob(".ipython")) + list(home.glob(".jupyter")) + list(home.glob(".local"))
    return {path.name: path.read_text("utf-8") for path in out.iterdir()}


class Links(HTMLParser):
    """Everything that a page refers to or loads."""

    def __init__(self, html: str):
        super().__init__()
        self.found: list[str] = []
        self.tags: set[str] = set()
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.found += [
            v or "" for k, v in attrs if k in {"src", "href", "srcset", "data", "action"}
        ]


def test_the_shipped_reports() -> None:
    assert report_names() == NAMES


def test_all_pages_are_there_and_nothing_else(pages: dict[str, str]) -> None:
    assert sorted(pages) == ["index.html", "mission.html", "performance.html"]


def test_pages_load_nothing(pages: dict[str, str]) -> None:
    for html in pages.values():
        links = Links(html)
        assert not {"script", "link", "iframe", "object"} & links.tags
        for target in links.found:
            assert target.startswith("data:image/svg+xml;base64,") or target in pages
        drawings = [b64decode(data) for data in EMBEDDED.findall(html)]
        assert drawings
        for drawing in drawings:
            assert set(re.findall(rb'href="(.)', drawing)) == {b"#"}
        assert not re.search(r"//[a-z]|url\(|@import", EMBEDDED.sub("", html))


def test_pages_tell_no_places_and_no_times(pages: dict[str, str], results: Path) -> None:
    for html in pages.values():
        assert str(results) not in html
        assert str(Path(module.__file__).parents[1]) not in html
        assert not re.search(r"\b\d\d:\d\d:\d\d\b|\b20\d\d-\d\d-\d\d\b", html)


def test_pages_show_results_and_no_mishaps(pages: dict[str, str]) -> None:
    assert pages["mission.html"].count("<img ") == 3
    assert pages["performance.html"].count("<img ") == 8
    assert pages["index.html"].count("<img ") == len(NAMES)
    for name in NAMES:
        main = EMBEDDED.sub("", pages[f"{name}.html"].split("<main")[1])
        assert not re.search(r"Traceback|Warning|stderr|&lt;Figure|NaN|\bnan\b", main)
        assert f'href="{name}.html"' in pages["index.html"]


def test_the_performance_page_tells_the_means(pages: dict[str, str], results: Path) -> None:
    from analysis import load_results, summary

    rows = summary(load_results(results / "table4").missions)
    for _, row in rows[rows["metric"] != "reward"].iterrows():
        shown = f"{row['mean']:.1%}".replace("%", " %")
        text = f"{shown} [{100 * row['low']:.1f}, {100 * row['high']:.1f}]"
        assert text in pages["performance.html"]


def test_progress_counts_the_cells(pages: dict[str, str], progress: list[Any]) -> None:
    for name in NAMES:
        steps = [(done, total) for report, done, total in progress if report == name]
        assert [done for done, _ in steps] == list(range(1, steps[-1][1] + 1))


def test_the_same_results_give_the_same_bytes(
    pages: dict[str, str], results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TZ", "Pacific/Auckland")
    monkeypatch.setenv("PYTHONHASHSEED", "7")
    copy = tmp_path / "elsewhere"
    copy.symlink_to(results)
    render(["mission"], copy, tmp_path / "again")
    assert (tmp_path / "again" / "mission.html").read_text("utf-8") == pages["mission.html"]


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
    (tmp_path / "fig4").symlink_to(results / "table4")
    with pytest.raises(InputError, match="fig4 holds study table4"):
        render(["mission"], tmp_path, tmp_path / "out")


def test_a_folder_that_cannot_be_written_is_refused(results: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="out: .*file.* cannot be written"):
        render(["mission"], results, tmp_path / "file" / "out")


@pytest.mark.parametrize("name", ["speed", "results"])
def test_an_unknown_parameter_is_refused(results: Path, tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=f"parameter: '{name}' is unknown to mission"):
        render(["mission"], results, tmp_path / "out", parameters={name: 1})


def test_parameters_follow_the_cell_that_they_override() -> None:
    report = module._read("mission")
    module._set_parameters(report, {"results": "here", "policy": "tour", "other": 1})
    tagged = module._parameter_cell(report)
    assert report.notebook.cells[tagged + 1].source == "results = 'here'\npolicy = 'tour'"


@pytest.mark.parametrize("name", NAMES)
def test_notebooks_have_a_heading_a_description_and_studies(name: str) -> None:
    report = module._read(name)
    assert report.title and "#" not in report.title
    assert len(report.description.split()) > 10
    assert report.studies


@pytest.mark.parametrize(("deaths", "runs"), [(1, 2), (2, 2)])
def test_a_kernel_that_dies_at_its_start_gets_one_more_try(
    results: Path, monkeypatch: pytest.MonkeyPatch, deaths: int, runs: int
) -> None:
    tries = []

    def die(client: Any, _: Any) -> None:
        tries.append(client)
        if len(tries) <= deaths:
            raise RuntimeError("Kernel died before replying to kernel_info")

    monkeypatch.setattr(module, "_run", die)
    fails = pytest.raises(ReportError, match="^report mission: Kernel died")
    with fails if deaths > 1 else nullcontext():
        module._execute(module._read("mission"), results, None)
    assert len(tries) == runs


def test_a_kernel_that_dies_in_a_cell_gets_no_other_try(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries = []

    def die(client: Any, _: Any) -> None:
        tries.append(client)
        client.on_cell_complete(cell=None, cell_index=0)
        raise RuntimeError("Kernel died")

    monkeypatch.setattr(module, "_run", die)
    with pytest.raises(ReportError, match="^report mission: Kernel died$"):
        module._execute(module._read("mission"), results, None)
    assert len(tries) == 1


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
raise ArithmeticError("no such number")
"""


def test_a_failing_notebook_is_named_and_leaves_the_pages_as_they_were(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mission.html").write_text("before")
    monkeypatch.setattr(jupytext, "reads", lambda *_, **__: READS(FAILING, fmt="py:percent"))
    with pytest.raises(ReportError, match="^report mission: ArithmeticError: no such number$"):
        render(["mission"], results, tmp_path)
    assert os.listdir(tmp_path) == ["mission.html"]
    assert (tmp_path / "mission.html").read_text() == "before"
