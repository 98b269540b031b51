"""The shipped reports rendered in full: complete, self-contained, the same bytes everywhere."""

import json
import re
import shutil
from base64 import b64decode
from typing import Any

import pytest

from dess import InputError
from dess.analysis import load_results
from dess.analysis.answers.policies import decision_times
from dess.analysis.answers.policies.decision_times import Cost, Times
from dess.analysis.results.chunks import DERIVED
from dess.analysis.results.tables import Results
from dess.reports.pages.notebook import NAMES, read_report
from dess.reports.pages.page import STUDY, Page
from dess.reports.pages.render import render
from tests.reports.pages.test_render import another_environment
from tests.reports.small import EMBEDDED, Links, run_small_studies, said_by, words, words_of

pytestmark = pytest.mark.slow

# Parameters of what would take long: missions of questions, and what own-sea requires and pays. At
# its price, a UAV that may be lost would ask for thousands of missions.
QUICK: dict[str, Any] = {"missions": 40, "requirements": {"success": 0.9}}
QUICK["prices"] = {"uav": 20_000, "pad": 10_000, "charge": 2, "hour": 100, "slot_seconds": 60}
QUICK["prices"]["lost_uav"] = 100
# The width of the text on A4 [px], and the elements that reach beyond a width.
A4 = 688
BEYOND = """[...document.querySelectorAll("main *")].filter(
    e => e.checkVisibility() && e.getBoundingClientRect().right > {} + 1
).map(e => e.outerHTML.slice(0, 80))"""

# Sections of which only the heading is there; tables that are wider than their place.
EMPTY = """[...document.querySelectorAll("main section")].filter(
    (section) => section.checkVisibility() && section.offsetHeight
        < 1.5 * section.querySelector("h2")?.offsetHeight
).map((section) => section.id)"""
HIDING = """[...document.querySelectorAll(".scroll")].filter(
    (place) => place.scrollWidth > place.clientWidth + 1
).map((place) => place.ariaLabel)"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Small results of all studies that the reports read."""
    return run_small_studies(tmp_path_factory.mktemp("results"))


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("out") / "deep" / "reports"


def timed(results: Results, **_: Any) -> Times:
    """Times of decisions that are the same on every machine."""
    same = {"calls": 100, "median": 2e-5, "slow": 5e-5, "batch": 1e-6}
    return Times(processor="a processor", costs=[Cost(policy=p, **same) for p in results.policies])


@pytest.fixture(scope="module")
def files(results, out):
    """All files of the reports, rendered once, by name."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(decision_times, "measure_decision_times", timed)
        render([], results, out, parameters=QUICK)
    return {path.name: path.read_text("utf-8") for path in out.iterdir()}


@pytest.fixture(scope="module")
def pages(files):
    return {name: text for name, text in files.items() if name.endswith(".html")}


@pytest.mark.brief
def test_pages_load_nothing(pages, files):
    for name, html in pages.items():
        links = Links(html)
        assert not {"link", "iframe", "object"} & links.tags
        for target in links.found:
            page, _, section = target.partition("#")
            if not target.startswith("data:"):
                assert page in {"", *files}
                assert not section or f'id="{section}"' in files[page or name]
        for drawing in map(b64decode, EMBEDDED.findall(html)):
            # Some refer to nothing.
            assert set(re.findall(rb'href="(.)', drawing)) <= {b"#"}
        assert not re.search(r"//[a-z]|url\(|@import", links.outside_scripts)


@pytest.mark.brief
@pytest.mark.parametrize("name", NAMES)
def test_every_page_answers_with_a_number(pages, name):
    (lead,) = re.findall('<p class="lead"[^>]*>(.*?)</p>', pages[f"{name}.html"], re.S)
    assert re.search(r"\d", words(lead))


@pytest.mark.brief
def test_every_page_carries_the_evidence_of_its_studies(pages, results):
    for name in NAMES:
        evidence_of_page = [
            json.loads(text) for text in Page(pages[f"{name}.html"]).find_hidden(STUDY)
        ]
        studies = read_report(name).studies
        shown = [evidence["study"]["name"] for evidence in evidence_of_page]
        assert shown[: len(studies)] == studies
        for evidence in evidence_of_page[: len(studies)]:
            manifest = load_results(results / evidence["study"]["name"]).store.manifest
            assert evidence["key"] == manifest.key
            for field in ("commit", "version", "libraries", "seed", "scenario"):
                assert evidence[field] == manifest.data[field]
            assert evidence["policies"] == manifest.data["policies"]
            assert manifest.key in words_of(pages[f"{name}.html"])


@pytest.mark.brief
@pytest.mark.parametrize("odd", ["none", {"uavs": 1}])
# Missions that the pages read are beside the results.
@pytest.mark.usefixtures("pages")
def test_a_page_refuses_parameters_of_another_kind(odd, results):
    """Such as a policy that the study lacks, or a table in place of a number."""
    without_missions = (name for name in NAMES if "missions" not in read_report(name).parameters)
    for name in without_missions:
        for parameter in read_report(name).parameters.keys() - {"results", "longer"}:
            with pytest.raises(InputError):
                said_by(name, results=str(results), **{parameter: odd})


def test_all_pages_are_the_same_bytes_elsewhere(pages, results, out, tmp_path, monkeypatch):
    another_environment(results, out, tmp_path, monkeypatch)
    copy = tmp_path / results.name
    # Simulated anew, like the missions drawn.
    for asked in ("what-if", "sweeps"):
        shutil.rmtree(copy / asked)
    for path in copy.glob(f"*/{DERIVED}/*.parquet"):
        path.unlink()
    render([], copy, tmp_path / "new", parameters=QUICK)
    for name, html in pages.items():
        assert (tmp_path / "new" / name).read_text("utf-8") == html


@pytest.mark.brief
@pytest.mark.parametrize("width", [1280, 390])
def test_pages_fit_the_window_and_request_nothing(visit, pages, out, width):
    for name in pages:
        opened = visit(out / name, width)
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= width
        assert opened.requests == [(out / name).as_uri()]
        assert opened.complaints == []


def test_pages_fit_the_paper(visit, pages, out):
    """And below every heading on it there is something."""
    for name in pages:
        page = visit(out / name, A4).page
        page.emulate_media(media="print")
        assert page.evaluate(BEYOND.format(A4)) == [], name
        assert page.evaluate(EMPTY) == [], name


def test_no_table_hides_a_column_on_a_usual_screen(visit, pages, out):
    for name in pages:
        assert visit(out / name, 1280).page.evaluate(HIDING) == [], name
