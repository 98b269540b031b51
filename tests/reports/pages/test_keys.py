"""A page is rendered again if and only if something that it depends on has changed."""

import shutil
from pathlib import Path

import pytest

from dess.analysis import load_results, run_study
from dess.reports.pages import finished, kernels
from dess.reports.pages.render import render as render_pages
from dess.reports.pages.render import render_study
from tests.analysis.small import small_study
from tests.reports.pages.test_render import MISSION, SCORECARD, results, write_notebooks

__all__ = ["results"]

WITHOUT_STUDIES = SCORECARD.replace("studies: []", "studies: []\n#     optional: [extra]")


@pytest.fixture
def rendered(monkeypatch):
    """The names of the pages that are rendered, each with a cell that shows a number."""
    names: list[str] = []
    monkeypatch.setattr(
        kernels, "run_reports", lambda reports, *_: names.extend(report.name for report in reports)
    )
    return names


class Folder:
    """Results, notebooks and pages, and what was rendered since the last call."""

    def __init__(self, place: Path, results: Path, rendered: list[str]):
        self.results = shutil.copytree(results, place / "results")
        self.notebooks = write_notebooks(place / "n", mission=MISSION, scorecard=WITHOUT_STUDIES)
        self.out, self.rendered = place / "out", rendered

    def render(self, **parameters: str) -> set[str]:
        self.rendered.clear()
        render_pages([], self.results, self.out, parameters=parameters, notebooks=self.notebooks)
        return {*self.rendered}


@pytest.fixture
def folder(tmp_path, results, rendered):
    """Pages that were rendered; one reads a study, the other one only if it is there."""
    folder = Folder(tmp_path, results, rendered)
    assert folder.render() == {"mission", "scorecard"}
    yield folder


def test_unchanged_pages_are_not_rendered_again(folder):
    before = {path.name: path.read_bytes() for path in folder.out.iterdir()}
    assert folder.render() == set()
    assert {path.name: path.read_bytes() for path in folder.out.iterdir()} == before


def test_other_results_change_the_pages_that_read_them(folder, tmp_path):
    shutil.rmtree(folder.results / "trial")
    run_study(small_study(tmp_path, missions=11), folder.results / "trial")
    assert folder.render() == {"mission"}
    run_study(small_study(tmp_path, missions=3), folder.results / "extra")
    assert folder.render() == {"scorecard"}


def test_another_notebook_changes_its_page(folder):
    write_notebooks(folder.notebooks, mission=MISSION.replace("head(3)", "head(4)"))
    assert folder.render() == {"mission"}


@pytest.mark.parametrize("what", ["code", "library"])
def test_other_code_and_libraries_change_all_pages(folder, tmp_path, monkeypatch, what):
    finished._hash_software.cache_clear()
    if what == "library":
        monkeypatch.setattr(finished.metadata, "distributions", list)
    else:
        shutil.copytree(finished.PACKAGE / "reports", tmp_path / "reports")
        (tmp_path / "reports/templates/style.css").write_text("")
        (tmp_path / "dess").mkdir()
        (tmp_path / "dess/reports").symlink_to("../reports")
        monkeypatch.setattr(finished, "PACKAGE", tmp_path / "dess")
    assert folder.render() == {"mission", "scorecard"}
    finished._hash_software.cache_clear()


def test_code_beside_the_package_counts_without_links_to_it(tmp_path, monkeypatch):
    (tmp_path / "dess").mkdir()
    monkeypatch.setattr(finished, "PACKAGE", tmp_path / "dess")
    (tmp_path / "dess/policies").write_text("../policies")
    (tmp_path / "policies").mkdir()
    (tmp_path / "policies/planner.py").write_text("before = 1")
    before = finished._hash_software.__wrapped__()
    assert finished._hash_software.__wrapped__() == before
    (tmp_path / "policies/planner.py").write_text("after = 1")
    assert finished._hash_software.__wrapped__() != before


def test_pages_that_are_altered_or_gone_are_rendered_again(folder):
    page = folder.out / "mission.html"
    page.write_text(page.read_text("utf-8").replace("A trial", "A trail"), "utf-8")
    (folder.out / "scorecard.html").unlink()
    assert folder.render() == {"mission", "scorecard"}


def test_pages_with_parameters_are_always_rendered(folder):
    for _ in range(2):
        assert folder.render(policy="random") == {"mission", "scorecard"}
    assert folder.render() == {"mission", "scorecard"}


def test_the_page_of_a_study_is_rendered_once(results, tmp_path, rendered):
    for _ in range(2):
        render_study(load_results(results / "trial"), tmp_path)
    assert rendered == ["study-trial"]
