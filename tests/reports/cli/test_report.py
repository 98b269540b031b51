"""``dess report`` and ``dess study run --report``: which pages are rendered, and from what."""

from pathlib import Path

import pytest

from dess.reports.pages import notebook, render


@pytest.fixture
def run_trial(dess):
    """Runs a small study into a folder."""

    def run(folder):
        assert dess("study", "run", "trial.toml", "--missions", 2, "--out", folder)[0] == 0

    return run


def test_names_are_reports_and_folders_are_studies(dess, unrendered, run_trial):
    run_trial("fleets")
    code, out, _ = dess(
        "report", "mission", "fleets", "--out", "pages", "--parameter", "policy='tour'"
    )
    assert (code, out.split()) == (0, ["pages/mission.html", "pages/study-trial.html"])
    assert unrendered == [
        ("mission", "results", "pages", {"policy": "tour"}),
        ("fleets", "pages", {"policy": "tour"}),
    ]


def test_a_folder_that_is_called_like_a_report_needs_a_separator(dess, unrendered, run_trial):
    run_trial("learning")
    assert dess("report", "learning")[0] == dess("report", "./learning")[0] == 0
    pages = str(Path("build", "reports"))
    assert unrendered == [("learning", "results", pages, {}), ("learning", pages, {})]


def test_without_arguments_all_reports_are_rendered(dess, unrendered):
    assert dess("report")[0] == 0
    assert unrendered == [("results", str(Path("build", "reports")), {})]


def test_a_study_is_run_and_its_page_rendered(dess, unrendered):
    code, out, _ = dess("study", "run", "trial.toml", "--missions", 2, "--report")
    assert code == 0
    assert out.splitlines()[-1] == str(Path("build", "reports", "study-trial.html"))
    assert [page[0] for page in unrendered] == [str(Path("results", "trial"))]


def test_a_notebook_that_fails_is_one_line(dess, run_trial, monkeypatch):
    def fail(*arguments, **options):
        raise render.ReportError("report study-fleets: cell 3 of 9 (x): ValueError: no such number")

    monkeypatch.setattr(render, "render_study", fail)
    run_trial("fleets")
    code, out, err = dess("report", "./fleets")
    assert (code, out) == (1, "")
    assert err.splitlines()[-1].startswith("dess: error: report study-fleets: cell 3 of 9")


def test_yes_is_for_the_notebooks_that_simulate(dess, unrendered):
    assert dess("report", "what-if", "--yes")[0] == dess("report", "sweep")[0] == 0
    assert [page[-1] for page in unrendered] == [{"yes": True}, {}]
    for name in ("what-if", "sweep", "own-sea"):
        assert notebook.read_report(name).parameters["yes"] is False


def test_formats_of_figures_are_named(dess, unrendered, refusal):
    assert "'gif' is unknown; allowed: svg, pdf, png" in refusal("report", "--figures", "pdf,gif")
    code, out, _ = dess("report", "mission", "--figures", "pdf, svg")
    where = Path("build", "reports")
    assert (code, out) == (0, f"{where / 'mission.html'}\nfigures: {where / '*-figures'}\n")


def test_a_parameter_that_a_study_refuses_is_refused_before_any_cell(
    run_trial, refusal, monkeypatch
):
    def fail(*_):
        raise AssertionError("a cell runs")

    monkeypatch.setattr("dess.reports.pages.kernels.run_reports", fail)
    run_trial("out")
    for value, words in {
        "baseline=99": "baseline: 99 is not a design point; allowed: 0..0",
        "metric='speed'": "metric: 'speed' is unknown",
        "speed=2": "parameter: 'speed' is unknown to study-trial",
    }.items():
        assert words in refusal("report", "./out", "--parameter", value)
