"""The page of a sea with a data sheet: for the one who pays, on one sheet of paper."""

from dess.analysis import load_results
from dess.analysis.ask import around, limit_search
from dess.analysis.ask.answer import settings_answer
from dess.analysis.ask.question import sweep_question
from dess.reports.pages.render import render_study
from dess.reports.pages.study import make_study_report
from tests.analysis.small import SHEET, write_scenario
from tests.reports.here import notebooks_here
from tests.reports.small import said_by, words_of

A4 = 182, 269  # less the margins [mm]
PIXEL = 25.4 / 96  # [mm]
SHEET_OF_PAPER = ("h1", "figure.lead", ".facts", "main > .gallery", ".assumptions")


def test_a_sheet_needs_no_prices_and_prices_no_requirement(tmp_path):
    """The page names the best setting, and the policy that flies there."""
    scenario = write_scenario(tmp_path, **SHEET)
    for prices in (None, {"uav": 20_000}):
        asked = {"prices": prices, "folder": tmp_path / "results"}
        question = sweep_question({"uavs": (1, 2)}, scenario, ["greedy"], 10, **asked)
        report = make_study_report(question.ask())
        said = said_by(report, results=str(question.out))
        assert "The best is greedy with " in said
        assert "greedy, which knows the data left" in said
        assert ("a UAV 20,000 EUR" in said) == bool(prices)


def test_the_page_of_an_own_sea_tells_what_the_terminal_tells(tmp_path):
    scenario = write_scenario(tmp_path, **SHEET)
    said = said_by(
        "own-sea",
        results=str(tmp_path / "results"),
        scenario=str(scenario),
        fields={"uavs": [1, 2]},
        policies=["greedy"],
        prices={"uav": 20_000, "hour": 30, "years": 5, "days": 200},
        requirements={"success": 0.6, "age": "50 min"},
        missions=3,
    )
    folder, _ = sorted(
        (tmp_path / "results" / "sweeps").glob("*/"), key=lambda path: len(path.name)
    )
    found = load_results(folder)
    answer = settings_answer(found)
    for fact in (*answer.facts(), *answer.assumptions()):
        assert fact.found in said
    assert "EUR a year" in said
    assert "The panel of this page has no costs" not in said
    assert "Its age of information is the median." in said


def test_the_answer_the_figure_and_what_is_assumed_are_one_sheet_of_paper(tmp_path, visit):
    question = sweep_question(
        {"uavs": (1, 2)},
        write_scenario(tmp_path, **SHEET),
        ["greedy"],
        10,
        prices={"uav": 20_000},
        requirements={"success": 0.6, "age": "50 min"},
        folder=tmp_path / "results",
    )
    found = question.ask()
    around.question_around(found, question.study.scenario, 5).ask()
    limit_search.find_limits(found, question.study.scenario, missions=3)
    with notebooks_here(is_drawn=True):
        path = render_study(found, tmp_path / "reports")
    text = words_of(path.read_text("utf-8"))
    for words in ("21 s, a hundredth", "315 m wide", "wind that it bears", "one more UAV"):
        assert words in text
    assert "slots" not in text.split("How this page was made")[0].replace("communication slots", "")
    page = visit(path, round(A4[0] / PIXEL)).page
    told = ["Why", "What if", "What the model leaves out", "How this page was made"]
    assert [each for each in page.locator("h2").all_inner_texts() if each in told] == told
    page.emulate_media(media="print")
    tops = [page.locator(name).bounding_box() for name in SHEET_OF_PAPER]
    assert [box["y"] for box in tops] == sorted(box["y"] for box in tops)
    assert (tops[-1]["y"] + tops[-1]["height"]) * PIXEL < A4[1]
    box = page.locator(".assumptions")
    assert box.evaluate("box => getComputedStyle(box).breakAfter") == "page"
    link = box.locator("a").get_attribute("href")
    assert page.locator(f"h2{link}").count() == 1
