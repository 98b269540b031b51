"""The page on performance has the gap of the planner where its study was run."""

from pathlib import Path

import pytest

from analysis import load_results, load_study, numbers, run_study
from analysis.answers import comparison, optimality
from analysis.metrics import BOUND
from tests.reports.small import quick, run_small_studies, said_by, words

NAMES = {"planner": "tour", "longer": "greedy", "learner": "random"}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    study = load_study("gap", policies=[*NAMES.values()], missions=30, logged=3)
    with quick():
        comparison.make(folder, run_study(study, folder / "gap"))
    return folder


def test_the_performance_page_has_the_gap_where_the_study_was_run(
    results: Path, tmp_path: Path
) -> None:
    run_small_studies(tmp_path, "table4", "fig4")
    without = said_by("performance", results=str(tmp_path))
    assert "is not known here: `dess study run gap` computes" in without
    (tmp_path / "gap").symlink_to(results / "gap", target_is_directory=True)
    text = said_by("performance", results=str(tmp_path))
    study = load_results(tmp_path / "gap")
    assert words(optimality.in_words(study))[:60] in text
    table = optimality.by_fleet(study)
    assert numbers.percent(table[BOUND].iloc[0]) in text or optimality.useful(table).empty
