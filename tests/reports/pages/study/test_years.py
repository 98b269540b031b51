"""The page of a question about years with weather."""

from dess.analysis.ask import around
from dess.analysis.ask.answer import settings_answer
from dess.analysis.ask.question import sweep_question
from dess.reports.pages.study import make_study_report
from tests.analysis.small import write_years
from tests.reports.small import said_by

YEARS = {"years": 2}
CALM_MONTHS = (1, 4, 6, 9)  # years of few windows, which are simulated sooner


def titles_of(report):
    """The titles of the sections of a page."""
    lines = [line for cell in report.notebook.cells for line in cell.source.split("\n")]
    return {line.removeprefix("## ") for line in lines if line.startswith("## ")}


def test_the_page_of_a_search_has_the_calendar_the_years_and_what_decides(tmp_path, monkeypatch):
    monkeypatch.setattr(around, "YEARS", 1)
    scenario = write_years(tmp_path, calm=CALM_MONTHS)
    question = sweep_question(
        {"uavs": (2,)},
        scenario,
        ["greedy"],
        prices={"uav": 20_000, "years": 5},
        requirements={"age": "5000 h"},
        folder=tmp_path / "results",
        **YEARS,
    )
    found = question.ask()
    around.question_around(found, str(scenario)).ask()
    report = make_study_report(found)
    said = said_by(report, results=str(question.out))
    answer = settings_answer(found, question)
    for text in (
        answer.headline(),
        *(fact.found for fact in (*answer.facts(), *answer.assumptions())),
    ):
        assert text in said
    for text in ("The years of the answer", "one change at a time", "flights round the clock"):
        assert text in said
    for text in ("share of the missions", "worst missions"):
        assert text not in said
    titles = titles_of(report)
    assert {"What decides", "Year by year"} < titles
    assert not {"What if", "Single missions"} & titles


def test_the_page_of_settings_in_years_ranks_them_by_age(tmp_path):
    scenario = write_years(tmp_path, calm=CALM_MONTHS)
    question = sweep_question(
        {"uavs": (1, 2)}, scenario, ["greedy"], folder=tmp_path / "results", **YEARS
    )
    found = question.ask()
    report = make_study_report(found)
    said = said_by(report, results=str(question.out))
    assert "The best is greedy with 2 UAVs: age of information" in said
    assert "in the worst of 2 years." in said
    assert "Year by year" in titles_of(report)
    assert "Single missions" not in titles_of(report)
