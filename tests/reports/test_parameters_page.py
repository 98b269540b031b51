"""The page on scenario parameters tells what the studies found."""

from pathlib import Path

import pandas as pd
import pytest

from analysis import load_results, load_study, numbers, run_study
from analysis.names import METRICS, PRODUCT
from analysis.questions import main_effects as effects
from analysis.questions import summary as findings
from analysis.replication.claims import FIG_5
from analysis.replication.rules import NO_RESULTS
from analysis.replication.scorecard import scorecard
from tests.reports.small import run_small_studies, said_by


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Small results; the sensitivity's success is the same everywhere."""
    names = ("fig5", "sweet-spot", "sensitivity")
    return run_small_studies(tmp_path_factory.mktemp("results"), *names)


def test_the_page_tells_what_the_studies_found(results: Path) -> None:
    text = said_by("parameters", results=str(results))
    fig5 = load_results(results / "fig5")
    table = effects.effects(fig5)
    for policy in ("ddqn", "greedy"):  # random is neither learned nor the best heuristic
        for field in ("uavs", "initial_data"):
            pairs = effects.changes(fig5, table, policy, field, PRODUCT)
            assert f"{policy} {effects.shape(pairs).words}" in text
    sweet = load_results(results / "sweet-spot")
    for _, row in findings.checks(sweet).iterrows():
        if row["metric"] in METRICS:
            assert numbers.interval(row["mean"], row["low"], row["high"]) in text
    for row in findings.selections(sweet).itertuples():
        assert row.guarantee in text
    for _, row in findings.sensitivities(load_results(results / "sensitivity")).dropna().iterrows():
        assert numbers.interval(row["total"], row["total_low"], row["total_high"]) in text
    assert "random falls" not in text and "random rises" not in text


def test_verdicts_are_those_of_the_scorecard(results: Path) -> None:
    text = said_by("parameters", results=str(results))
    studies = {name: load_results(results / name) for name in ("fig5", "sweet-spot")}
    rows = [row for row in scorecard(studies, pd.DataFrame()) if row.section == FIG_5]
    told = [row for row in rows if row.findings[0].verdict != NO_RESULTS]
    assert len(told) > 5
    for row in told:
        assert f"- {row.claim.text}: {row.findings[0].verdict}" in text
        assert row.rule in text
    assert f"So for ddqn, of {len(told)} claims" in text


def test_without_a_learned_policy_the_heuristics_are_shown(results: Path, tmp_path: Path) -> None:
    folder = tmp_path / "results"
    folder.mkdir()
    for name in ("sweet-spot", "sensitivity"):
        (folder / name).symlink_to(results / name)
    run_study(load_study("fig5", policies=["random", "greedy"], missions=4), folder / "fig5")
    text = said_by("parameters", results=str(folder))
    assert "if there is one, and the best heuristic: greedy." in text
    assert "their verdicts for greedy" in text
