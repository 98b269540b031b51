"""The page of a study has the sections that its design, its rules and its policies ask for."""

import re
from html import unescape

import pytest

from dess.analysis import load_results
from dess.reports.pages.notebook import SHIPPED
from dess.reports.pages.study import find_shown_parts, make_study_report
from tests.analysis.small import grid
from tests.reports.small import shown_by

PRECISION = {"first": 5, "look_ahead": 2, "budget": 12,
             "targets": {"collection_ratio": {"absolute": 0.05}}}  # fmt: skip
SELECTION = {"procedure": "kn-bounded", "first": 5, "indifference": 0.05, "budget": 60, "check": 9}
SEARCH = {"procedure": "cheapest", "requirements": {"collection_ratio": 0.1}, "first": 20,
          "tolerance": 0.05, "indifference": 100, "budget": 8000, "check": 9}  # fmt: skip
# What is changed in the small study, what the page says, and what it does not.
STUDIES = {
    "a single point": (
        {},
        ["The best is ", "of 1 others", "Means with 95 % intervals", "Single missions"],
        ["Effects of the fields", "baseline", "Sobol", "The selection"],
    ),
    "two fields": (
        {"design": grid(uavs=[1, 2], pads=[1, 2]), "policies": ["greedy"]},
        ["Orange frames: cells that may be the best by what was seen", "n = 10 missions per cell"],
        ["Comparison of the policies", "replications per cell"],
    ),
    "four fields": (
        {"design": grid(uavs=[1, 2], pads=[1, 2], quota=[20, 60], charge_start=[10, 15])},
        ["n = 10 replications per cell. One panel for each", "Cells are averaged over"],
        ["Sobol"],
    ),
    "one at a time": (
        {"design": {"kind": "one-at-a-time", "values": {"uavs": [1, 2], "quota": [20, 60]}}},
        ["The lowest panel shows the paired difference"],
        ["Orange frames", "One panel for each field"],
    ),
    "sensitivity": (
        {"design": {"kind": "saltelli", "base": 8, "ranges": {"uavs": [1, 3], "quota": [20, 60]}},
         "missions": 1},
        ["A Sobol index is the share", "A dot is the mean over the missions with the value"],
        ["The best setting", "Comparison with a baseline", "All policies and all design points"],
    ),
    "a selection": (
        {"design": grid(uavs=[1, 3]), "selection": SELECTION},
        ["The selection", "The setting that was selected", "The check of the selected settings"],
        ["Comparison of the policies"],
    ),
    "a search for a fleet": (
        {"design": grid(uavs=[1, 2]), "costs": {"uav": 20_000}, "selection": SEARCH},
        [
            "at least ",
            "met: the answer",
            "a UAV 20,000 EUR",
            "battery for the way home",
            "These figures show the fleet of the answer",
            "The check of the selected fleets",
        ],
        ["The best setting", "≈: may be the best", "Pareto front", "Comparison with a baseline"],
    ),
    "a precision": (
        {"precision": PRECISION, "policies": ["greedy"]},
        ["The precision", "Half-widths of 95 % intervals", "The best is greedy"],
        ["Comparison of the policies", "All others"],
    ),
}  # fmt: skip


# The other studies are left to the longer proofs: every page takes a second or two.
QUICK = ("two fields", "a selection", "a search for a fleet")
LONG = [pytest.mark.slow, pytest.mark.brief]


def page_of(folder, **parameters):
    """The texts of the page and of its drawings, without rendering it."""
    report = make_study_report(load_results(folder))
    texts = [cell.source for cell in report.notebook.cells if cell.cell_type == "markdown"]
    shown = shown_by(report, results=str(folder), **parameters)
    shown = re.sub('<section id="panel".*?</section>', "", shown, flags=re.S)  # on every page
    shown = re.sub("<script.*?</script>", "", shown)
    bare = re.sub(r"[`*]|<[^>]*>", "", " ".join([*texts, shown]))
    return " ".join(unescape(bare).split())


@pytest.mark.parametrize(
    "name",
    [n if n in QUICK else pytest.param(n, marks=LONG) for n in STUDIES],
)
def test_the_page_says_what_the_study_can_answer(name, studied):
    changes, said, unsaid = STUDIES[name]
    text = page_of(studied(**changes).store.folder)
    for part in said:
        assert part in text, part
    for part in unsaid:
        assert part not in text, part
    assert "dess simulate --of results/trial " in text  # the worst missions


def test_tags_of_the_notebook_are_those_that_have_a_meaning(studied):
    used = {*re.findall(r'"(if-[a-z-]+)"', (SHIPPED / "study.py").read_text("utf-8"))}
    assert used == {*find_shown_parts(studied(), [])}


def test_parameters_choose_the_metric_and_the_baseline(studied):
    study = studied(design=grid(uavs=[1, 2]), policies=["greedy"])
    text = page_of(study.store.folder, metric="reward", baseline=1)
    assert "compared with itself at design point 1: 2 UAVs." in text
    assert re.search(r"The best is greedy with \d UAVs?: reward −?[\d,.]+ ", text)


@pytest.mark.slow
@pytest.mark.brief
def test_pages_say_when_a_trained_policy_acts_outside_of_its_training(tmp_path, studied):
    """That of a study, and of a what-if question, be it on one side only."""
    question = {"settings": {"quota": 600}, "baseline": {}, "policies": ["ddqn"], "missions": 2}
    shown = shown_by("what-if", results=str(tmp_path), **question)
    note = "Note:** ddqn acts outside of its training: quota 440 to 600 (trained on 440)."
    assert note in shown
    assert "Note:" not in page_of(studied().store.folder)
