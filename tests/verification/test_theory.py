"""The simulator agrees with exact theory, and the kept page has what was measured."""

import re
from pathlib import Path
from typing import Any

import pytest

from dess.analysis import load_study, run_study
from dess.analysis.stats.verdict import HOLDS, REFUTED
from tests.pins.pinned import check_kept
from tests.verification.checks import TOPICS, judge_checks
from tests.verification.page import KEPT, render_page, studies_by_name
from tests.verification.suite import STUDY, Suite

PAGE = KEPT / "checks.md"
BLOCK = 100  # missions
# Studies beside it, whose missions keep their data: with failures, ages, queues and many UAVs.
OTHERS = ("failures", "age", "pads", "fig4")


def suite_of(folder: Path, again: int, of_others: int, **changes: Any) -> Suite:
    """The suite of the study, and of some missions of the others.

    Args:
        folder: Where the results are kept.
        again: Missions of every policy to simulate again.
        of_others: Missions of each design point of the others.
        **changes: Fields of the study.
    """
    study = run_study(load_study(STUDY, **changes), folder / STUDY)
    others = [
        run_study(
            load_study(name, policies=["greedy"], missions=of_others, logged=0), folder / name
        )
        for name in OTHERS
    ]
    return Suite(study, studies_by_name(others), again)


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    return suite_of(tmp_path_factory.mktemp("theory"), again=50, of_others=200)


@pytest.fixture(scope="module")
def judged(suite):
    return judge_checks(suite.checks(BLOCK))


@pytest.mark.slow
@pytest.mark.parametrize("topic", TOPICS)
def test_the_simulator_agrees_with_theory(judged, topic):
    rows = judged[judged["topic"] == topic]
    assert len(rows)
    assert rows.loc[rows["verdict"] != HOLDS, "test"].tolist() == []


@pytest.mark.slow
def test_the_page_has_what_was_measured(suite, judged):
    check_kept(PAGE, render_page(suite, judged, BLOCK))


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    folder = tmp_path_factory.mktemp("few")
    return suite_of(folder, again=2, of_others=1, missions=200, logged=8)


def frame_of(page: str) -> list[str]:
    """What a page says whatever was measured: its text without numbers, and the names of checks."""
    lines = []
    for line in page.splitlines():
        cells = line.split(" | ")
        if line.startswith("| ") and len(cells) > 3:
            line = " | ".join(cells[:2])
        lines.append(re.sub(r"[\d.,]+", "0", line))
    return lines


def test_the_kept_page_is_that_of_these_checks(few):
    """Its text and the names of its checks, without what only many missions can show."""
    judged = judge_checks(few.checks(20))
    assert REFUTED not in set(judged["verdict"])
    page = render_page(few, judged, 20)
    assert frame_of(page) == frame_of(PAGE.read_text("utf-8"))
