"""A page whose optional results are missing says how to make them."""

from tests.reports.small import run_small_studies, said_by


def test_without_the_study_of_the_gap_the_page_says_how_to_run_it(tmp_path):
    run_small_studies(tmp_path, "table4", "fig4")
    said = said_by("performance", results=str(tmp_path))
    assert "is not known here: `dess study run gap` computes" in said
