"""Pages of few or no results say so; pages of sound results are kept."""

from dess.analysis import load_study, run_study
from dess.analysis.stats.verdict import REFUTED
from dess.analysis.verification.measurements import simulate_missions, write
from tests.reports.small import run_small_studies, said_by

NAME = "verification"


def test_too_few_missions_are_not_taken_for_a_proof(tmp_path):
    few = load_study(NAME, policies=["random"], missions=3, logged=1)
    write(simulate_missions(run_study(few, tmp_path / NAME), 2), tmp_path)
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "manifest.json").write_text("{}")
    text = said_by(NAME, results=str(tmp_path), block=20)
    assert "the others are inconclusive" in text
    assert "Too few observations for" in text
    assert "not read, incomplete or of other code: broken" in text
    assert REFUTED not in text


def test_without_the_study_of_the_gap_the_page_says_how_to_run_it(tmp_path):
    run_small_studies(tmp_path, "table4", "fig4")
    said = said_by("performance", results=str(tmp_path))
    assert "is not known here: `dess study run gap` computes" in said
