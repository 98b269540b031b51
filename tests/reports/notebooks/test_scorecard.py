"""The page of the scorecard on small results: a row per claim, and a verdict for each."""

import pytest

from analysis.paper.measures import VERDICTS
from tests.reports.small import run_small_studies, shown_by, words

STUDIES = ("table4", "fig4", "fig5", "sweet-spot")


@pytest.fixture(scope="module")
def html(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = run_small_studies(tmp_path_factory.mktemp("results"), *STUDIES)
    return shown_by("scorecard", results=str(folder))


def test_every_claim_has_a_row_and_a_verdict(html: str) -> None:
    claims = html.count('<tr class="claim">')
    assert claims >= 15
    assert sum(words(html).count(verdict) for verdict in VERDICTS) >= claims
